// Orders to a live run: sent, and answered by a notice that says when they take effect or why not.

import { notify } from "../ui/notices.js";
import { faultInWords, seconds } from "../ui/words.js";

const since = ({ tick, t_ms }) => (t_ms === null ? "when its event happens" : `from ${seconds(t_ms, 2)} (tick ${tick})`);

/** Events after which there is nothing left to undo. */
const OVER = new Set(["healed", "disarmed", "failed"]);

export class Orders {
  #api;
  #model;
  #changed;
  // Ids of this page's faults that can be undone, latest last.
  #mine = [];

  constructor(api, model, changed) {
    this.#api = api;
    this.#model = model;
    this.#changed = changed;
  }

  /** Arms a fault, for so many simulated seconds if it is one that lasts; null: until it is cleared. Gives its id, or null. */
  async arm(fault, for_s = null) {
    const momentary = this.#model.isMomentary(fault);
    const order = momentary || for_s === null ? { fault } : { fault, for_s };
    const reply = await this.#ask({ fault: order });
    if (!reply?.armed) return null;
    const { id } = reply.armed;
    const lasting = order.for_s ? `, for ${order.for_s} s` : "";
    const line = `${id}: ${faultInWords(fault)} ${since(reply.armed)}${lasting}`;
    if (!momentary) this.#mine.push(id);
    notify("done", line, momentary ? null : { label: "Undo", run: () => this.clear(id) });
    return id;
  }

  /** Heals or disarms the fault of that id; null: all of them. */
  async clear(id) {
    const reply = await this.#ask({ clear: id });
    if (!reply?.cleared) return;
    const { ids } = reply.cleared;
    this.#mine = this.#mine.filter((each) => !ids.includes(each));
    notify("done", ids.length ? `${ids.join(", ")} undone ${since(reply.cleared)}` : "there was nothing to undo");
  }

  /** Undoes the latest of this page's orders that is not over yet. */
  undo() {
    const over = new Set(this.#model.events.filter(({ kind }) => OVER.has(kind)).map(({ subject }) => subject));
    const latest = this.#mine.findLast((id) => !over.has(id));
    if (latest) return this.clear(latest);
    notify("refused", "none of this page's orders is left to undo");
    return null;
  }

  /** A command to the step clock; gives its new status, or null. */
  async clock(command) {
    const reply = await this.#ask({ clock: command });
    this.#changed();
    return reply?.clock ?? null;
  }

  async #ask(command) {
    try {
      const reply = await this.#api.control(command);
      if (reply.refused) notify("refused", reply.refused);
      return reply.refused ? null : reply;
    } catch (error) {
      notify("refused", error.message);
      return null;
    }
  }
}

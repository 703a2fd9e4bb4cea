// Orders to a live run. A notice shows when an order takes effect, or why it is refused.

import { notify } from "../ui/notices.js";
import { faultInWords, seconds } from "../ui/words.js";

const effectTime = ({ tick, t_ms }) => (t_ms === null ? "when its event occurs" : `from ${seconds(t_ms, 2)} (tick ${tick})`);

/** Events after which a fault cannot be undone. */
const OVER = new Set(["healed", "disarmed", "failed"]);

export class Orders {
  #api;
  #model;
  #changed;
  // Ids of this page's faults that can be undone, latest last.
  #undoable = [];

  constructor(api, model, changed) {
    this.#api = api;
    this.#model = model;
    this.#changed = changed;
  }

  /** Arms a fault, for a number of simulated seconds if it has a duration; null: until it is cleared. Returns its id, or null. */
  async arm(fault, for_s = null) {
    const isInstantaneous = this.#model.isInstantaneous(fault);
    const order = isInstantaneous || for_s === null ? { fault } : { fault, for_s };
    const reply = await this.#send({ fault: order });
    if (!reply?.armed) return null;
    const { id } = reply.armed;
    const lasting = order.for_s ? `, for ${order.for_s} s` : "";
    const line = `${id}: ${faultInWords(fault, this.#model.run.faults)} ${effectTime(reply.armed)}${lasting}`;
    if (!isInstantaneous) this.#undoable.push(id);
    notify("done", line, isInstantaneous ? null : { label: "Undo", run: () => this.clear(id) });
    return id;
  }

  /** Heals or disarms a fault; null: all faults. */
  async clear(id) {
    const reply = await this.#send({ clear: id });
    if (!reply?.cleared) return;
    const { ids } = reply.cleared;
    this.#undoable = this.#undoable.filter((each) => !ids.includes(each));
    notify("done", ids.length ? `${ids.join(", ")} undone ${effectTime(reply.cleared)}` : "Nothing to undo");
  }

  /** Undoes the latest order of this page that is not over yet. */
  undo() {
    const over = new Set(this.#model.events.filter(({ kind }) => OVER.has(kind)).map(({ subject }) => subject));
    const latest = this.#undoable.findLast((id) => !over.has(id));
    if (latest) return this.clear(latest);
    notify("done", "This page has given no order that can be undone; the tab Faults lists all faults of the run");
    return null;
  }

  /** Sends a command to the step clock. Returns its new status, or null. */
  async clock(command) {
    const reply = await this.#send({ clock: command });
    this.#changed();
    return reply?.clock ?? null;
  }

  async #send(command) {
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

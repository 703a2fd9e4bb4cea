// The list of faults with phase, effect times, hits, and Undo.

import { faultRows } from "../model/faults.js";
import { attribute, byId, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { seconds } from "../ui/words.js";
import { openNewFault } from "./new_fault.js";

const MAX_ROWS = 100;

export class Faults {
  #model;
  #orders;

  constructor(model, orders) {
    this.#model = model;
    this.#orders = orders;
    byId("undo-all").addEventListener("click", () => this.#orders.clear(null));
    byId("new-fault").addEventListener("click", ({ currentTarget }) => openNewFault(this.#model.run, this.#orders, currentTarget));
  }

  draw() {
    const { view } = this.#model;
    if (!view) return;
    const count = view.faults.length;
    text(byId("fault-count"), count ? ` (${count})` : "");
    byId("undo-all").disabled = count === 0 || !this.#model.isOpen;
    byId("new-fault").disabled = !this.#model.isOpen;
    if (!isShown("faults")) return;
    const rows = faultRows(view, this.#model.eventsSoFar(), this.#model.run.faults).slice(0, MAX_ROWS);
    byId("no-faults").hidden = rows.length > 0;
    keyed(
      byId("fault-rows"),
      rows,
      ({ id }) => id,
      ({ id }) => this.#row(id),
      (row, fault) => this.#update(row, fault),
    );
  }

  #row(id) {
    const undo = this.#model.isLive
      ? el("button", { type: "button", "data-undo": id, onclick: () => this.#orders.clear(id) }, "Undo")
      : null;
    return el(
      "tr",
      { "data-fault": id },
      el("th", { scope: "row" }, id),
      el("td", { "data-field": "fault" }),
      el("td", { "data-field": "phase" }),
      el("td", { "data-field": "applied" }),
      el("td", { "data-field": "hits" }),
      el("td", {}, undo),
    );
  }

  #update(row, { words, terms, phase, applied_ms, healed_ms, hits, failed }) {
    const setField = (field, value) => text(row.querySelector(`[data-field=${field}]`), value);
    attribute(row, "data-phase", phase);
    setField("fault", words + terms);
    setField("phase", failed ? `failed: ${failed}` : phase === "in-force" ? "in force" : phase);
    const until = phase === "over" && healed_ms !== null ? ` to ${seconds(healed_ms, 2)}` : "";
    setField("applied", applied_ms === null ? "–" : seconds(applied_ms, 2) + until);
    setField("hits", hits ?? "");
    const undo = row.querySelector("[data-undo]");
    if (undo) {
      undo.hidden = phase === "over";
      undo.disabled = !this.#model.isOpen;
    }
  }
}

// Tools for the faults that only the mission knows: a button each, fields for what is to be stated, and the floor for a place.

import { fieldsOf, label, letters, ownFault } from "../model/own_faults.js";
import { attribute, byId, el } from "../ui/dom.js";
import { sentence } from "../ui/words.js";

export class FaultTools {
  #orders;
  // By the name of the tool: `{spec, button, fields}`, fields by key.
  #tools = new Map();

  constructor(specs, orders) {
    this.#orders = orders;
    for (const spec of specs) {
      // No other tool has such a name.
      const tool = `fault-${spec.name}`;
      const title = sentence(spec.about);
      const button = el("button", { type: "button", "data-tool-button": tool, title, "aria-pressed": "false" }, label(spec));
      const fields = new Map(fieldsOf(spec).map((argument) => [argument.key, field(argument)]));
      this.#tools.set(tool, { spec, button, fields });
      byId("fault-tools").append(button);
    }
    byId("fault-tools").hidden = specs.length === 0;
  }

  /** What the keys do beside those that are taken: `[{letter, about, tool}]`. The buttons tell them from now on. */
  keys(taken) {
    const tools = [...this.#tools];
    const found = letters(
      tools.map(([, { spec }]) => spec),
      taken,
    );
    return tools.flatMap(([tool, { spec, button }], index) => {
      const letter = found[index];
      if (letter === null) return [];
      attribute(button, "title", `${sentence(spec.about)} (${letter})`);
      return [{ letter, about: spec.about, tool }];
    });
  }

  /** Shows the fields of the tool in hand. */
  take(tool) {
    const form = byId("fault-fields");
    const taken = this.#tools.get(tool);
    form.hidden = !taken;
    if (!taken) return;
    const { spec, fields } = taken;
    const labels = [...fields.values()].map(({ element }) => element);
    form.replaceChildren(...labels, ...(spec.place ? [] : [el("button", { type: "submit", class: "main" }, label(spec))]));
    form.onsubmit = (event) => {
      event.preventDefault();
      if (!spec.place) this.#arm(taken, null);
    };
  }

  /** What to do with the tool; nothing if it is none of these. */
  hint(tool) {
    const { place, item } = this.#tools.get(tool)?.spec ?? {};
    if (!place) return "";
    return item ? "Click on an item, then on its place:" : "Click:";
  }

  /** A click on the floor, at that point in m, on that item or null. Tells whether the tool is one of these. */
  click(tool, point, item) {
    const taken = this.#tools.get(tool);
    if (!taken) return false;
    const { spec, fields } = taken;
    if (spec.item && item !== null) fields.get(spec.item).input.value = item;
    else if (spec.place) this.#arm(taken, point);
    return true;
  }

  #arm({ spec, fields }, point) {
    if (!byId("fault-fields").reportValidity()) return;
    const values = Object.fromEntries([...fields].map(([key, { input }]) => [key, input.valueAsNumber]));
    this.#orders.arm(ownFault(spec, values, point));
  }
}

/** The field of an argument: `{element, input}`. */
function field({ key, label: words, unit, about, from, to, is_whole, default: value }) {
  const input = el("input", {
    type: "number",
    min: from,
    max: to,
    step: is_whole ? 1 : "any",
    value,
    required: value === null,
    "data-field": key,
  });
  return { input, element: el("label", { class: "inline", title: sentence(about) }, words, input, unit) };
}

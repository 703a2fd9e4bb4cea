// Tools for the mission's own faults: a button for each, fields for its arguments, and a click on the floor for its place.

import { fieldsOf, label, letters, ownFault } from "../model/own_faults.js";
import { attribute, byId, el } from "../ui/dom.js";
import { sentence } from "../ui/words.js";

export class FaultTools {
  #orders;
  // `{spec, button, fields}` by the name of the tool; `fields` by key.
  #tools = new Map();

  constructor(specs, orders) {
    this.#orders = orders;
    for (const spec of specs) {
      // The prefix keeps the names apart from other tools.
      const tool = `fault-${spec.name}`;
      const title = sentence(spec.about);
      const button = el("button", { type: "button", "data-tool-button": tool, title, "aria-pressed": "false" }, label(spec));
      const fields = new Map(fieldsOf(spec).map((argument) => [argument.key, field(argument)]));
      this.#tools.set(tool, { spec, button, fields });
      byId("fault-tools").append(button);
    }
    byId("fault-tools").hidden = specs.length === 0;
  }

  /** Assigns free keys to the faults as `[{letter, about, tool}]` and adds them to the buttons' tooltips. */
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

  /** Shows the fields of the selected tool. */
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

  /** Returns the hint for a tool, or an empty text for any other tool. */
  hint(tool) {
    const { place, item } = this.#tools.get(tool)?.spec ?? {};
    if (!place) return "";
    return item ? "Click an item, then its place:" : "Click on the place:";
  }

  /**
   * Handles a click on the floor at `point`, m, and on `item` or null. Returns whether the tool belongs to the
   * mission's faults.
   */
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
    const valueOf = (input) => (input.localName === "select" ? input.value : input.valueAsNumber);
    const values = Object.fromEntries([...fields].map(([key, { input }]) => [key, valueOf(input)]));
    this.#orders.arm(ownFault(spec, values, point));
  }
}

/** Creates the field of an argument: `{element, input}`. An argument with names has a list of them. */
function field({ key, label: words, unit, about, from, to, is_whole, default: value, names }) {
  const input = names
    ? el("select", { "data-field": key }, ...names.map((name) => el("option", { value: name }, name)))
    : el("input", {
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

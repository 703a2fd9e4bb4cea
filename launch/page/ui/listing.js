// Long lists: a search by name, an order with trouble first, and a maximum number of rows.

import { byId, el, text } from "./dom.js";
import { count } from "./words.js";

export class Listing {
  #id;
  #noun;
  #few;
  #most;
  #query = "";
  #troubleFirst = true;
  // Names of the rows shown last.
  #shown = null;

  /**
   * Fills the element `id` with the search tools if there are more than `few` items. `noun` is their singular name. At
   * most `most` are shown. Calls `changed` after a change of the search.
   */
  constructor(id, noun, { all, few, most }, changed) {
    this.#id = id;
    this.#noun = noun;
    this.#few = few;
    this.#most = most;
    if (all <= few) return;
    const search = el("input", { type: "search", class: "small", placeholder: `find ${noun}s`, "aria-label": `Find ${noun}s by name`, "data-search": `${noun}s` });
    search.addEventListener("input", () => {
      this.#query = search.value.trim().toLowerCase();
      this.#shown = null;
      changed();
    });
    const order = el("input", { type: "checkbox", "data-trouble-first": `${noun}s` });
    order.checked = true;
    order.addEventListener("change", () => {
      this.#troubleFirst = order.checked;
      this.#shown = null;
      changed();
    });
    byId(id).replaceChildren(search, el("label", { class: "check" }, order, "trouble first"), el("span", { class: "dim push" }));
  }

  /**
   * Returns the items to show, of `{name, trouble}` with trouble 0 as the worst. `always` is shown in any case, if it
   * is one of them. Under the pointer the rows stay in place, so that a click hits the intended row.
   */
  choose(items, always = null) {
    if (items.length <= this.#few) return items;
    const found = items.filter((item) => item === always || item.name.toLowerCase().includes(this.#query));
    found.sort((a, b) => (b === always) - (a === always) || (this.#troubleFirst ? a.trouble - b.trouble : 0));
    const best = found.slice(0, this.#most);
    const prefix = best.length < found.length ? `${best.length} of ` : "";
    text(byId(this.#id).lastElementChild, prefix + count(found.length, this.#noun));
    const isHeld = this.#shown !== null && byId(this.#id).parentElement.matches(":hover") && (!always || this.#shown.has(always.name));
    const byName = isHeld ? new Map(items.map((item) => [item.name, item])) : null;
    const shown = isHeld ? [...this.#shown].map((name) => byName.get(name)) : best;
    this.#shown = new Set(shown.map(({ name }) => name));
    return shown;
  }
}

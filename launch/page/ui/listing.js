// Long lists: a field to search them by name, an order in which trouble comes first, and no more rows than anybody reads.

import { byId, el, text } from "./dom.js";

export class Listing {
  #id;
  #what;
  #few;
  #most;
  #query = "";
  #troubleFirst = true;
  // Names of those shown last.
  #shown = null;

  /**
   * Fills the element `id` with the tools, which are there only for more than `few` of `what`; `most` are shown at a time. `changed` is
   * called when the person has asked for others.
   */
  constructor(id, what, { all, few, most }, changed) {
    this.#id = id;
    this.#what = what;
    this.#few = few;
    this.#most = most;
    if (all <= few) return;
    const search = el("input", { type: "search", class: "small", placeholder: `find ${what}`, "aria-label": `Find ${what} by name`, "data-search": what });
    search.addEventListener("input", () => {
      this.#query = search.value.trim().toLowerCase();
      this.#shown = null;
      changed();
    });
    const order = el("input", { type: "checkbox", "data-trouble-first": what });
    order.checked = true;
    order.addEventListener("change", () => {
      this.#troubleFirst = order.checked;
      this.#shown = null;
      changed();
    });
    byId(id).replaceChildren(search, el("label", { class: "check" }, order, "trouble first"), el("span", { class: "dim push" }));
  }

  /**
   * Of `items` those to show: `{name, trouble}`, trouble 0 being the worst. `always` is shown whatever is asked for, if it is one of
   * them. Under the pointer nothing changes its place: a click must not hit another one.
   */
  choose(items, always = null) {
    if (items.length <= this.#few) return items;
    const found = items.filter((item) => item === always || item.name.toLowerCase().includes(this.#query));
    found.sort((a, b) => (b === always) - (a === always) || (this.#troubleFirst ? a.trouble - b.trouble : 0));
    const best = found.slice(0, this.#most);
    const count = best.length < found.length ? `${best.length} of ${found.length}` : `${found.length}`;
    text(byId(this.#id).lastElementChild, `${count} ${this.#what}`);
    const isHeld = this.#shown !== null && byId(this.#id).parentElement.matches(":hover") && (!always || this.#shown.has(always.name));
    const byName = isHeld ? new Map(items.map((item) => [item.name, item])) : null;
    const shown = isHeld ? [...this.#shown].map((name) => byName.get(name)) : best;
    this.#shown = new Set(shown.map(({ name }) => name));
    return shown;
  }
}

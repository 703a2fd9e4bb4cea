// The list of events, newest first, filtered by group. In a log a click on an event seeks its time.

import { GROUPS } from "../model/events.js";
import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { count, eventInWords, seconds } from "../ui/words.js";

const MAX_ROWS = 250;
const KEY = "alliance-events";

export class Events {
  #model;
  #seek;
  #changed;
  #groups;

  /** `seek(ms)` is called on a click on an event; null in a live run. `changed` is called on a new filter. */
  constructor(model, seek, changed) {
    this.#model = model;
    this.#seek = seek;
    this.#changed = changed;
    const stored = sessionStorage.getItem(KEY);
    this.#groups = new Set(stored === null ? Object.keys(GROUPS).filter((group) => group !== "details") : stored.split(" "));
    const chips = Object.entries(GROUPS).map(([group, { label, sign }]) =>
      el(
        "button",
        {
          type: "button",
          class: "chip",
          "data-group": group,
          "aria-pressed": String(this.#groups.has(group)),
          onclick: ({ currentTarget }) => this.#toggle(group, currentTarget),
        },
        `${sign} ${label}`,
      ),
    );
    byId("event-groups").replaceChildren(...chips);
  }

  #toggle(group, button) {
    if (!this.#groups.delete(group)) this.#groups.add(group);
    sessionStorage.setItem(KEY, [...this.#groups].join(" "));
    button.setAttribute("aria-pressed", String(this.#groups.has(group)));
    this.#changed();
  }

  /** Returns a key that differs for each filter. */
  get filter() {
    return [...this.#groups].join();
  }

  /** Tests whether the filter includes an event. */
  isWanted(event) {
    return this.#groups.has(event.group);
  }

  draw() {
    if (!isShown("events")) return;
    const all = this.#model.eventsSoFar();
    const rows = [];
    for (let index = all.length - 1; index >= 0 && rows.length < MAX_ROWS; index -= 1) {
      if (this.isWanted(all[index])) rows.push(all[index]);
    }
    keyed(
      byId("event-list"),
      rows,
      (event) => event.index,
      (event) => this.#row(event),
    );
    const missed = this.#model.missed ? `; ${this.#model.missed} did not reach this page` : "";
    text(byId("event-count"), `${count(all.length, "event")}${missed}`);
  }

  #row(event) {
    const { names, colors } = this.#model;
    const rank = names.indexOf(event.robot);
    const { what, why } = eventInWords(event, names);
    const time = seconds(event.t_ms, 2);
    return el(
      "li",
      { "data-event": event.kind, "data-group": event.group, "data-robot": event.robot || null, "data-t": event.t_ms },
      this.#seek
        ? el("button", { type: "button", class: "time link", onclick: () => this.#seek(event.t_ms) }, time)
        : el("span", { class: "time" }, time),
      el("span", { class: "sign", "aria-hidden": "true" }, GROUPS[event.group].sign),
      el(
        "span",
        {},
        rank >= 0 ? dot(colors[rank]) : null,
        event.robot ? el("strong", {}, `${event.robot} `) : null,
        what,
        why ? el("span", { class: "dim" }, ` – ${why}`) : null,
      ),
    );
  }
}

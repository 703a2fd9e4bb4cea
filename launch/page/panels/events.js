// The list of events, newest first, filtered by group, robot and text. A fault is one event with all its phases. In a large
// team, routine events share rows. In a log a click on an event seeks its time.

import { GROUPS, eventRows } from "../model/events.js";
import { foldFaults } from "../model/faults.js";
import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { count, countsInWords, eventInWords, phasesInWords, seconds } from "../ui/words.js";

const MAX_ROWS = 250;
/** Routine events of teams with more robots share rows, unless one robot or a text is chosen. */
const FEW = 12;
const KEY = "alliance-events";

export class Events {
  #model;
  #seek;
  #changed;
  #groups;
  #robot = "";
  #query = "";

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
    const robot = byId("event-robot");
    robot.append(...model.names.map((name) => el("option", { value: name }, name)));
    robot.addEventListener("change", () => {
      this.#robot = robot.value;
      changed();
    });
    const search = byId("event-search");
    search.addEventListener("input", () => {
      this.#query = search.value.trim().toLowerCase();
      changed();
    });
  }

  #toggle(group, button) {
    if (!this.#groups.delete(group)) this.#groups.add(group);
    sessionStorage.setItem(KEY, [...this.#groups].join(" "));
    button.setAttribute("aria-pressed", String(this.#groups.has(group)));
    this.#changed();
  }

  /** Returns a key that differs for each filter. */
  get filter() {
    return [...this.#groups, this.#robot, this.#query].join();
  }

  /** Tests whether the filter includes an event. */
  isWanted(event) {
    if (!this.#groups.has(event.group) || (this.#robot && event.robot !== this.#robot)) return false;
    return !this.#query || this.#words(event).toLowerCase().includes(this.#query);
  }

  #words(event) {
    const { what, why } = eventInWords(event, this.#model.names);
    return `${event.robot} ${what} ${why}`;
  }

  draw() {
    if (!isShown("events")) return;
    const all = this.#model.eventsSoFar();
    const faults = foldFaults(all);
    const folds = this.#model.names.length > FEW && !this.#robot && !this.#query;
    const isListed = (event) => (event.group !== "faults" || faults.has(event)) && this.isWanted(event);
    keyed(
      byId("event-list"),
      eventRows(all, isListed, MAX_ROWS, folds),
      (events) => `${events.at(-1).index} ${events.length} ${faults.get(events[0])?.length ?? 0}`,
      (events) => (events.length > 1 ? this.#folded(events) : this.#row(events[0], faults.get(events[0]))),
    );
    const missed = this.#model.missed ? `; ${this.#model.missed} did not reach this page` : "";
    text(byId("event-count"), `${count(all.length, "event")}${missed}`);
  }

  /** Creates the row of several routine events. */
  #folded(events) {
    const first = events.at(-1);
    return el(
      "li",
      { "data-event": "routine", "data-t": first.t_ms, title: "Choose a robot, or search, to list these events" },
      this.#time(first),
      el("span", { class: "sign", "aria-hidden": "true" }, "⋯"),
      el("span", { class: "dim" }, countsInWords(events)),
    );
  }

  #time({ t_ms }) {
    const time = seconds(t_ms, 2);
    if (!this.#seek) return el("span", { class: "time" }, time);
    return el("button", { type: "button", class: "time link", onclick: () => this.#seek(t_ms) }, time);
  }

  /** Creates the row of an event. `phases` are those of a fault. */
  #row(event, phases) {
    const { names, colors } = this.#model;
    const rank = names.indexOf(event.robot);
    const { what, why } = phases ? phasesInWords(phases) : eventInWords(event, names);
    return el(
      "li",
      { "data-event": event.kind, "data-group": event.group, "data-robot": event.robot || null, "data-t": event.t_ms },
      this.#time(event),
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

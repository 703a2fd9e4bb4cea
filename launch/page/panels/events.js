// The list of events, newest first, filtered by group, robot and text. A fault is one event with all its phases. In a log
// a click on an event seeks its time.

import { GROUPS } from "../model/events.js";
import { foldFaults } from "../model/faults.js";
import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { count, eventInWords, phasesInWords, seconds } from "../ui/words.js";

const MAX_ROWS = 250;
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
    const rows = [];
    for (let index = all.length - 1; index >= 0 && rows.length < MAX_ROWS; index -= 1) {
      const event = all[index];
      const isFolded = event.group === "faults" && !faults.has(event);
      if (!isFolded && this.isWanted(event)) rows.push(event);
    }
    keyed(
      byId("event-list"),
      rows,
      (event) => `${event.index} ${faults.get(event)?.length ?? 0}`,
      (event) => this.#row(event, faults.get(event)),
    );
    const missed = this.#model.missed ? `; ${this.#model.missed} did not reach this page` : "";
    text(byId("event-count"), `${count(all.length, "event")}${missed}`);
  }

  /** Creates the row of an event. `phases` are those of a fault. */
  #row(event, phases) {
    const { names, colors } = this.#model;
    const rank = names.indexOf(event.robot);
    const { what, why } = phases ? phasesInWords(phases) : eventInWords(event, names);
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

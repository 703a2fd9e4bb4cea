// The robots as cards: state, process, activity, faults, and the actions of the operator.

import { affectsRobot } from "../model/faults.js";
import { skillsOf } from "../model/skills.js";
import { chosenDuration } from "../room/tools.js";
import { attribute, byId, dot, el, keyed, text } from "../ui/dom.js";
import { Listing } from "../ui/listing.js";
import { isShown } from "../ui/tabs.js";
import { faultInWords, seconds } from "../ui/words.js";
import { openActuators, openMore, openSensors, openSkills } from "./devices.js";

/** Teams with more than FEW robots have a search; at most MOST cards are shown. */
const FEW = 12;
const MOST = 40;

export class Robots {
  #model;
  #choices;
  #orders;
  #listing;

  constructor(model, choices, orders, changed) {
    this.#model = model;
    this.#choices = choices;
    this.#orders = orders;
    this.#listing = new Listing("robot-search", "robot", { all: model.names.length, few: FEW, most: MOST }, changed);
  }

  draw() {
    const { view, names } = this.#model;
    if (!isShown("robots") || !view) return;
    const robots = names.map((name, rank) => ({ name, rank, trouble: this.#trouble(rank) }));
    keyed(
      byId("robot-cards"),
      this.#listing.choose(robots, robots[this.#choices.selected]),
      ({ rank }) => rank,
      ({ rank }) => this.#card(rank),
      (card, { rank }) => this.#update(card, rank),
    );
  }

  /** Returns the rank of a robot's trouble, 0 the worst: dead, silent, faulty, joining, waiting, idle, active, absent. */
  #trouble(rank) {
    const { view, names } = this.#model;
    const robot = view.robots[rank];
    const ofState = { dead: 0, silent: 1, coming: 3, absent: 7 }[robot.state];
    if (ofState !== undefined) return ofState;
    const isBroken = view.faults.some(({ phase, order }) => phase === "in-force" && affectsRobot(order.fault, names[rank]));
    if (isBroken) return 2;
    if (robot.active !== null) return 6;
    return this.#model.waitingFor(robot) ? 4 : 5;
  }

  /** Scrolls a robot's card into view. */
  reveal(rank) {
    const name = CSS.escape(this.#model.names[rank]);
    byId("robot-cards").querySelector(`[data-robot="${name}"]`)?.scrollIntoView({ block: "nearest" });
  }

  #card(rank) {
    const { names, colors } = this.#model;
    const name = names[rank];
    const fact = (field) => el("dd", { "data-field": field });
    const select = () => this.#choices.set({ selected: this.#choices.selected === rank ? null : rank });
    return el(
      "article",
      { class: "card", "data-robot": name },
      el(
        "header",
        {},
        el(
          "button",
          { type: "button", class: "name", "data-action": "select", title: "Select: shows its rays and radio links", onclick: select },
          dot(colors[rank]),
          name,
        ),
        el("span", { class: "state", "data-field": "state" }),
      ),
      el("p", { class: "doing", "data-field": "doing" }),
      el(
        "dl",
        {},
        ...[
          ["carries", "carries"],
          ["speed", "speed"],
          ["process", "pid"],
          ["incarnation", "incarnation"],
          ["energy", "energy"],
        ].map(([label, field]) => el("div", {}, el("dt", {}, label), fact(field))),
      ),
      el("ul", { class: "plain faults", "data-field": "faults" }),
      this.#model.isLive ? this.#buttons(rank) : null,
    );
  }

  #buttons(rank) {
    const name = this.#model.names[rank];
    const act = (action, label, run, title = null) =>
      el(
        "button",
        { type: "button", "data-action": action, "data-interfere": "", title, "aria-label": title ?? `${label} ${name}`, onclick: run },
        label,
      );
    return el(
      "div",
      { class: "buttons" },
      act("kill", "Kill", () => this.kill(rank)),
      act("pause", "Pause", () => this.pause(rank)),
      act("continue", "Continue", () => this.pause(rank)),
      act("restart", "Restart", () => this.restart(rank)),
      act("add", "Add", () => this.#orders.arm({ add: name }, chosenDuration())),
      act("sensors", "Sensor…", ({ currentTarget }) => openSensors(this.#model, this.#orders, rank, currentTarget)),
      act("actuators", "Actuator…", ({ currentTarget }) => openActuators(this.#model, this.#orders, rank, currentTarget)),
      skillsOf(this.#model.run, rank).length > 0
        ? act("skills", "Skill…", ({ currentTarget }) => openSkills(this.#model, this.#orders, rank, currentTarget))
        : null,
      act(
        "more",
        "⋯",
        ({ currentTarget }) => openMore(this.#model, this.#choices, this.#orders, rank, currentTarget),
        `More for ${name}: radio, behavior, power, place`,
      ),
    );
  }

  kill(rank) {
    return this.#orders.arm({ kill: this.#model.names[rank] }, chosenDuration());
  }

  /** Pauses the robot's process, or continues it if it is paused. */
  pause(rank) {
    const name = this.#model.names[rank];
    const isStopped = this.#model.view.robots[rank].state === "silent";
    return isStopped ? this.#orders.arm({ continue: name }) : this.#orders.arm({ pause: name }, chosenDuration());
  }

  restart(rank) {
    return this.#orders.arm({ restart: this.#model.names[rank] });
  }

  #update(card, rank) {
    const { view, names, now } = this.#model;
    const robot = view.robots[rank];
    const setField = (field, value) => text(card.querySelector(`[data-field=${field}]`), value);
    attribute(card, "data-state", robot.state);
    attribute(card, "data-selected", this.#choices.selected === rank ? "yes" : null);
    attribute(card.querySelector("[data-action=select]"), "aria-pressed", String(this.#choices.selected === rank));
    setField("state", robot.state);
    const doing = this.#model.doing(robot);
    const since = doing && doing.since !== null ? ` for ${seconds(Math.max(0, now - doing.since))}` : "";
    const activity = this.#model.doingInWords(robot) + since || "–";
    setField("doing", activity);
    attribute(card.querySelector("[data-field=doing]"), "title", activity);
    setField("carries", robot.carrying === null ? "nothing" : `item-${robot.carrying}`);
    setField("speed", `${robot.speed_m_s.toFixed(2)} m/s`);
    const hasItems = view.items.length > 0;
    card.querySelector("[data-field=carries]").parentElement.hidden = !hasItems;
    setField("pid", robot.pid ?? "–");
    setField("incarnation", robot.incarnation ?? "–");
    // Robots that never restarted have the first one, and dead ones have none.
    card.querySelector("[data-field=incarnation]").parentElement.hidden = !this.#model.isLive && (robot.incarnation ?? 1) === 1;
    const hasEnergy = robot.energy_j !== null;
    card.querySelector("[data-field=energy]").parentElement.hidden = !hasEnergy;
    if (hasEnergy) setField("energy", `${(robot.energy_j / 1000).toFixed(1)} kJ`);
    this.#updateFaults(card.querySelector("[data-field=faults]"), names[rank]);
    for (const button of card.querySelectorAll("[data-interfere]")) {
      button.hidden = !this.#isOffered(button.dataset.action, robot.state);
      button.disabled = !this.#model.isOpen;
    }
  }

  #isOffered(action, state) {
    if (state === "absent" || action === "add") return action === "add" && state === "absent";
    if (action === "continue") return state === "silent";
    if (action === "pause") return state === "present" || state === "coming";
    return action !== "kill" || state !== "dead";
  }

  #updateFaults(list, name) {
    const found = this.#model.view.faults.filter(({ order }) => affectsRobot(order.fault, name));
    keyed(
      list,
      found,
      ({ id }) => id,
      ({ id, order }) =>
        el(
          "li",
          { "data-fault": id },
          el("span", {}),
          this.#model.isLive
            ? el(
                "button",
                {
                  type: "button",
                  "data-undo": id,
                  title: `Undo ${faultInWords(order.fault, this.#model.run.faults)}`,
                  onclick: () => this.#orders.clear(id),
                },
                "Undo",
              )
            : null,
        ),
      (row, { id, order, phase, applied_ms }) => {
        // A new order takes effect in the next step.
        const isNext = phase === "in-force" && applied_ms >= this.#model.now;
        const when = phase === "armed" ? " (armed)" : isNext ? " (from the next tick)" : "";
        text(row.firstChild, `${id}: ${faultInWords(order.fault, this.#model.run.faults)}${when} `);
      },
    );
  }
}

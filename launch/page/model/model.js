// The run as this page knows it, whether it is live or a log: what it is made of, the newest view, and what was before.

import { robotColors, setStyles } from "../ui/colors.js";
import { Curves } from "./curves.js";
import { groupOf } from "./events.js";
import { History } from "./history.js";
import { Traffic } from "./traffic.js";

/** A live world is heard of ten times a second; after so long without a word it stands still, ms of wall-clock. */
const SILENCE_MS = 5000;

/** Events that are remembered of a live run. */
const EVENTS = 20_000;

export class Model {
  /** Answer of /api/run. */
  run;
  /** Names and colors of the robots, by rank. */
  names;
  colors;
  /** Behavior sets by id: `{name, task, color, dash}`; color null is the page's ink. */
  sets;
  /** Tasks by id: `{name, max_robots, priority}`. */
  tasks;
  /**
   * The newest view, or null.
   * @type {import("../../page-tests/types.js").View | null}
   */
  view = null;
  /** Events by time, each with its group and a running number `index`. */
  events = [];
  /** Events that did not reach this page, and those forgotten. */
  missed = 0;
  /** How a live run ended: `{outcome, folder}`. */
  ended = null;

  #changed;
  #nextEvent = 0;
  // When the newest view came, ms of wall-clock.
  #heardAt = 0;

  /** `changed` is called after every change. */
  constructor(run, changed) {
    const { scenario, catalog } = run;
    this.run = run;
    this.names = scenario.robots.map((robot) => robot.name);
    this.colors = robotColors(this.names);
    const styles = setStyles(catalog);
    this.sets = catalog.sets.map((set, id) => ({ ...set, ...styles[id] }));
    this.tasks = catalog.tasks;
    this.history = new History(this.names.length);
    this.curves = new Curves(this.sets.length);
    this.traffic = new Traffic(this.names.length, run.log !== null);
    this.#changed = changed;
  }

  get isLive() {
    return this.run.mode === "live";
  }

  /** Whether orders can still be given. */
  get isOpen() {
    return this.isLive && this.ended === null;
  }

  /** Simulated time that is shown, ms. */
  get now() {
    return this.view?.now ?? 0;
  }

  /** Whether a fault happens in a moment, so that it can neither last nor be undone. */
  isMomentary(fault) {
    return this.run.momentary.includes(Object.keys(fault)[0]);
  }

  /**
   * Takes in the next view, or one of the same tick whose clock or faults are others.
   * @param {import("../../page-tests/types.js").View} view
   */
  absorb(view) {
    this.history.add(view, view.now);
    if (view.tick !== this.view?.tick) this.traffic.absorb(view);
    this.view = view;
    this.#heardAt = performance.now();
    this.#changed();
  }

  /** Whether a live world says nothing any more, though its run is not over. */
  get isFrozen() {
    return this.isOpen && this.view !== null && performance.now() - this.#heardAt > SILENCE_MS;
  }

  /**
   * Goes to another place in the log: `view`, with the views right before it.
   * @param {import("../../page-tests/types.js").View} view
   * @param {import("../../page-tests/types.js").View[]} before
   */
  jump(view, before) {
    this.traffic.clear();
    this.view = null;
    for (const each of before) {
      this.history.add(each, view.now);
      this.traffic.absorb(each);
    }
    this.absorb(view);
  }

  /** Takes in views of which only where the robots were counts: samples of a whole log. */
  remember(views) {
    for (const view of views) this.history.add(view, this.now);
    this.#changed();
  }

  /** Takes in what has become of messages of a live run. */
  hear(messages) {
    this.traffic.hear(messages);
    this.#changed();
  }

  /** Takes in corners of curves. */
  bend(bends) {
    this.curves.add(bends);
    this.#changed();
  }

  /** The corners of that set of a robot; in a live run up to now. */
  corners(rank, set) {
    const corners = this.curves.of(rank, set);
    const robot = this.isLive ? this.view.robots[rank] : null;
    const motivation = robot?.state === "present" && robot.sets.find((each) => each.motivation.set === set)?.motivation;
    // A view stands between two steps.
    const at = this.now - this.run.scenario.step_ms;
    if (!motivation || !(corners.at(-1)?.at < at)) return corners;
    return [...corners, { at, level: motivation.motivation, state: motivation.state, last: true }];
  }

  addEvents(events) {
    for (const event of events) {
      const group = groupOf(event.kind, this.run.mission.events);
      this.events.push({ ...event, group, index: this.#nextEvent++ });
    }
    const surplus = this.events.length - EVENTS;
    if (this.isLive && surplus > 0) {
      this.events.splice(0, surplus);
      this.missed += surplus;
    }
    this.#changed();
  }

  miss(count) {
    this.missed += count;
    this.#changed();
  }

  end(how) {
    this.ended ??= how;
    this.#changed();
  }

  /** The events up to the time that is shown. A live page may hear of an event just before it gets the view. */
  eventsSoFar() {
    if (this.isLive) return this.events;
    let low = 0;
    let high = this.events.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.events[middle].t_ms <= this.now) low = middle + 1;
      else high = middle;
    }
    return this.events.slice(0, low);
  }

  /**
   * The behavior set that a robot waits to activate, or null.
   * @param {import("../../page-tests/types.js").RobotView} robot
   */
  waitingFor(robot) {
    const entry = robot.sets.find(({ motivation }) => motivation.state === "Waiting");
    return entry ? this.sets[entry.motivation.set] : null;
  }

  /**
   * What a robot does: a behavior set, or that it waits for one, or idle; empty if it takes no part.
   * @param {import("../../page-tests/types.js").RobotView} robot
   */
  doingInWords(robot) {
    const doing = this.doing(robot);
    if (doing) return doing.set.name;
    if (robot.state !== "present" && robot.state !== "silent") return "";
    const wanted = this.waitingFor(robot);
    return wanted ? `waits for ${wanted.name}` : "idle";
  }

  /**
   * The behavior set that a robot executes, with since when: `{set, since}`, or null. Dead robots execute nothing.
   * @param {import("../../page-tests/types.js").RobotView} robot
   */
  doing(robot) {
    if (robot.active === null || robot.state === "dead" || robot.state === "absent") return null;
    const entry = robot.sets.find(({ motivation }) => motivation.set === robot.active);
    return { set: this.sets[robot.active], since: entry?.since ?? null };
  }
}

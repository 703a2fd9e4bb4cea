// State of the run on this page, live or from a log: its setup, the newest view and the past.

import { setStyles } from "../ui/colors.js";
import { Curves } from "./curves.js";
import { between } from "./between.js";
import { DETECTED, TOOK_OVER, groupOf } from "./events.js";
import { History } from "./history.js";
import { Traffic } from "./traffic.js";

/**
 * The time without a view after which a live world counts as frozen, in ms of wall-clock time. A live world sends ten
 * views per second.
 */
const SILENCE_MS = 5000;

/** The maximum number of events of a live run. */
const MAX_EVENTS = 20_000;

export class Model {
  /** The answer of `/api/run`. */
  run;
  /** Names and colors of the robots, by rank. */
  names;
  colors;
  /** Behavior sets by id: `{name, task, color, dash}`. A null color is the text color of the page. */
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
  /** The number of events that did not reach this page or were dropped. */
  missed = 0;
  /**
   * The end of a live run: `{outcome, folder}`, `{isDisconnected}` if only the page's server ended, or `{stopped}` with
   * the reason if the simulator of this page failed.
   */
  ended = null;
  /** The hash of a run in this page so far, or null. */
  hash = null;
  /** The number of messages sent so far, counted only for a run with a second one beside it. */
  broadcasts = 0;

  #changed;
  #nextEvent = 0;
  // The view between this one and the next one, or null.
  #picture = null;
  // The time of the newest view, in ms of wall-clock time.
  #lastViewAt = 0;

  /** Calls `changed` after every change. */
  constructor(run, changed) {
    const { scenario, catalog } = run;
    this.run = run;
    this.names = scenario.robots.map((robot) => robot.name);
    this.colors = run.colors.robots;
    const styles = setStyles(catalog, run.colors.tasks);
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

  /** Tests whether the run still accepts orders. */
  get isOpen() {
    return this.isLive && this.ended === null;
  }

  /** The displayed simulated time, ms. */
  get now() {
    return this.view?.now ?? 0;
  }

  /** Tests whether a fault is instantaneous. Such a fault has no duration and cannot be undone. */
  isInstantaneous(fault) {
    return this.run.momentary.includes(Object.keys(fault)[0]);
  }

  /**
   * Adds the next view, or one of the same tick with another clock or other faults.
   * @param {import("../../page-tests/types.js").View} view
   */
  addView(view) {
    this.history.add(view, view.now);
    if (view.tick !== this.view?.tick) this.traffic.addView(view);
    this.view = view;
    this.#picture = null;
    this.#lastViewAt = performance.now();
    this.#changed();
  }

  /** The view to draw: during the playback of a log, with poses on the way to the next view. */
  get picture() {
    return this.#picture ?? this.view;
  }

  /** Moves the poses of the picture toward the next view of a log, by a share from 0 to 1. */
  approach(next, share) {
    this.#picture = between(this.view, next, share);
  }

  /** Draws the view itself again. */
  settle() {
    this.#picture = null;
  }

  /** Tests whether the picture lies between two views. */
  get isBetween() {
    return this.#picture !== null;
  }

  /** Tests whether a live world has stopped sending views before the end of its run. */
  get isFrozen() {
    return this.isOpen && this.view !== null && performance.now() - this.#lastViewAt > SILENCE_MS;
  }

  /**
   * Moves to another time of the log: `view`, with the views right before it.
   * @param {import("../../page-tests/types.js").View} view
   * @param {import("../../page-tests/types.js").View[]} before
   */
  jump(view, before) {
    this.traffic.clear();
    this.view = null;
    for (const each of before) {
      this.history.add(each, view.now);
      this.traffic.addView(each);
    }
    this.addView(view);
  }

  /** Adds samples of a whole log to the history. */
  addSamples(views) {
    for (const view of views) this.history.add(view, this.now);
    this.#changed();
  }

  /** Adds receptions of a live run. */
  addMessages(messages) {
    this.traffic.add(messages);
    this.#changed();
  }

  addCorners(corners) {
    this.curves.add(corners);
    this.#changed();
  }

  /** Returns the corners of a set of a robot, in a live run up to now. */
  corners(rank, set) {
    const corners = this.curves.of(rank, set);
    const robot = this.isLive ? this.view.robots[rank] : null;
    const motivation = robot?.state === "present" && robot.sets.find((each) => each.motivation.set === set)?.motivation;
    // A view lies between two steps.
    const at = this.now - this.run.scenario.step_ms;
    if (!motivation || !(corners.at(-1)?.at < at)) return corners;
    return [...corners, { at, level: motivation.motivation, state: motivation.state, last: true }];
  }

  /** Adds events. A takeover of a live run arrives when its robot has worked, after other events. */
  addEvents(events) {
    const isLate = events.some(({ t_ms }) => t_ms < this.events.at(-1)?.t_ms);
    const isNew = this.isLive && this.#nextEvent > 0;
    for (const event of events) {
      const group = groupOf(event.kind, this.run.mission.events);
      const known_ms = isNew ? Math.max(event.t_ms, this.now) : event.t_ms;
      this.events.push({ ...event, known_ms, group, index: this.#nextEvent++ });
    }
    if (isLate) this.events.sort((a, b) => a.t_ms - b.t_ms || a.index - b.index);
    const surplus = this.events.length - MAX_EVENTS;
    if (this.isLive && surplus > 0) {
      this.events.splice(0, surplus);
      this.missed += surplus;
    }
    this.#changed();
  }

  /** Returns the latest takeover of each robot known for less than `age_ms`, or else its latest detection, by rank. */
  recentTakeovers(age_ms) {
    const found = new Map();
    for (const event of this.events) {
      if (event.t_ms > this.now) break;
      if (event.known_ms <= this.now - age_ms || (event.kind !== TOOK_OVER && event.kind !== DETECTED)) continue;
      const rank = this.names.indexOf(event.robot);
      if (event.kind === TOOK_OVER || found.get(rank)?.kind !== TOOK_OVER) found.set(rank, event);
    }
    return found;
  }

  addMissed(count) {
    this.missed += count;
    this.#changed();
  }

  setHash(hash) {
    this.hash = hash;
    this.#changed();
  }

  setBroadcasts(count) {
    this.broadcasts = count;
    this.#changed();
  }

  setEnded(end) {
    this.ended ??= end;
    if (this.ended.outcome) this.addEnd(this.now, this.ended.outcome);
    this.#changed();
  }

  /** Adds the end of the run as an event, once. */
  addEnd(t_ms, outcome) {
    if (this.events.at(-1)?.kind === "ended") return;
    this.addEvents([{ t_ms, kind: "ended", robot: "", subject: outcome, reason: "", detail: "" }]);
  }

  /** Returns the events up to the displayed time. A live page may receive an event just before its view. */
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
   * Returns the behavior set that a robot waits to activate, or null.
   * @param {import("../../page-tests/types.js").RobotView} robot
   */
  waitingFor(robot) {
    const entry = robot.sets.find(({ motivation }) => motivation.state === "Waiting");
    return entry ? this.sets[entry.motivation.set] : null;
  }

  /**
   * Returns the activity of a robot: a behavior set, a set that it waits for, or idle. Empty if it does not take part.
   * @param {import("../../page-tests/types.js").RobotView} robot
   */
  doingInWords(robot) {
    const doing = this.doing(robot);
    if (doing) return doing.set.name;
    if (robot.state !== "present" && robot.state !== "silent") return "";
    const next = this.waitingFor(robot);
    return next ? `waits for ${next.name}` : "idle";
  }

  /**
   * Returns the active behavior set of a robot and its start as `{set, since}`, or null. A dead robot has none.
   * @param {import("../../page-tests/types.js").RobotView} robot
   */
  doing(robot) {
    if (robot.active === null || robot.state === "dead" || robot.state === "absent") return null;
    const entry = robot.sets.find(({ motivation }) => motivation.set === robot.active);
    return { set: this.sets[robot.active], since: entry?.since ?? null };
  }
}

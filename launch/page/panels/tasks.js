// The task table: the robots that execute each task, those that wait for it, and the start times.

import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { Listing } from "../ui/listing.js";
import { isShown } from "../ui/tabs.js";
import { seconds } from "../ui/words.js";

const ACTIVE_STATES = new Set(["present", "silent"]);

/** With more than FEW tasks there is a search; at most MOST are shown. */
const FEW = 20;
const MOST = 80;

/** The number of robots that are named for each task and state, and of idle ones. */
const MAX_NAMED = 20;

export class Tasks {
  #model;
  #listing;
  // By task: entries of robots that execute it, and of robots that wait for it.
  #executes = [];
  #waits = [];

  constructor(model, changed) {
    this.#model = model;
    this.#listing = new Listing("task-search", "task", { all: model.tasks.length, few: FEW, most: MOST }, changed);
  }

  draw() {
    const { view, tasks } = this.#model;
    if (!isShown("tasks") || !view) return;
    this.#sort();
    keyed(
      byId("task-rows"),
      this.#listing.choose(tasks.map(({ name }, task) => ({ name, task, trouble: this.#trouble(task) }))),
      ({ task }) => task,
      ({ task }) => this.#row(task),
      (row, { task }) => {
        this.#fill(row.children[1], this.#executes[task], "no robot");
        this.#fill(row.children[2], this.#waits[task], "–");
      },
    );
    const idle = view.robots
      .map((robot, rank) => ({ robot, rank }))
      .filter(({ robot }) => robot.state === "present" && this.#model.doingInWords(robot) === "idle");
    const named = idle.slice(0, MAX_NAMED).map(({ rank }) => this.#model.names[rank]);
    const others = idle.length > MAX_NAMED ? ` and ${idle.length - MAX_NAMED} more` : "";
    text(byId("idle"), idle.length ? `Idle: ${named.join(", ")}${others}` : "No robot is idle.");
  }

  /** Groups the robots by the tasks that they execute and wait for. */
  #sort() {
    const { view, sets, tasks } = this.#model;
    this.#executes = tasks.map(() => []);
    this.#waits = tasks.map(() => []);
    view.robots.forEach((robot, rank) => {
      if (!ACTIVE_STATES.has(robot.state)) return;
      for (const { motivation, since } of robot.sets) {
        const by = { Active: this.#executes, Waiting: this.#waits }[motivation.state];
        const set = sets[motivation.set];
        by?.[set.task].push({ rank, robot, set, since });
      }
    });
  }

  /** Returns the rank of a task's trouble: 0 with too many or silent robots, 1 with waiting ones, 2 if executed, 3 if not. */
  #trouble(task) {
    const executes = this.#executes[task];
    const isWrong = executes.length > this.#model.tasks[task].max_robots || executes.some(({ robot }) => robot.state === "silent");
    if (isWrong) return 0;
    if (this.#waits[task].length > 0) return 1;
    return executes.length === 0 ? 3 : 2;
  }

  #row(task) {
    const { name, max_robots } = this.#model.tasks[task];
    const allowed = max_robots > 1 ? el("span", { class: "dim" }, ` (up to ${max_robots})`) : null;
    return el(
      "tr",
      { "data-task": name },
      el("th", { scope: "row" }, name, allowed),
      el("td", { "data-field": "executes" }),
      el("td", { "data-field": "waits" }),
    );
  }

  #fill(cell, entries, placeholder) {
    const { names, colors, tasks, now } = this.#model;
    cell.dataset.robots = entries.map(({ rank }) => names[rank]).join(" ");
    const left = entries.length - MAX_NAMED;
    const more = entries.length === 0 ? placeholder : left > 0 ? `and ${left} more` : null;
    keyed(
      cell,
      [...entries.slice(0, MAX_NAMED), ...(more ? [null] : [])],
      (entry) => (entry ? `${entry.rank} ${entry.set.name}` : ""),
      (entry) => {
        if (!entry) return el("span", { class: "dim" });
        return el("div", { "data-robot": names[entry.rank] }, dot(colors[entry.rank]), el("span"), el("span", { class: "dim" }));
      },
      (element, entry) => {
        if (!entry) return text(element, more);
        // A set with the name of its task is not repeated.
        const set = entry.set.name === tasks[entry.set.task].name ? "" : ` with ${entry.set.name}`;
        const silent = entry.robot.state === "silent" ? " (silent)" : "";
        text(element.children[1], `${names[entry.rank]}${silent}${set}`);
        text(element.children[2], ` since ${seconds(entry.since)}, for ${seconds(Math.max(0, now - entry.since))}`);
      },
    );
  }
}

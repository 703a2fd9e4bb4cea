// The task table: who executes each task, who waits for it, since when.

import { byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { seconds } from "../ui/words.js";

const TAKES_PART = new Set(["present", "silent"]);

export class Tasks {
  #model;

  constructor(model) {
    this.#model = model;
  }

  draw() {
    const { view, tasks } = this.#model;
    if (!isShown("tasks") || !view) return;
    keyed(
      byId("task-rows"),
      tasks.map((_, task) => task),
      (task) => task,
      (task) => this.#row(task),
      (row, task) => {
        this.#fill(row.children[1], this.#entries(task, "Active"), "nobody");
        this.#fill(row.children[2], this.#entries(task, "Waiting"), "–");
      },
    );
    const idle = view.robots
      .map((robot, rank) => ({ robot, rank }))
      .filter(({ robot }) => robot.state === "present" && this.#model.doingInWords(robot) === "idle");
    text(byId("idle"), idle.length ? `Idle: ${idle.map(({ rank }) => this.#model.names[rank]).join(", ")}` : "Nobody is idle.");
  }

  #row(task) {
    const { name, words, max_robots } = this.#model.tasks[task];
    const allowed = max_robots > 1 ? el("span", { class: "dim" }, ` (up to ${max_robots})`) : null;
    return el(
      "tr",
      { "data-task": name },
      el("th", { scope: "row" }, words, allowed),
      el("td", { "data-field": "executes" }),
      el("td", { "data-field": "waits" }),
    );
  }

  /** Robots with a behavior set for the task in that state. */
  #entries(task, state) {
    const { view, sets } = this.#model;
    return view.robots.flatMap((robot, rank) => {
      if (!TAKES_PART.has(robot.state)) return [];
      const found = robot.sets.filter(({ motivation }) => motivation.state === state && sets[motivation.set].task === task);
      return found.map(({ motivation, since }) => ({ rank, robot, set: sets[motivation.set], since }));
    });
  }

  #fill(cell, entries, nobody) {
    const { names, colors, tasks, now } = this.#model;
    cell.dataset.robots = entries.map(({ rank }) => names[rank]).join(" ");
    keyed(
      cell,
      entries.length ? entries : [null],
      (entry) => (entry ? `${entry.rank} ${entry.set.name}` : ""),
      (entry) => {
        if (!entry) return el("span", { class: "dim" }, nobody);
        return el("div", { "data-robot": names[entry.rank] }, dot(colors[entry.rank]), el("span"), el("span", { class: "dim" }));
      },
      (element, entry) => {
        if (!entry) return;
        // The set is named only where it is not the task's own name.
        const set = entry.set.words === tasks[entry.set.task].words ? "" : ` with ${entry.set.words}`;
        const silent = entry.robot.state === "silent" ? " (silent)" : "";
        text(element.children[1], `${names[entry.rank]}${silent}${set}`);
        text(element.children[2], ` since ${seconds(entry.since)}, for ${seconds(Math.max(0, now - entry.since))}`);
      },
    );
  }
}

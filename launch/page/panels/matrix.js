// The matrix of robots by tasks for large teams: active, waiting, and the levels of the other sets.

import { themeColor } from "../ui/colors.js";
import { attribute, byId, text } from "../ui/dom.js";

/** Teams with more robots or tasks start with the matrix instead of curves. */
const MANY_ROBOTS = 12;
const MANY_TASKS = 24;

/** The minimum and maximum size of a cell, px. */
const CELL_PX = { width: [3, 30], height: [4, 16] };
/** Names are written in rows of at least this height. */
const LINE_PX = 9;
const NAMES_PX = 64;

export class Matrix {
  #model;
  #choices;
  #canvas = byId("matrix-canvas");
  #layout = null;

  constructor(model, choices, changed) {
    this.#model = model;
    this.#choices = choices;
    const kind = byId("chart-kind");
    if (model.names.length > MANY_ROBOTS || model.tasks.length > MANY_TASKS) kind.value = "matrix";
    kind.addEventListener("change", changed);
    this.#canvas.addEventListener("pointermove", (event) => this.#point(event));
    this.#canvas.addEventListener("pointerleave", () => text(byId("matrix-cell"), ""));
    this.#canvas.addEventListener("click", (event) => {
      const cell = this.#under(event);
      if (cell) choices.set({ selected: cell.rank });
    });
  }

  /** Tests whether the matrix is selected instead of curves. */
  static isChosen() {
    return byId("chart-kind").value === "matrix";
  }

  draw() {
    const { names, tasks, colors, sets, view } = this.#model;
    byId("matrix").hidden = !Matrix.isChosen();
    if (!Matrix.isChosen() || !view) return;
    const place = byId("matrix");
    const fit = (room, count, [least, most]) => Math.max(least, Math.min(most, room / count));
    const height = fit(place.clientHeight - 20, names.length, CELL_PX.height);
    const left = height >= LINE_PX ? NAMES_PX : 4;
    const width = fit(place.clientWidth - left - 14, tasks.length, CELL_PX.width);
    this.#layout = { left, width, height };
    const c = this.#size(left + width * tasks.length, height * names.length);
    c.font = "10px system-ui, sans-serif";
    c.textBaseline = "middle";
    const ink = themeColor("--ink");
    const line = themeColor("--line");
    const highest = this.#highest();
    view.robots.forEach((robot, rank) => {
      const top = rank * height;
      const isPresent = robot.state === "present";
      c.globalAlpha = 1;
      if (rank === this.#choices.selected) {
        c.globalAlpha = 0.25;
        c.fillStyle = themeColor("--select");
        c.fillRect(0, top, left + width * tasks.length, height);
        c.globalAlpha = 1;
      }
      c.fillStyle = ink;
      if (left === NAMES_PX) c.fillText(isPresent ? names[rank] : `${names[rank]} ✗`, 2, top + height / 2, NAMES_PX - 6);
      if (!isPresent) {
        c.fillStyle = line;
        c.fillRect(left, top, width * tasks.length, height);
      }
      for (const { motivation } of robot.sets) {
        const { task } = sets[motivation.set];
        const style = {
          Active: { color: colors[rank], alpha: 1, share: 1 },
          Waiting: { color: colors[rank], alpha: 0.9, share: 0.4 },
        }[motivation.state] ?? { color: ink, alpha: 0.45 * Math.min(1, motivation.motivation / highest), share: 1 };
        if (style.alpha < 0.02) continue;
        c.globalAlpha = style.alpha;
        c.fillStyle = style.color;
        c.fillRect(left + task * width, top + height * (1 - style.share), Math.max(1, width - (width > 5 ? 1 : 0)), height * style.share - (height > 5 ? 1 : 0));
      }
    });
    const busy = view.robots.filter(({ active }) => active !== null).length;
    attribute(this.#canvas, "aria-label", `${names.length} robots by ${tasks.length} tasks: ${busy} robots are at work`);
  }

  /** Returns the level that is drawn darkest: the threshold, or the highest utility. */
  #highest() {
    const { view, run } = this.#model;
    let highest = view.robots.some(({ measure }) => measure === "motivation") ? run.alliance.threshold : 0;
    for (const { measure, sets } of view.robots) {
      if (measure === "utility") for (const { motivation } of sets) highest = Math.max(highest, motivation.motivation);
    }
    return highest || 1;
  }

  #size(width, height) {
    const canvas = this.#canvas;
    const [wide, high] = [Math.round(width * devicePixelRatio), Math.round(height * devicePixelRatio)];
    if (canvas.width !== wide || canvas.height !== high) {
      Object.assign(canvas, { width: wide, height: high });
      Object.assign(canvas.style, { width: `${width}px`, height: `${height}px` });
    }
    const c = canvas.getContext("2d");
    c.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    c.globalAlpha = 1;
    c.clearRect(0, 0, width, height);
    return c;
  }

  /** Returns the robot and task under the pointer, or null. */
  #under({ offsetX, offsetY }) {
    if (!this.#layout) return null;
    const { left, width, height } = this.#layout;
    const [rank, task] = [Math.floor(offsetY / height), Math.floor((offsetX - left) / width)];
    return rank < this.#model.names.length && task < this.#model.tasks.length ? { rank, task: Math.max(0, task) } : null;
  }

  #point(event) {
    const cell = this.#under(event);
    if (!cell || !this.#model.view) return;
    const { names, tasks, sets, view } = this.#model;
    const found = view.robots[cell.rank].sets.filter(({ motivation }) => sets[motivation.set].task === cell.task);
    const states = found.map(({ motivation }) => `${motivation.state.toLowerCase()}, ${motivation.motivation.toFixed(1)}`);
    text(byId("matrix-cell"), `${names[cell.rank]} × ${tasks[cell.task].name}: ${states.join("; ") || "nothing"}`);
  }
}

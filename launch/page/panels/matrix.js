// The matrix of robots by tasks for large teams: active, waiting, and the levels of the other sets. Above some hundred
// robots a row stands for several of them, so that the whole team is in view.

import { ARROWS } from "../room/geometry.js";
import { themeColor } from "../ui/colors.js";
import { attribute, byId, text } from "../ui/dom.js";

/** Teams with more robots or tasks start with the matrix instead of curves. */
const MANY_ROBOTS = 12;
const MANY_TASKS = 24;

/** The minimum and maximum size of a cell, px. */
const CELL_PX = { width: [2, 30], height: [4, 16] };
/** The least distance of two names, px: of robots, and of tasks, which slope. */
const LINE_PX = 11;
const SLOPING_LINE_PX = 16;
/** The space for the names of robots and of tasks, px. */
const NAMES_PX = 64;
const HEAD_PX = 80;
/** The space below the last row, px, because a name is higher than a low row. */
const FOOT_PX = LINE_PX - CELL_PX.height[0];
/** Below this share of the highest level, a cell is empty. */
const LEAST_SHARE = 0.02;
/** The slope of the tasks' names. */
const SLOPE = -Math.PI / 3;

export class Matrix {
  #model;
  #choices;
  #canvas = byId("matrix-canvas");
  #layout = null;
  // The cell under the pointer or of the arrow keys, or null.
  #pointed = null;

  constructor(model, choices, changed) {
    this.#model = model;
    this.#choices = choices;
    const kind = byId("chart-kind");
    if (model.names.length > MANY_ROBOTS || model.tasks.length > MANY_TASKS) kind.value = "matrix";
    kind.addEventListener("change", changed);
    this.#canvas.addEventListener("pointermove", (event) => {
      this.#pointed = this.#under(event);
      changed();
    });
    for (const kind of ["pointerleave", "blur"]) {
      this.#canvas.addEventListener(kind, () => {
        this.#pointed = null;
        changed();
      });
    }
    this.#canvas.addEventListener("keydown", (event) => {
      const arrow = ARROWS[event.key];
      if (arrow) this.#move(arrow);
      else if (event.key === "Enter" && this.#pointed) choices.set({ selected: this.#pointed.rank });
      else return;
      event.preventDefault();
      event.stopPropagation();
      changed();
    });
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
    const { names, tasks, view } = this.#model;
    byId("matrix").hidden = byId("matrix-legend").hidden = !Matrix.isChosen();
    if (!Matrix.isChosen() || !view) return;
    const place = byId("matrix");
    const fit = (room, count, [least, most]) => Math.max(least, Math.min(most, room / count));
    const room = Math.max(CELL_PX.height[0], place.clientHeight - HEAD_PX - FOOT_PX);
    const robotsPerRow = Math.ceil((names.length * CELL_PX.height[0]) / room);
    const rows = Math.ceil(names.length / robotsPerRow);
    const height = fit(room, rows, CELL_PX.height);
    // The last name slopes beyond its column.
    const width = fit(place.clientWidth - NAMES_PX - HEAD_PX / 2, tasks.length, CELL_PX.width);
    this.#layout = { width, height, robotsPerRow };
    const c = this.#size(NAMES_PX + width * tasks.length + HEAD_PX / 2, HEAD_PX + height * rows + FOOT_PX);
    c.textBaseline = "middle";
    const ink = themeColor("--ink");
    this.#drawTaskNames(c, ink);
    const line = themeColor("--line");
    const styles = { Active: { color: themeColor("--accent"), share: 1 }, Waiting: { color: themeColor("--warn"), share: 0.5 } };
    const highest = this.#highest();
    const [gapX, gapY] = [width > 5 ? 1 : 0, height > 5 ? 1 : 0];
    for (let row = 0; row < rows; row += 1) {
      const robots = view.robots.slice(row * robotsPerRow, (row + 1) * robotsPerRow);
      const first = row * robotsPerRow;
      const top = HEAD_PX + row * height;
      const present = robots.filter(({ state }) => state === "present").length;
      c.globalAlpha = 1 - present / robots.length;
      c.fillStyle = line;
      c.fillRect(NAMES_PX, top, width * tasks.length, height - gapY);
      const { selected } = this.#choices;
      if (selected !== null && Math.floor(selected / robotsPerRow) === row) {
        c.globalAlpha = 0.25;
        c.fillStyle = themeColor("--select");
        c.fillRect(0, top, NAMES_PX + width * tasks.length, height);
      }
      c.globalAlpha = 1;
      c.fillStyle = ink;
      const isPointed = this.#pointed !== null && Math.floor(this.#pointed.rank / robotsPerRow) === row;
      const pointedAway = this.#pointed === null ? Infinity : Math.abs(Math.floor(this.#pointed.rank / robotsPerRow) - row) * height;
      if (isPointed || (row % Math.ceil(LINE_PX / height) === 0 && pointedAway >= LINE_PX)) {
        const last = names[Math.min(first + robotsPerRow, names.length) - 1];
        const name = isPointed ? names[this.#pointed.rank] : robotsPerRow > 1 ? `${names[first]} – ${last}` : names[first];
        c.font = font(isPointed);
        const mark = present === robots.length || robotsPerRow > 1 ? "" : " ✗";
        c.fillText(cut(c, name, NAMES_PX - 6 - c.measureText(mark).width) + mark, 2, top + Math.max(height, LINE_PX) / 2);
      }
      for (const [task, { state, level }] of this.#cells(robots)) {
        const style = styles[state] ?? { color: ink, share: 1 };
        const share = Math.min(1, level / highest);
        if (!styles[state] && share < LEAST_SHARE) continue;
        const alpha = styles[state] ? 1 : 0.12 + 0.38 * share;
        c.globalAlpha = alpha;
        c.fillStyle = style.color;
        c.fillRect(NAMES_PX + task * width, top + height * (1 - style.share), Math.max(1, width - gapX), height * style.share - gapY);
      }
    }
    c.globalAlpha = 1;
    this.#drawPointer(c);
    const busy = view.robots.filter(({ active }) => active !== null).length;
    attribute(this.#canvas, "aria-label", `${names.length} robots by ${tasks.length} tasks: ${busy} robots are at work`);
  }

  /** Writes the names of tasks, as many as have room, and the one under the pointer. */
  #drawTaskNames(c, ink) {
    const { tasks } = this.#model;
    const { width } = this.#layout;
    const every = Math.ceil(SLOPING_LINE_PX / width);
    const pointed = this.#pointed?.task ?? null;
    const isShown = (task) => task % every === 0 && (pointed === null || Math.abs(task - pointed) * width >= SLOPING_LINE_PX);
    c.fillStyle = ink;
    for (let task = 0; task < tasks.length; task += 1) {
      if (task !== pointed && !isShown(task)) continue;
      c.save();
      c.translate(NAMES_PX + (task + 0.5) * width, HEAD_PX - 4);
      c.rotate(SLOPE);
      c.font = font(task === pointed);
      c.fillText(cut(c, tasks[task].name, (HEAD_PX - 6) / Math.sin(-SLOPE)), 0, 0);
      c.restore();
    }
  }

  /** Frames the cell under the pointer, and states its content in words. */
  #drawPointer(c) {
    text(byId("matrix-cell"), this.#pointed ? this.#inWords(this.#pointed) : "");
    if (!this.#pointed) return;
    const { width, height, robotsPerRow } = this.#layout;
    const [x, y] = [NAMES_PX + this.#pointed.task * width, HEAD_PX + Math.floor(this.#pointed.rank / robotsPerRow) * height];
    c.strokeStyle = themeColor("--ink");
    c.lineWidth = 1;
    c.strokeRect(x - 1.5, y - 1.5, width + 2, height + 2);
  }

  /** Returns the state and the level of each task for a row of robots: the busiest state and the highest level of all. */
  #cells(robots) {
    const { sets } = this.#model;
    const rank = { Active: 2, Waiting: 1 };
    const cells = new Map();
    for (const { motivation } of robots.flatMap((robot) => robot.sets)) {
      const { task } = sets[motivation.set];
      const { state, motivation: level } = motivation;
      const cell = cells.get(task) ?? { state, level };
      const isBusier = (rank[state] ?? 0) > (rank[cell.state] ?? 0);
      cells.set(task, { state: isBusier ? state : cell.state, level: Math.max(cell.level, level) });
    }
    return cells;
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

  /** Moves the framed cell in a direction, first to that of the selected robot. */
  #move([right, up]) {
    const last = { rank: this.#model.names.length - 1, task: this.#model.tasks.length - 1 };
    const at = this.#pointed ?? { rank: this.#choices.selected ?? 0, task: 0 };
    const by = this.#pointed ? { rank: -up * (this.#layout?.robotsPerRow ?? 1), task: right } : { rank: 0, task: 0 };
    const moved = (key) => Math.max(0, Math.min(last[key], at[key] + by[key]));
    this.#pointed = { rank: moved("rank"), task: moved("task") };
  }

  /** Returns the robot and task under the pointer, or null. */
  #under({ offsetX, offsetY }) {
    if (!this.#layout) return null;
    const { width, height, robotsPerRow } = this.#layout;
    const row = Math.floor((offsetY - HEAD_PX) / height);
    const within = ((offsetY - HEAD_PX) / height - row) * robotsPerRow;
    const [rank, task] = [row * robotsPerRow + Math.floor(within), Math.floor((offsetX - NAMES_PX) / width)];
    return row >= 0 && rank < this.#model.names.length && task < this.#model.tasks.length ? { rank, task: Math.max(0, task) } : null;
  }

  #inWords({ rank, task }) {
    const { names, tasks, sets, view } = this.#model;
    const found = view.robots[rank].sets.filter(({ motivation }) => sets[motivation.set].task === task);
    const states = found.map(({ motivation }) => `${motivation.state.toLowerCase()}, ${motivation.motivation.toFixed(1)}`);
    return `${names[rank]} × ${tasks[task].name}: ${states.join("; ") || "nothing"}`;
  }
}

const font = (isBold) => `${isBold ? "600 " : ""}10px system-ui, sans-serif`;

/** Shortens a text to a width, px, in the middle: names often differ only at the end. */
function cut(c, words, width) {
  const shortened = (length) => `${words.slice(0, Math.ceil(length / 2))}…${words.slice(words.length - Math.floor(length / 2))}`;
  if (c.measureText(words).width <= width) return words;
  let length = words.length - 1;
  while (length > 1 && c.measureText(shortened(length)).width > width) length -= 1;
  return shortened(length);
}

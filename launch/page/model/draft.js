// Changes of an edited scenario that need no page: undo and redo, the grid, and drags of items.

/** The time after which typing begins another step of undo, ms. */
const TYPING_PAUSE_MS = 1000;
/** The number of versions that can be undone. */
const MAX_VERSIONS = 500;
/** Headings are multiples of this angle, degrees. */
const TURN_DEG = 5;

/** The versions of a file `{name, text}`. */
export class Versions {
  #files;
  #place = 0;
  #last = { step: null, at_ms: -Infinity };

  constructor(file) {
    this.#files = [file];
  }

  /** Restores the versions of a text that `save` returned. Returns null for any other text. */
  static restore(text) {
    try {
      const { files, place } = JSON.parse(text);
      if (!files.every(({ name, text: content }) => typeof name === "string" && typeof content === "string")) return null;
      if (!Number.isInteger(place) || !(place in files)) return null;
      const versions = new Versions(files[place]);
      versions.#files = files.map(({ name, text: content }) => ({ name, text: content }));
      versions.#place = place;
      return versions;
    } catch {
      return null;
    }
  }

  /** Returns the versions as text. If it would have more than `max` letters, it lacks the oldest versions, then the newest. */
  save(max) {
    const files = this.#files.map((file) => JSON.stringify(file));
    let letters = files.join(",").length;
    let [from, to] = [0, files.length];
    while (letters > max && to - from > 1) {
      letters -= 1 + (from < this.#place ? files[from++] : files[--to]).length;
    }
    return `{"files":[${files.slice(from, to)}],"place":${this.#place - from}}`;
  }

  get file() {
    return this.#files[this.#place];
  }

  get canUndo() {
    return this.#place > 0;
  }

  get canRedo() {
    return this.#place < this.#files.length - 1;
  }

  /**
   * Adds a version. Changes of the same `step`, such as typing or a move of one item, that follow each other without a
   * pause are one version. A change without a step is always a version of its own.
   */
  add(file, step, now_ms) {
    if (file.text === this.file.text && file.name === this.file.name) return;
    const joins = step !== null && step === this.#last.step && now_ms - this.#last.at_ms < TYPING_PAUSE_MS && this.canUndo;
    this.#files.length = this.#place + (joins ? 0 : 1);
    this.#files.push(file);
    if (this.#files.length > MAX_VERSIONS) this.#files.shift();
    this.#place = this.#files.length - 1;
    this.#last = { step, at_ms: now_ms };
  }

  undo() {
    this.#go(-1);
  }

  redo() {
    this.#go(1);
  }

  #go(by) {
    this.#place = Math.max(0, Math.min(this.#files.length - 1, this.#place + by));
    this.#last = { step: null, at_ms: -Infinity };
  }
}

/** Returns the name of an item, which is the same in all drawings of a text. */
export const idOf = ({ kind, index }) => `${kind} ${index}`;

/** Returns the grid of a room, m: 1/240 of a room of 12 m, and a half of a power of ten in any room. */
export function gridOf({ width_m, height_m }) {
  return 10 ** Math.floor(Math.log10(Math.max(width_m, height_m) / 100)) / 2;
}

/** Rounds a coordinate to a grid, m. */
export function snap(m, grid_m) {
  return Number((Math.round(m / grid_m) * grid_m).toFixed(6));
}

/** Tests whether the items of a kind are rectangles, which a drag can draw. */
export const isRectangle = (kind) => kind === "obstacle" || kind === "zone";

/** Returns the numbers of an item after a drag of the whole item, of its `corner`, or of its `heading`. Points in m. */
export function dragged(item, handle, from, to, grid_m) {
  const { x_m, y_m, numbers } = item;
  const [dx, dy] = [to.x - from.x, to.y - from.y];
  if (handle === "corner") {
    const size = (old, by) => Math.max(grid_m, snap(old + by, grid_m));
    return { x_m, y_m, width_m: size(numbers.width_m, dx), height_m: size(numbers.height_m, dy) };
  }
  if (handle === "heading") {
    const angle = (180 / Math.PI) * Math.atan2(to.y - y_m, to.x - x_m);
    return { x_m, y_m, heading_deg: Math.round(angle / TURN_DEG) * TURN_DEG };
  }
  return { x_m: snap(x_m + dx, grid_m), y_m: snap(y_m + dy, grid_m) };
}

/** Returns the numbers of a rectangle between two points. One that is smaller than the grid has its default size. */
export function rectangleBetween(a, b, grid_m) {
  const [left, right] = [a.x, b.x].map((x) => snap(x, grid_m)).sort((one, other) => one - other);
  const [bottom, top] = [a.y, b.y].map((y) => snap(y, grid_m)).sort((one, other) => one - other);
  const place = { x_m: left, y_m: bottom };
  if (right === left || top === bottom) return place;
  return { ...place, width_m: snap(right - left, grid_m), height_m: snap(top - bottom, grid_m) };
}

/** Returns an outline of a mark, moved by a distance, m. */
export function shifted({ disc, rectangle, bar }, dx, dy) {
  const move = ([x, y]) => [x + dx, y + dy];
  if (disc) return { disc: { ...disc, center: move(disc.center) } };
  if (rectangle) return { rectangle: { min: move(rectangle.min), max: move(rectangle.max) } };
  return { bar: { ...bar, from: move(bar.from), to: move(bar.to) } };
}

/** Returns the item after (`by` = 1) or before (-1) the selected one; the first or last one if none is. */
export function neighbor(items, id, by) {
  if (items.length === 0) return null;
  const at = items.findIndex((item) => idOf(item) === id);
  const next = at < 0 ? (by > 0 ? 0 : -1) : at + by;
  return items.at(next % items.length);
}

/** Returns the line of a place in a text, from 1, and the places of a line's start and end. */
export const lineAt = (text, place) => text.slice(0, place).split("\n").length;
export function rangeOfLine(text, line) {
  const lines = text.split("\n").slice(0, line);
  const end = lines.join("\n").length;
  return [end - lines.at(-1).length, end];
}

/** Returns the place of the first difference of two texts. */
export function firstDifference(a, b) {
  let at = 0;
  while (at < a.length && at < b.length && a[at] === b[at]) at += 1;
  return at;
}

/** Returns the text of a file. Throws an Error with the line of the first byte that is no text. */
export function decode(name, bytes) {
  const decoder = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });
  const lines = [];
  // No character contains the byte of a line's end, so each line is a text.
  for (let start = 0; start < bytes.length; ) {
    const end = bytes.indexOf(10, start) + 1 || bytes.length;
    try {
      lines.push(decoder.decode(bytes.subarray(start, end)));
    } catch {
      throw new Error(`${name}:${lines.length + 1}: the bytes are not UTF-8 text; save the file as UTF-8`);
    }
    start = end;
  }
  return lines.join("");
}

/** Returns a name of a file that no command line has to quote, and which ends with `.toml`. */
export function plainName(name) {
  const plain = name.replace(/\.toml$/i, "").replaceAll(/[^A-Za-z0-9._-]+/g, "-").replace(/^[-.]+/, "");
  return `${plain || "scenario"}.toml`;
}

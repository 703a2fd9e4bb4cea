// The run inside this file, as a source of data like the server (see api.js). Each part is read when it is needed.

import { applyChange } from "./delta.js";
import { canUnpack, unpack } from "./part.js";

const DAMAGED = "This file is damaged: copy it once more, or make it again with: alliance export RUN --html";
const TOO_OLD = "This browser cannot unpack the run: open the file in Chrome 114, Firefox 125, Safari 17.4 or a later one";

/** The maximum number of chunks of views in memory. The views themselves are shared with the log. */
const MAX_CHUNKS = 6;
/** The time after which the reading of views lets the page draw, ms. */
const SLICE_MS = 8;

export class Embedded {
  #document;
  // {parts, chunk, views, every}: the number of parts, of views per chunk, of all views, and of ticks between two views.
  #index;
  // Chunk → promise of {lines, views}; the latest used last. The views read so far come first.
  #chunks = new Map();
  #sliceEnd_ms = 0;

  /** Returns the run inside a document, or null for a page of a server. */
  static in(document) {
    const index = document.getElementById("embedded-run");
    return index && new Embedded(document, JSON.parse(index.textContent));
  }

  constructor(document, index) {
    this.#document = document;
    this.#index = index;
  }

  /** Returns the description of the run. Throws an Error whose message is one line for users, like all requests. */
  async run() {
    if (!canUnpack()) throw new Error(TOO_OLD);
    if (this.#document.querySelectorAll("[data-part]").length !== this.#index.parts) throw new Error(DAMAGED);
    return this.#json("run");
  }

  /** Returns at most `count` views: of the tick `from` and every `step`-th after it, each rounded down to a stored view. */
  async views({ from, count, step }) {
    const { every, views, chunk } = this.#index;
    const found = [];
    for (let nth = 0; nth < count; nth += 1) {
      const index = Math.floor((from + nth * step) / every);
      if (index >= views) break;
      found.push(await this.#view(Math.floor(index / chunk), index % chunk));
    }
    return found;
  }

  /** Returns some hundred views of the whole run, with only the poses and states of the robots. */
  async overview() {
    return this.#json("overview");
  }

  async corners(rank) {
    return this.#json(`corners/${rank}`);
  }

  async events() {
    return this.#json("events");
  }

  /** A file needs no server that could end. */
  accompany() {}

  async #view(chunk, place) {
    const { lines, views } = await this.#chunk(chunk);
    while (views.length <= place) {
      const now_ms = performance.now();
      if (now_ms > this.#sliceEnd_ms) {
        await new Promise((resolve) => setTimeout(resolve));
        this.#sliceEnd_ms = performance.now() + SLICE_MS;
        // Another request may have read on meanwhile.
        continue;
      }
      const content = JSON.parse(lines[views.length]);
      views.push(views.length === 0 ? content : applyChange(views.at(-1), content));
      lines[views.length - 1] = null;
    }
    return views[place];
  }

  #chunk(chunk) {
    const known = this.#chunks.get(chunk) ?? this.#text(`views/${chunk}`).then((text) => ({ lines: text.split("\n"), views: [] }));
    this.#chunks.delete(chunk);
    this.#chunks.set(chunk, known);
    for (const old of this.#chunks.keys()) {
      if (this.#chunks.size <= MAX_CHUNKS) break;
      this.#chunks.delete(old);
    }
    return known;
  }

  async #json(name) {
    return JSON.parse(await this.#text(name));
  }

  async #text(name) {
    try {
      return await (await unpack(this.#document, name)).text();
    } catch {
      throw new Error(DAMAGED);
    }
  }
}

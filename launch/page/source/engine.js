// The simulator inside this file, as the source of a live run like the server (see api.js). It runs in a worker.

import { canUnpack, unpack } from "./part.js";

const DAMAGED = "This file is damaged: download it once more, or build it again with: playground/build";
const TOO_OLD = "This browser cannot run the simulator: open the file in Chrome 114, Firefox 125, Safari 17.4 or a later one";

/** Begins each frame of the second run. */
const BESIDE = "+";

export class Engine extends EventTarget {
  /** The source of the second run's frames, if the choice has one. */
  beside = new EventTarget();

  #document;
  #worker = null;
  #answers = new Map();
  #nextId = 0;

  /** Returns the simulator inside a document, or null for other pages. */
  static in(document) {
    return document.getElementById("embedded-engine") && new Engine(document);
  }

  constructor(document) {
    super();
    this.#document = document;
  }

  /** Returns the version of the program. */
  get version() {
    return JSON.parse(this.#document.getElementById("embedded-engine").textContent).version;
  }

  /** Starts the worker. Returns the scenarios and allocators. Throws an Error whose message is one line for users. */
  async load() {
    if (!canUnpack() || typeof WebAssembly === "undefined" || typeof Worker === "undefined") throw new Error(TOO_OLD);
    let bytes;
    try {
      bytes = await (await unpack(this.#document, "engine")).arrayBuffer();
    } catch {
      throw new Error(DAMAGED);
    }
    // The import map has the file as a URL with its content. A file opened from disk cannot start a worker from another URL.
    this.#worker = new Worker(import.meta.resolve("alliance/source/worker.js"), { type: "module" });
    this.#worker.onmessage = ({ data }) => this.#receive(data);
    const failed = new Promise((_, reject) => {
      this.#worker.onerror = () => reject(new Error(TOO_OLD));
    });
    return Promise.race([this.#ask("load", { bytes }), failed]);
  }

  /** Opens a run: `{scenario, file, allocator, beside, seed, limit_s, orders}`, each may be missing. Returns its description. */
  async open(choice) {
    return this.#ask("open", { choice });
  }

  /** Draws or changes the text of a scenario: see `EditRequest` in the crate playground. */
  async edit(choice, change = null) {
    return this.#ask("edit", { request: { choice, change } });
  }

  /** Sends a command and returns the reply. */
  async control(command) {
    return this.#ask("control", { command });
  }

  /** Returns the orders so far, which a choice repeats. */
  async orders() {
    return this.#ask("orders", {});
  }

  /** Starts the run. Its frames arrive as with the server's socket. */
  openLiveSocket() {
    this.#ask("start", {});
    return this;
  }

  #ask(kind, content) {
    this.#nextId += 1;
    const id = this.#nextId;
    return new Promise((resolve, reject) => {
      this.#answers.set(id, { resolve, reject });
      this.#worker.postMessage({ id, kind, ...content });
    });
  }

  #dispatch(frame) {
    const isBeside = frame.startsWith(BESIDE);
    const data = isBeside ? frame.slice(BESIDE.length) : frame;
    (isBeside ? this.beside : this).dispatchEvent(new MessageEvent("message", { data }));
  }

  #receive({ id, answer, error, frames, stopped }) {
    if (frames) {
      for (const frame of frames) this.#dispatch(frame);
      this.#worker.postMessage({ kind: "shown" });
    } else if (stopped) {
      this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify({ stopped }) }));
    } else if (id) {
      const { resolve, reject } = this.#answers.get(id);
      this.#answers.delete(id);
      if (error === undefined) resolve(answer);
      else reject(new Error(error));
    }
  }
}

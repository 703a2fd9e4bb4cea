// The simulator in a thread of its own: a WebAssembly module (crate playground), its clock and its frames. This file
// imports nothing, because a file opened from disk cannot load the imports of a worker.

/** The mean time between two views of a running clock, ms. Views come after ticks, so single times differ from it. */
const VIEW_INTERVAL_MS = 25;
/** The time between two views without a tick between them, which show that the simulator works, ms. */
const QUIET_INTERVAL_MS = 1000;
/** The largest rounding error of the simulator's times, ms. */
const ROUNDING_MS = 0.001;
/** The number of robots that step before the thread looks for messages of the page. */
const ROBOTS_AT_ONCE = 2000;

/** The module, with texts instead of places in its memory. */
export class Program {
  #exports;

  static async load(bytes) {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Program(instance.exports);
  }

  constructor(exports) {
    this.#exports = exports;
  }

  /** Returns the scenarios and allocators. Must be the first call. */
  list() {
    return JSON.parse(this.#call("list"));
  }

  /** Opens a run, see `Choice` in the crate. Returns its description. Throws an Error with one line if it does not start. */
  open(choice, now_ms) {
    this.#write(JSON.stringify(choice));
    const about = JSON.parse(this.#call("open", now_ms));
    if (about.error) throw new Error(about.error);
    return about;
  }

  /** Draws or changes the text of a scenario, see `EditRequest` in the crate. */
  edit(request) {
    this.#write(JSON.stringify(request));
    const answer = JSON.parse(this.#call("edit"));
    if (answer.error) throw new Error(answer.error);
    return answer;
  }

  /** Executes a command and returns the reply. */
  control(command, now_ms) {
    this.#write(JSON.stringify(command));
    return JSON.parse(this.#call("control", now_ms));
  }

  /** Runs at most `ticks` due ticks. Returns the time until the next one, ms, or infinity if the clock stands. */
  advance(now_ms, ticks) {
    const next_ms = this.#guard(() => this.#exports.advance(now_ms, ticks));
    if (Number.isNaN(next_ms)) throw new Error(this.#text());
    return next_ms;
  }

  /** Returns the frames since the last call, as texts. */
  frames() {
    return this.#call("frames").split("\n");
  }

  /** Returns the orders so far, each a tick and a command. A choice with them repeats the run. */
  orders() {
    return JSON.parse(this.#call("orders"));
  }

  hash() {
    return this.#call("hash");
  }

  #call(name, ...numbers) {
    this.#guard(() => this.#exports[name](...numbers));
    return this.#text();
  }

  /** A panic traps, and its message is the text. */
  #guard(action) {
    try {
      return action();
    } catch (error) {
      throw new Error(`The simulator has stopped: ${this.#text() || error.message}`);
    }
  }

  #text() {
    const place = this.#exports.text();
    return new TextDecoder().decode(new Uint8Array(this.#exports.memory.buffer, place, this.#exports.length()));
  }

  #write(text) {
    const bytes = new TextEncoder().encode(text);
    const place = this.#exports.reserve(bytes.length);
    new Uint8Array(this.#exports.memory.buffer, place, bytes.length).set(bytes);
  }
}

/** A run with its clock. `post` sends a message to the page. */
export class Runner {
  #program;
  #post;
  #ticksAtOnce;
  // The page has drawn the last view.
  #isShown = true;
  #sent_ms = -Infinity;
  // The time of the next tick.
  #due_ms = 0;
  #timer = null;
  // A timer of 0 ms waits at least 4 ms, a message does not.
  #channel = new MessageChannel();

  constructor(program, robots, post) {
    this.#program = program;
    this.#ticksAtOnce = Math.max(1, Math.floor(ROBOTS_AT_ONCE / robots));
    this.#post = post;
    this.#channel.port1.onmessage = () => this.#turn();
  }

  control(command) {
    const reply = this.#program.control(command, performance.now());
    // A paused clock shows the change at once, and the steps of the command after it.
    this.#send();
    this.#hasNews = true;
    this.#turn();
    return reply;
  }

  shown() {
    this.#isShown = true;
  }

  start() {
    this.#turn();
  }

  #turn() {
    clearTimeout(this.#timer);
    const begun_ms = performance.now();
    let next_ms;
    try {
      next_ms = this.#program.advance(begun_ms, this.#ticksAtOnce);
    } catch (error) {
      this.#post({ stopped: error.message });
      return;
    }
    // Between two ticks nothing changes.
    this.#hasNews ||= begun_ms > this.#due_ms - ROUNDING_MS;
    this.#due_ms = begun_ms + next_ms;
    const interval_ms = this.#hasNews ? VIEW_INTERVAL_MS : QUIET_INTERVAL_MS;
    const now_ms = performance.now();
    if (this.#isShown && now_ms - this.#sent_ms >= interval_ms) {
      const late_ms = Math.min(VIEW_INTERVAL_MS, now_ms - this.#sent_ms - interval_ms);
      this.#send();
      // The next view makes up for the lateness of this one.
      this.#sent_ms -= late_ms;
    }
    if (next_ms === 0) this.#channel.port2.postMessage(null);
    else this.#timer = setTimeout(() => this.#turn(), Math.min(next_ms, VIEW_INTERVAL_MS));
  }

  // Ticks may have run since the last view.
  #hasNews = true;

  #send() {
    this.#isShown = false;
    this.#hasNews = false;
    this.#sent_ms = performance.now();
    this.#post({ frames: this.#program.frames() });
  }
}

/** Answers the messages of the page. */
function serve(scope) {
  const post = (message) => scope.postMessage(message);
  let runner = null;
  let program = null;
  const answers = {
    async load({ bytes }) {
      program = await Program.load(bytes);
      return program.list();
    },
    open({ choice }) {
      const about = program.open(choice, performance.now());
      runner = new Runner(program, about.scenario.robots.length, post);
      return about;
    },
    edit: ({ request }) => program.edit(request),
    start: () => runner.start(),
    shown: () => runner.shown(),
    orders: () => program.orders(),
    control: ({ command }) => runner.control(command),
  };
  scope.onmessage = async ({ data: { id, kind, ...content } }) => {
    try {
      post({ id, answer: await answers[kind](content) });
    } catch (error) {
      post({ id, error: error.message });
    }
  };
}

if (typeof WorkerGlobalScope !== "undefined") serve(globalThis);

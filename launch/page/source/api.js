// The server as a source of data. Every call has the token of the link. A file with a run has another source with the
// same requests (embedded.js).

export class Api {
  #token;

  constructor(token) {
    this.#token = token;
  }

  /** Returns the description of the run. Throws an Error whose message is one line for users, like all requests. */
  async run() {
    return this.#call("/api/run");
  }

  /** Returns at most `count` views: of the tick `from` and every `step`-th after it, each rounded down to a stored view. */
  async views({ from, count, step }) {
    return this.#call(`/api/views?from=${from}&count=${count}&step=${step}`);
  }

  /** Returns some hundred views of the whole run, with only the poses and states of the robots. */
  async overview() {
    return this.#call("/api/overview");
  }

  /** Returns the corners of all curves of a robot. */
  async corners(rank) {
    return this.#call(`/api/corners?robot=${rank}`);
  }

  async events() {
    return this.#call("/api/events");
  }

  /** Sends a command and returns the reply. */
  async control(command) {
    const headers = { "Content-Type": "application/json" };
    return this.#call("/api/control", { method: "POST", headers, body: JSON.stringify(command) });
  }

  /** Opens the socket of the live run. */
  openLiveSocket() {
    return this.#socket("/api/live");
  }

  /** Keeps the server of a log running while this page is open. */
  accompany() {
    this.#socket("/api/page");
  }

  #socket(path) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    return new WebSocket(`${scheme}://${location.host}${path}`, ["alliance", this.#token]);
  }

  async #call(path, options = {}) {
    const headers = { ...options.headers, Authorization: `Bearer ${this.#token}` };
    let answer;
    try {
      answer = await fetch(path, { ...options, headers });
    } catch {
      throw new Error("The server of this page does not answer; it runs only as long as its command");
    }
    if (answer.status === 401) throw new Error("This link is not valid: open the link that the command printed");
    const body = await answer.json().catch(() => null);
    if (answer.ok && body !== null) return body;
    throw new Error(body?.error ?? `${path}: ${answer.status} ${answer.statusText}`);
  }
}

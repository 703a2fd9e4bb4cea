// The server's API. Every call has the token of the link.

export class Api {
  #token;

  constructor(token) {
    this.#token = token;
  }

  /** Returns the JSON at a path. Throws an Error whose message is one line for users. */
  async get(path) {
    return this.#call(path, {});
  }

  /** Sends a command and returns the reply. Throws like `get`. */
  async control(command) {
    const headers = { "Content-Type": "application/json" };
    return this.#call("/api/control", { method: "POST", headers, body: JSON.stringify(command) });
  }

  /** Opens the socket of the live run. */
  openLiveSocket() {
    return this.#socket("/api/live");
  }

  /** Opens the socket that keeps the server of a log running while this page is open. */
  openPageSocket() {
    return this.#socket("/api/page");
  }

  #socket(path) {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    return new WebSocket(`${scheme}://${location.host}${path}`, ["alliance", this.#token]);
  }

  async #call(path, options) {
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

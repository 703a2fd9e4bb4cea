// The server's API: every call bears the token of the link.

export class Api {
  #token;

  constructor(token) {
    this.#token = token;
  }

  /** The JSON at that path. Throws an Error whose message is one line for people. */
  async get(path) {
    return this.#call(path, {});
  }

  /** Sends a command and gives the reply. Throws likewise. */
  async control(command) {
    const headers = { "Content-Type": "application/json" };
    return this.#call("/api/control", { method: "POST", headers, body: JSON.stringify(command) });
  }

  /** A socket on which the live run comes. */
  live() {
    return this.#socket("/api/live");
  }

  /** A socket that tells the server of a log that this page is open. */
  accompany() {
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
      throw new Error("the server of this page does not answer; it ends with its command");
    }
    if (answer.status === 401) throw new Error("this link is not valid (any more): open the one that the command has printed");
    const body = await answer.json().catch(() => null);
    if (answer.ok && body !== null) return body;
    throw new Error(body?.error ?? `${path}: ${answer.status} ${answer.statusText}`);
  }
}

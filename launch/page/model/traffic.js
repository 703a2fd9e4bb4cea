// The recent broadcasts with their receptions, and the recent quality of each link.

/** The maximum number of broadcasts. */
const MAX_BROADCASTS = 400;
/** The number of messages that determine a link's quality, and their maximum age in ms of simulated time. */
const LINK_MESSAGES = 20;
const LINK_WINDOW_MS = 30_000;

const LOST = new Set(["Lost", "Dropped", "Cut", "Faded", "Blocked", "Corrupted"]);

export class Traffic {
  /**
   * Latest broadcasts, oldest first: `{key, sender, incarnation, sent, content, receptions: Map(receiver → delivery),
   * duplicates}`.
   */
  broadcasts = [];
  /** The number of receptions that did not reach this page. */
  leftOut = 0;
  /** The number of ticks without messages here, because their views were not shown. */
  skippedTicks = 0;

  #robots;
  #isSampled;
  #lastTick;
  #byKey = new Map();
  // By sender · robots + receiver: [{at, delivery}], oldest first.
  #links;

  /** `isSampled`: a view has the messages of its own tick only, as in a log, not of all ticks since the view before. */
  constructor(robots, isSampled) {
    this.#robots = robots;
    this.#isSampled = isSampled;
    this.clear();
  }

  clear() {
    this.broadcasts = [];
    this.leftOut = 0;
    this.skippedTicks = 0;
    this.#lastTick = null;
    this.#byKey.clear();
    this.#links = Array.from({ length: this.#robots ** 2 }, () => []);
  }

  /** Adds the messages of a view from a log. */
  addView(view) {
    if (this.#isSampled && this.#lastTick !== null) this.skippedTicks += view.tick - this.#lastTick - 1;
    this.#lastTick = view.tick;
    this.add({ receptions: view.messages, left_out: view.messages_left_out });
  }

  /** Adds receptions and the number of those left out. */
  add({ receptions, left_out }) {
    this.leftOut += left_out;
    // Receptions with content go first: a message without content is then found by its sender and time.
    const sorted = receptions.filter(({ reception }) => reception.content);
    sorted.push(...receptions.filter(({ reception }) => !reception.content));
    for (const { receiver, reception } of sorted) {
      this.#addReception(receiver, reception);
      this.#addToLink(receiver, reception);
    }
    while (this.broadcasts.length > MAX_BROADCASTS) this.#byKey.delete(this.broadcasts.shift().key);
  }

  #addReception(receiver, reception) {
    const { sender, incarnation, sent, delivery, content } = reception;
    const prefix = `${sender}.${incarnation}.${sent}.`;
    const key = prefix + (content ? content.seq : "");
    let broadcast = this.#byKey.get(key) ?? (content ? null : this.#unreceived(prefix, receiver));
    if (!broadcast) {
      broadcast = { key, sender, incarnation, sent, content, receptions: new Map(), duplicates: new Set() };
      this.#byKey.set(key, broadcast);
      this.broadcasts.push(broadcast);
    }
    if (delivery === "Duplicate") broadcast.duplicates.add(receiver);
    else broadcast.receptions.set(receiver, delivery);
  }

  /** Returns a known broadcast of that sender and time that the receiver has not received, or undefined. */
  #unreceived(prefix, receiver) {
    return this.broadcasts.findLast((each) => each.key.startsWith(prefix) && !each.receptions.has(receiver));
  }

  #addToLink(receiver, { sender, at, delivery }) {
    if (delivery === "Pending" || delivery === "Duplicate") return;
    const link = this.#links[sender * this.#robots + receiver];
    link.push({ at, delivery });
    if (link.length > LINK_MESSAGES) link.shift();
  }

  /** Returns the recent quality of a link: of `count` messages, how many were lost and how many were late. */
  link(from, to, now) {
    const recent = this.#links[from * this.#robots + to].filter(({ at }) => at > now - LINK_WINDOW_MS);
    return {
      count: recent.length,
      lost: recent.filter(({ delivery }) => LOST.has(delivery)).length,
      late: recent.filter(({ delivery }) => delivery === "Delayed").length,
    };
  }
}

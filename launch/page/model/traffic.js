// Who said what, who heard it, and how good each link has been lately.

/** Broadcasts that are remembered. */
const BROADCASTS = 400;
/** A link is judged by so many messages, not older than this, ms of simulated time. */
const JUDGED = 20;
const JUDGED_MS = 30_000;

const LOST = new Set(["Lost", "Dropped", "Cut"]);

export class Traffic {
  /** Latest broadcasts, oldest first: `{key, sender, incarnation, sent, said, receptions: Map(receiver → delivery), twice}`. */
  broadcasts = [];
  /** Receptions that did not reach this page. */
  leftOut = 0;
  /** Ticks of which nothing was heard, for their views were not shown. */
  skipped = 0;

  #robots;
  #isSampled;
  #lastTick;
  #byKey = new Map();
  // By sender · robots + receiver: [{at, delivery}], oldest first.
  #links;

  /** `isSampled`: a view tells of its own tick only, as in a log, and not of all since the view before. */
  constructor(robots, isSampled) {
    this.#robots = robots;
    this.#isSampled = isSampled;
    this.clear();
  }

  clear() {
    this.broadcasts = [];
    this.leftOut = 0;
    this.skipped = 0;
    this.#lastTick = null;
    this.#byKey.clear();
    this.#links = Array.from({ length: this.#robots ** 2 }, () => []);
  }

  /** Takes in what a view of a log tells. */
  absorb(view) {
    if (this.#isSampled && this.#lastTick !== null) this.skipped += view.tick - this.#lastTick - 1;
    this.#lastTick = view.tick;
    this.hear({ receptions: view.messages, left_out: view.messages_left_out });
  }

  /** Takes in what has become of messages, and how many more there were. */
  hear({ receptions, left_out }) {
    this.leftOut += left_out;
    // Those with contents first: one that never arrived then finds its broadcast by sender and time.
    const sorted = receptions.filter(({ reception }) => reception.said);
    sorted.push(...receptions.filter(({ reception }) => !reception.said));
    for (const { receiver, reception } of sorted) {
      this.#enter(receiver, reception);
      this.#judge(receiver, reception);
    }
    while (this.broadcasts.length > BROADCASTS) this.#byKey.delete(this.broadcasts.shift().key);
  }

  #enter(receiver, reception) {
    const { sender, incarnation, sent, delivery, said } = reception;
    const stem = `${sender}.${incarnation}.${sent}.`;
    const key = stem + (said ? said.seq : "");
    let broadcast = this.#byKey.get(key) ?? (said ? null : this.#unheard(stem, receiver));
    if (!broadcast) {
      broadcast = { key, sender, incarnation, sent, said, receptions: new Map(), twice: new Set() };
      this.#byKey.set(key, broadcast);
      this.broadcasts.push(broadcast);
    }
    if (delivery === "Duplicate") broadcast.twice.add(receiver);
    else broadcast.receptions.set(receiver, delivery);
  }

  /** A known broadcast of that sender and time of which this receiver has not got anything yet. */
  #unheard(stem, receiver) {
    return this.broadcasts.findLast((each) => each.key.startsWith(stem) && !each.receptions.has(receiver));
  }

  #judge(receiver, { sender, at, delivery }) {
    if (delivery === "Pending" || delivery === "Duplicate") return;
    const link = this.#links[sender * this.#robots + receiver];
    link.push({ at, delivery });
    if (link.length > JUDGED) link.shift();
  }

  /** How the link has been lately: how many of `count` messages were lost, and how many came late. */
  link(from, to, now) {
    const recent = this.#links[from * this.#robots + to].filter(({ at }) => at > now - JUDGED_MS);
    return {
      count: recent.length,
      lost: recent.filter(({ delivery }) => LOST.has(delivery)).length,
      late: recent.filter(({ delivery }) => delivery === "Delayed").length,
    };
  }
}

// Where the robots were and what their agents were up to, one sample per view, for trails and for who took part. Bounded: what is
// long ago is kept ever more coarsely.

/** The time in which every sample is kept, ms. */
const NEAR_MS = 60_000;

export class History {
  /** By time: `{t, places: by 2 · rank, m; agents: states by rank}`. */
  samples = [];

  #robots;
  #most;

  constructor(robots) {
    this.#robots = robots;
    // About as much memory for a large team as for a small one.
    this.#most = Math.max(1500, Math.min(6000, Math.round(60_000 / robots)));
  }

  /** Where the samples from that time on begin. */
  indexAt(ms) {
    let low = 0;
    let high = this.samples.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.samples[middle].t < ms) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /**
   * Takes in a view, in any order of time; `now` is the time that is looked at, ms.
   * @param {import("../../page-tests/types.js").View} view
   * @param {number} now
   */
  add(view, now) {
    const at = this.indexAt(view.now);
    const known = this.samples[at]?.t === view.now ? 1 : 0;
    const places = new Float32Array(2 * this.#robots);
    view.robots.forEach((robot, rank) => places.set(robot.pose.position, 2 * rank));
    this.samples.splice(at, known, { t: view.now, places, agents: view.robots.map((robot) => robot.state) });
    if (this.samples.length > this.#most) this.#thin(now);
  }

  /** Halves what is far from `now`; if that does not suffice, for the steps are very short, everything. */
  #thin(now) {
    this.#halve((sample) => Math.abs(sample.t - now) > NEAR_MS);
    if (this.samples.length > 0.9 * this.#most) this.#halve(() => true);
  }

  /** Leaves out every second sample of those, but none beside a change: who died and came back was gone. */
  #halve(isOne) {
    const all = this.samples;
    const isSame = (a, b) => !b || all[a].agents.every((state, rank) => state === b.agents[rank]);
    this.samples = all.filter((sample, index) => {
      return index % 2 === 0 || !isOne(sample) || !isSame(index, all[index - 1]) || !isSame(index, all[index + 1]);
    });
  }
}

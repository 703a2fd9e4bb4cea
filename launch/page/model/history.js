// Positions and states of the robots, one sample per view, for trails and absences. The number of samples is bounded:
// older samples are thinned out.

/** The time span around the present in which every sample is kept, ms. */
const NEAR_MS = 60_000;

export class History {
  /** Samples by time: `{t, positions: x and y index 2 · rank, m; agents: states by rank}`. */
  samples = [];

  #robots;
  #most;

  constructor(robots) {
    this.#robots = robots;
    // The memory use is similar for small and large teams.
    this.#most = Math.max(1500, Math.min(6000, Math.round(60_000 / robots)));
  }

  /** Returns the index of the first sample index or after that time. */
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
   * Adds a view, in any order of time. `now` is the displayed time, ms.
   * @param {import("../../page-tests/types.js").View} view
   * @param {number} now
   */
  add(view, now) {
    const index = this.indexAt(view.now);
    const replaced = this.samples[index]?.t === view.now ? 1 : 0;
    const positions = new Float32Array(2 * this.#robots);
    view.robots.forEach((robot, rank) => positions.set(robot.pose.position, 2 * rank));
    this.samples.splice(index, replaced, { t: view.now, positions, agents: view.robots.map((robot) => robot.state) });
    if (this.samples.length > this.#most) this.#thin(now);
  }

  /** Halves the samples far from `now`. With very short steps that may not suffice; then it halves all samples. */
  #thin(now) {
    this.#halve((sample) => Math.abs(sample.t - now) > NEAR_MS);
    if (this.samples.length > 0.9 * this.#most) this.#halve(() => true);
  }

  /** Removes every second of the given samples, but none next to a change of state: a short absence stays visible. */
  #halve(canDrop) {
    const all = this.samples;
    const isSame = (a, b) => !b || all[a].agents.every((state, rank) => state === b.agents[rank]);
    this.samples = all.filter((sample, index) => {
      return index % 2 === 0 || !canDrop(sample) || !isSame(index, all[index - 1]) || !isSame(index, all[index + 1]);
    });
  }
}

// What the robots did over time, one sample per view, for charts and trails. Bounded: what is long ago is kept ever more coarsely.

/** The time in which every sample is kept, ms. */
const NEAR_MS = 60_000;

/** States of a behavior set, and none: the robot has no such set. */
export const HIBERNATING = 0;
export const WAITING = 1;
export const ACTIVE = 2;
export const NONE = 3;

const STATES = { Hibernating: HIBERNATING, Waiting: WAITING, Active: ACTIVE };

export class History {
  /** By time; see #sample for the fields. */
  samples = [];

  #robots;
  #sets;
  #most;

  constructor(robots, sets) {
    this.#robots = robots;
    this.#sets = sets;
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

  /** Takes in a view, in any order of time; `now` is the time that is looked at, ms. */
  add(view, now) {
    const at = this.indexAt(view.now);
    const known = this.samples[at]?.t === view.now ? 1 : 0;
    this.samples.splice(at, known, this.#sample(view));
    if (this.samples.length > this.#most) this.#thin(now);
  }

  #sample(view) {
    const sets = this.#sets;
    const cells = this.#robots * sets;
    const sample = {
      t: view.now,
      // By 2 · rank, m.
      places: new Float32Array(2 * this.#robots),
      // By rank · sets + set: motivation (NaN: no such set), state, and since when, ms.
      levels: new Float32Array(cells).fill(NaN),
      states: new Uint8Array(cells).fill(NONE),
      since: new Float64Array(cells),
      // By rank.
      agents: view.robots.map((robot) => robot.state),
    };
    view.robots.forEach((robot, rank) => {
      sample.places.set(robot.pose.position, 2 * rank);
      for (const { motivation: it, since } of robot.sets) {
        const cell = rank * sets + it.set;
        sample.levels[cell] = it.motivation;
        sample.states[cell] = STATES[it.state];
        sample.since[cell] = since;
      }
    });
    return sample;
  }

  /** Halves what is far from `now`; if that does not suffice, for the steps are very short, everything. */
  #thin(now) {
    const far = (sample) => Math.abs(sample.t - now) > NEAR_MS;
    this.samples = this.samples.filter((sample, index) => index % 2 === 0 || !far(sample));
    if (this.samples.length > 0.9 * this.#most) this.samples = this.samples.filter((_, index) => index % 2 === 0);
  }
}

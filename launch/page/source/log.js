// The views of a finished run, fetched in chunks around the place that is looked at.
//
// Level l has every l-th view, l a power of two: very fast playing takes a high level, so that it can keep up. A chunk has a
// fixed number of views of one level.

/** Chunks that are kept. */
const CHUNKS = 24;
/** Of the robots' views together, in one chunk. */
const ROBOT_VIEWS = 1200;

export class Log {
  /** Views that are held, and simulated time between two of them, ms. */
  count;
  step_ms;

  #api;
  #every;
  #size;
  // "level:chunk" → views, or null while they are on their way; the latest used last.
  #chunks = new Map();
  #arrived;
  #failed;
  #isDown = false;

  /** `arrived` is called when views have come, `failed` with an Error when they cannot be had; nothing is fetched after that. */
  constructor(api, run, arrived, failed) {
    this.#api = api;
    this.#every = run.log.every;
    this.count = Math.floor(run.log.ticks / run.log.every) + 1;
    this.step_ms = run.scenario.step_ms * run.log.every;
    this.#size = Math.max(40, Math.min(400, Math.round(ROBOT_VIEWS / run.scenario.robots.length)));
    this.#arrived = arrived;
    this.#failed = failed;
  }

  /** The view at `index`, rounded down to its level, or null while it is on its way. What comes next is fetched ahead. */
  view(index, level) {
    const place = Math.floor(index / level);
    const chunk = Math.floor(place / this.#size);
    const views = this.#chunk(level, chunk);
    if (views && place % this.#size > this.#size / 4) this.#chunk(level, chunk + 1);
    return views?.[place % this.#size] ?? null;
  }

  /**
   * The view at `index` and those right before it, oldest first: `{view, before}`, or null while some are on their way. They
   * reach back by half a chunk at least.
   */
  viewWithPast(index) {
    const chunk = Math.floor(index / this.#size);
    const place = index % this.#size;
    const views = this.#chunk(1, chunk);
    const reachesBack = place >= this.#size / 2 || chunk === 0;
    const earlier = reachesBack ? [] : this.#chunk(1, chunk - 1);
    const view = views?.[place];
    return view && earlier ? { view, before: [...earlier, ...views.slice(0, place)] } : null;
  }

  /** The corners of all curves of a robot. */
  async bends(rank) {
    return this.#api.get(`/api/bends?robot=${rank}`);
  }

  /** Some hundred views of the whole run. */
  async overview() {
    const step = Math.max(1, Math.ceil(this.count / this.#size)) * this.#every;
    return this.#api.get(`/api/views?from=0&count=${this.#size}&step=${step}`);
  }

  #chunk(level, chunk) {
    const key = `${level}:${chunk}`;
    const views = this.#chunks.get(key);
    if (views === undefined) {
      this.#fetch(key, level, chunk);
      return null;
    }
    this.#chunks.delete(key);
    this.#chunks.set(key, views);
    return views;
  }

  async #fetch(key, level, chunk) {
    const first = chunk * this.#size * level;
    if (this.#isDown || first >= this.count) return;
    this.#chunks.set(key, null);
    const query = `from=${first * this.#every}&count=${this.#size}&step=${level * this.#every}`;
    try {
      this.#chunks.set(key, await this.#api.get(`/api/views?${query}`));
    } catch (error) {
      this.#isDown = true;
      this.#failed(error);
      return;
    }
    for (const old of this.#chunks.keys()) {
      if (this.#chunks.size <= CHUNKS) break;
      this.#chunks.delete(old);
    }
    this.#arrived();
  }
}

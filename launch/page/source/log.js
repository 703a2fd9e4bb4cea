// The views of a finished run, loaded in chunks around the displayed time. Level l has every l-th view, where l is a
// power of two. Fast playback uses a high level. Every chunk has the same number of views.

/** The maximum number of chunks in memory. */
const MAX_CHUNKS = 24;

export class Log {
  /** The number of views, and the simulated time between two of them, ms. */
  count;
  step_ms;

  #source;
  #every;
  #size;
  // "level:chunk" → views, or null while they are loading; the latest used last.
  #chunks = new Map();
  #arrived;
  #failed;
  #hasFailed = false;

  /**
   * `source` is the server or the file. Calls `arrived` when views have arrived, and `failed` with an Error when a
   * request fails. Nothing is loaded after a failure.
   */
  constructor(source, run, arrived, failed) {
    this.#source = source;
    this.#every = run.log.every;
    this.count = Math.floor(run.log.ticks / run.log.every) + 1;
    this.step_ms = run.scenario.step_ms * run.log.every;
    this.#size = run.log.chunk;
    this.#arrived = arrived;
    this.#failed = failed;
  }

  /** Returns the view at `index`, rounded down to its level, or null while it is loading. Also loads the next chunk. */
  view(index, level) {
    const place = Math.floor(index / level);
    const chunk = Math.floor(place / this.#size);
    const views = this.#chunk(level, chunk);
    if (views && place % this.#size > this.#size / 4) this.#chunk(level, chunk + 1);
    return views?.[place % this.#size] ?? null;
  }

  /**
   * Returns the view at `index` and the views before it, oldest first: `{view, before}`, or null while some are
   * loading. `before` covers at least half a chunk.
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
    if (this.#hasFailed || first >= this.count) return;
    this.#chunks.set(key, null);
    const range = { from: first * this.#every, count: this.#size, step: level * this.#every };
    try {
      this.#chunks.set(key, await this.#source.views(range));
    } catch (error) {
      this.#hasFailed = true;
      this.#failed(error);
      return;
    }
    for (const old of this.#chunks.keys()) {
      if (this.#chunks.size <= MAX_CHUNKS) break;
      this.#chunks.delete(old);
    }
    this.#arrived();
  }
}

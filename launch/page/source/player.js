// Playback of a log. It has the interface of the clock of a live run (see live_clock.js).

/** The minimum rate of views during playback, and the same times the number of robots. The actual rate is up to twice as high. */
const MIN_VIEWS_PER_S = 30;
const ROBOT_VIEWS_PER_S = 1500;
/** Up to this rate of views, the poses between two views are drawn, too. */
const SPARSE_VIEWS_PER_S = 40;
/** The playback speed for "as fast as possible", times real time. */
const MAX_SPEED = 500;
/** The maximum number of views added at once after a slow frame. Views before them are skipped. */
const MAX_AT_ONCE = 200;

/** A longer gap between frames, as in a background tab, counts as this time, ms. */
const MAX_GAP_MS = 500;

export class Player {
  paused = true;
  /** Times real time; null: as fast as possible. */
  speed = 1;
  /** Views are loading. */
  isWaiting = false;

  #log;
  #model;
  #changed;
  // In views, with a fraction during playback.
  #place = 0;
  #shown = -1;
  #mustJump = true;
  #last_ms = null;

  constructor(log, model, changed) {
    this.#log = log;
    this.#model = model;
    this.#changed = changed;
  }

  /** The current simulated time, or the target of a seek, ms. */
  get place_ms() {
    return this.#place * this.#log.step_ms;
  }

  get atEnd() {
    return this.#shown === this.#log.count - 1;
  }

  /** Advances to a wall-clock time before a frame. Returns whether another frame is needed. */
  advance(wall_ms) {
    const elapsed_ms = this.#last_ms === null ? 0 : Math.min(MAX_GAP_MS, wall_ms - this.#last_ms);
    this.#last_ms = this.paused ? null : wall_ms;
    if (this.#mustJump) {
      this.#jump();
    } else if (!this.paused) {
      this.#play(elapsed_ms);
    }
    return !this.paused;
  }

  #jump() {
    const found = this.#log.viewWithPast(this.#place);
    this.isWaiting = found === null;
    if (!found) return;
    this.#mustJump = false;
    this.#shown = this.#place;
    this.#model.jump(found.view, found.before);
  }

  #play(elapsed_ms) {
    const perSecond = (1000 * (this.speed ?? MAX_SPEED)) / this.#log.step_ms;
    // Each view has only its own tick's messages, so every view is shown if the page can keep up.
    const rate = Math.max(MIN_VIEWS_PER_S, ROBOT_VIEWS_PER_S / this.#model.names.length);
    const level = 2 ** Math.max(0, Math.floor(Math.log2(perSecond / rate)));
    const last = this.#log.count - 1;
    const place = Math.min(last, this.#place + (elapsed_ms / 1000) * perSecond);
    // The last view belongs to every level.
    const target = place === last ? last : Math.floor(place / level) * level;
    const view = this.#log.view(target, target === last ? 1 : level);
    this.isWaiting = view === null;
    if (!view) return;
    this.#place = place;
    this.#addViewsUpTo(target, level, view);
    if (perSecond / level < SPARSE_VIEWS_PER_S && place > target) {
      const next = this.#log.view(Math.min(last, target + level), level);
      if (next) this.#model.approach(next, Math.min(1, (place - target) / level));
    }
    if (target === last) this.pause();
  }

  #addViewsUpTo(target, level, view) {
    if (target <= this.#shown) return;
    if ((target - this.#shown) / level <= MAX_AT_ONCE) {
      for (let at = (Math.floor(this.#shown / level) + 1) * level; at < target; at += level) {
        const between = this.#log.view(at, level);
        if (between) this.#model.addView(between);
      }
    }
    this.#shown = target;
    this.#model.addView(view);
  }

  pause() {
    this.paused = true;
    if (!this.#mustJump) this.#place = Math.max(0, this.#shown);
    this.#model.settle();
    this.#changed();
  }

  resume() {
    if (this.atEnd) this.seek(0);
    this.paused = false;
    this.#last_ms = null;
    this.#changed();
  }

  toggle() {
    if (this.paused) this.resume();
    else this.pause();
  }

  /** Moves forward by a number of ticks, at least to the next view, and pauses. */
  step(ticks) {
    this.pause();
    this.move(Math.max(this.#log.step_ms, ticks * this.#model.run.scenario.step_ms));
  }

  setSpeed(speed) {
    this.speed = speed;
    this.#changed();
  }

  /** Moves by a simulated time, ms; back if it is negative. */
  move(ms) {
    this.seek(this.place_ms + ms);
  }

  /** Seeks the first view that includes the events of that time, ms. */
  seekAfter(ms) {
    this.seek(Math.ceil(ms / this.#log.step_ms) * this.#log.step_ms);
  }

  /** Seeks the view nearest to a simulated time, ms. */
  seek(ms) {
    const index = Math.round(ms / this.#log.step_ms);
    this.#place = Math.max(0, Math.min(this.#log.count - 1, index));
    this.#mustJump = this.#place !== this.#shown;
    this.#changed();
  }
}

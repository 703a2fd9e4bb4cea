// Plays a log: where it is, how fast it goes. Has the same face as the clock of a live run (see live_clock.js).

/** Views taken in per second at least where there are so many, and of how many robots together; up to twice as many. */
const VIEWS_PER_S = 30;
const ROBOT_VIEWS_PER_S = 1500;
/** What "as fast as possible" means here, times real time. */
const MAX_SPEED = 500;
/** Views that are taken in one after the other when the page was slow; more of them are a jump. */
const MOST_AT_ONCE = 200;

/** After a longer time without pictures, as of a page in the background, it goes on where it was, ms. */
const MOST_LATE_MS = 500;

export class Player {
  paused = true;
  /** Times real time; null: as fast as possible. */
  speed = 1;
  /** Whether views are on their way. */
  isWaiting = false;

  #log;
  #model;
  #changed;
  // In views, with a fraction while it plays.
  #place = 0;
  #shown = -1;
  #mustJump = true;
  #last_ms = null;

  constructor(log, model, changed) {
    this.#log = log;
    this.#model = model;
    this.#changed = changed;
  }

  /** Where it is or shall be as soon as the views are there, simulated ms. */
  get place_ms() {
    return this.#place * this.#log.step_ms;
  }

  get atEnd() {
    return this.#shown === this.#log.count - 1;
  }

  /** Called before every picture, at that wall-clock time; tells whether another one is needed. */
  advance(wall_ms) {
    const elapsed_ms = this.#last_ms === null ? 0 : Math.min(MOST_LATE_MS, wall_ms - this.#last_ms);
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
    // Every view as long as that can be kept up with: for each tells only the messages of its own tick.
    const bearable = Math.max(VIEWS_PER_S, ROBOT_VIEWS_PER_S / this.#model.names.length);
    const level = 2 ** Math.max(0, Math.floor(Math.log2(perSecond / bearable)));
    const last = this.#log.count - 1;
    const place = Math.min(last, this.#place + (elapsed_ms / 1000) * perSecond);
    // The last view belongs to every level.
    const target = place === last ? last : Math.floor(place / level) * level;
    const view = this.#log.view(target, target === last ? 1 : level);
    this.isWaiting = view === null;
    if (!view) return;
    this.#place = place;
    this.#takeUpTo(target, level, view);
    if (target === last) this.pause();
  }

  #takeUpTo(target, level, view) {
    if (target <= this.#shown) return;
    if ((target - this.#shown) / level <= MOST_AT_ONCE) {
      for (let at = (Math.floor(this.#shown / level) + 1) * level; at < target; at += level) {
        const between = this.#log.view(at, level);
        if (between) this.#model.absorb(between);
      }
    }
    this.#shown = target;
    this.#model.absorb(view);
  }

  pause() {
    this.paused = true;
    if (!this.#mustJump) this.#place = Math.max(0, this.#shown);
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

  /** So many ticks on, or to the next view that is held, and then a pause. */
  step(ticks) {
    this.pause();
    this.move(Math.max(this.#log.step_ms, ticks * this.#model.run.scenario.step_ms));
  }

  setSpeed(speed) {
    this.speed = speed;
    this.#changed();
  }

  /** Goes on by so much simulated time, ms; back if it is negative. */
  move(ms) {
    this.seek(this.place_ms + ms);
  }

  /** Goes to the first view in which what happened at that time, ms, can be seen. */
  seekAfter(ms) {
    this.seek(Math.ceil(ms / this.#log.step_ms) * this.#log.step_ms);
  }

  /** Goes to that simulated time, ms, or the nearest that is held. */
  seek(ms) {
    const index = Math.round(ms / this.#log.step_ms);
    this.#place = Math.max(0, Math.min(this.#log.count - 1, index));
    this.#mustJump = this.#place !== this.#shown;
    this.#changed();
  }
}

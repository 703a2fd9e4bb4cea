// Draws after changes, before the next frame of the screen, and each part at its own maximum rate.

export class Loop {
  // {least_ms, draw, last_ms, isDue}
  #parts = [];
  #before = () => false;
  #isRequested = false;
  #timer = null;

  /** Calls `run(wall_ms)` before every frame. If it returns true, another frame follows. */
  before(run) {
    this.#before = run;
  }

  /** Adds a part that is drawn after a change, with at least `least_ms` between two draws. */
  add(least_ms, draw) {
    this.#parts.push({ least_ms, draw, last_ms: -Infinity, isDue: false });
  }

  /** Requests a redraw of the parts that are drawn before every frame. Called by the function of `before`. */
  requestPicture() {
    for (const part of this.#parts) part.isDue ||= part.least_ms === 0;
  }

  /** Requests a redraw of all parts. */
  request() {
    for (const part of this.#parts) part.isDue = true;
    this.#next();
  }

  #next() {
    if (this.#isRequested) return;
    this.#isRequested = true;
    requestAnimationFrame((wall_ms) => this.#frame(wall_ms));
  }

  #frame(wall_ms) {
    this.#isRequested = false;
    if (this.#before(wall_ms)) this.#next();
    let wait_ms = Infinity;
    for (const part of this.#parts) {
      if (!part.isDue) continue;
      const left_ms = part.last_ms + part.least_ms - wall_ms;
      if (left_ms > 0) {
        wait_ms = Math.min(wait_ms, left_ms);
        continue;
      }
      part.isDue = false;
      part.last_ms = wall_ms;
      part.draw();
    }
    clearTimeout(this.#timer);
    if (wait_ms < Infinity) this.#timer = setTimeout(() => this.#next(), wait_ms);
  }
}

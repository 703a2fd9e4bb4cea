// The clock: pause, steps, speed. The same controls hold a live run's clock and play a log.

import { attribute, byId, text } from "../ui/dom.js";
import { seconds } from "../ui/words.js";

/** The speed achieved is measured over this time, ms of wall-clock. */
const MEASURED_MS = 2000;

const LEAST = 0.1;
const MOST = 100;

/** A speed in few digits. */
function shown(speed) {
  return speed === null ? "max" : `${Number(speed.toPrecision(2))}x`;
}

export class Clock {
  #model;
  #clock;
  // [wall-clock ms, simulated ms], oldest first.
  #marks = [];
  #isSliding = false;

  /** `clock` is a LiveClock or a Player. */
  constructor(model, clock) {
    this.#model = model;
    this.#clock = clock;
    byId("pause").addEventListener("click", () => clock.toggle());
    byId("step").addEventListener("click", () => clock.step(1));
    byId("step-ten").addEventListener("click", () => clock.step(10));
    byId("speed-max").addEventListener("click", () => clock.setSpeed(clock.speed === null ? 1 : null));
    const slider = byId("speed");
    // Logarithmic: -1 is 0.1x, 2 is 100x.
    slider.addEventListener("input", () => {
      this.#isSliding = true;
      text(byId("speed-asked"), shown(10 ** slider.valueAsNumber));
    });
    slider.addEventListener("change", () => {
      this.#isSliding = false;
      clock.setSpeed(Number((10 ** slider.valueAsNumber).toPrecision(2)));
    });
  }

  /** Makes it so many times faster or slower, within the slider's range. */
  scale(factor) {
    // Nothing is faster than as fast as possible.
    if (this.#clock.speed === null && factor > 1) return;
    const speed = (this.#clock.speed ?? MOST) * factor;
    this.#clock.setSpeed(Number(Math.max(LEAST, Math.min(MOST, speed)).toPrecision(2)));
  }

  draw() {
    const { view, now, isLive, isOpen } = this.#model;
    const { paused, speed } = this.#clock;
    text(byId("time"), seconds(now, 2));
    text(byId("tick"), view ? `tick ${view.tick}` : "");
    text(byId("pause"), paused ? (isLive ? "Resume" : "Play") : "Pause");
    attribute(byId("pause"), "aria-keyshortcuts", "Space");
    attribute(byId("speed-max"), "aria-pressed", String(speed === null));
    for (const id of ["pause", "step", "step-ten", "speed", "speed-max"]) byId(id).disabled = isLive && !isOpen;
    if (!this.#isSliding) {
      text(byId("speed-asked"), shown(speed));
      const place = Math.log10(Math.max(LEAST, Math.min(MOST, speed ?? MOST)));
      if (Math.abs(byId("speed").valueAsNumber - place) > 0.02) byId("speed").value = place;
      attribute(byId("speed"), "aria-valuetext", shown(speed));
    }
    this.#measure(!view || paused || (isLive && !isOpen));
  }

  /** Simulated time per wall-clock time in the last seconds. */
  #measure(stands) {
    const wall = performance.now();
    const { now } = this.#model;
    const last = this.#marks.at(-1);
    if (stands || (last && now < last[1])) this.#marks = [];
    else if (!last || last[1] !== now) this.#marks.push([wall, now]);
    while (this.#marks.length && this.#marks[0][0] < wall - MEASURED_MS) this.#marks.shift();
    const [first, newest] = [this.#marks[0], this.#marks.at(-1)];
    const achieved = first && newest[0] > first[0] + 200 ? (newest[1] - first[1]) / (newest[0] - first[0]) : null;
    text(byId("speed-achieved"), achieved === null ? "–" : shown(achieved));
  }
}

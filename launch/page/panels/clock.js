// The clock: pause, steps, speed. It controls a live run's clock or the playback of a log.

import { attribute, byId, text } from "../ui/dom.js";
import { seconds } from "../ui/words.js";

/** The time over which the achieved speed is measured, ms of wall-clock time. */
const WINDOW_MS = 2000;

const MIN_SPEED = 0.1;
const MAX_SPEED = 100;

/** Returns a speed as a short text. */
function shown(speed) {
  return speed === null ? "max" : `${Number(speed.toPrecision(2))}x`;
}

export class Clock {
  #model;
  #clock;
  // [ms of wall-clock time, simulated ms], oldest first.
  #marks = [];
  #isSliding = false;

  constructor(model, clock) {
    this.#model = model;
    this.#clock = clock;
    byId("pause").addEventListener("click", () => clock.toggle());
    byId("step").addEventListener("click", () => clock.step(1));
    byId("step-ten").addEventListener("click", () => clock.step(10));
    byId("speed-max").addEventListener("click", () => clock.setSpeed(clock.speed === null ? 1 : null));
    const slider = byId("speed");
    // The scale is logarithmic: -1 is 0.1x, 2 is 100x.
    slider.addEventListener("input", () => {
      this.#isSliding = true;
      text(byId("speed-asked"), shown(10 ** slider.valueAsNumber));
    });
    slider.addEventListener("change", () => {
      this.#isSliding = false;
      clock.setSpeed(Number((10 ** slider.valueAsNumber).toPrecision(2)));
    });
  }

  /** Multiplies the speed by a factor, within the slider's range. */
  scale(factor) {
    if (this.#clock.speed === null && factor > 1) return;
    const speed = (this.#clock.speed ?? MAX_SPEED) * factor;
    this.#clock.setSpeed(Number(Math.max(MIN_SPEED, Math.min(MAX_SPEED, speed)).toPrecision(2)));
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
      const place = Math.log10(Math.max(MIN_SPEED, Math.min(MAX_SPEED, speed ?? MAX_SPEED)));
      if (Math.abs(byId("speed").valueAsNumber - place) > 0.02) byId("speed").value = place;
      attribute(byId("speed"), "aria-valuetext", shown(speed));
    }
    this.#measure(!view || paused || (isLive && !isOpen));
  }

  /** Measures the simulated time per wall-clock time. */
  #measure(isStopped) {
    const wall = performance.now();
    const { now } = this.#model;
    const last = this.#marks.at(-1);
    if (isStopped || (last && now < last[1])) this.#marks = [];
    else if (!last || last[1] !== now) this.#marks.push([wall, now]);
    while (this.#marks.length && this.#marks[0][0] < wall - WINDOW_MS) this.#marks.shift();
    const [first, newest] = [this.#marks[0], this.#marks.at(-1)];
    const achieved = first && newest[0] > first[0] + 200 ? (newest[1] - first[1]) / (newest[0] - first[0]) : null;
    text(byId("speed-achieved"), achieved === null ? "–" : shown(achieved));
    byId("achieved").style.visibility = achieved === null ? "hidden" : "visible";
  }
}

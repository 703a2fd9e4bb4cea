// The time slider of a log, with marks of the listed events.

import { GROUPS } from "../model/events.js";
import { themeColor } from "../ui/colors.js";
import { byId, text } from "../ui/dom.js";
import { eventInWords, seconds } from "../ui/words.js";

/** Half of the slider thumb, px. The ends of the slider's range lie this far inside. */
const THUMB_PX = 8;

export class Timeline {
  #model;
  #player;
  #events;
  #marked = "";
  // The event of the last jump and the position after it: {t_ms, place_ms, line}.
  #jumped = null;

  constructor(model, player, events) {
    this.#model = model;
    this.#player = player;
    this.#events = events;
    byId("timeline").hidden = false;
    const slider = byId("time-slider");
    slider.max = model.run.log.ticks;
    slider.step = model.run.log.every;
    slider.addEventListener("input", () => player.seek(slider.valueAsNumber * model.run.scenario.step_ms));
    byId("previous-event").addEventListener("click", () => this.jump(-1));
    byId("next-event").addEventListener("click", () => this.jump(1));
    text(byId("duration"), seconds(model.run.log.duration_ms, 2));
  }

  /** Seeks the next (1) or previous (-1) listed event. */
  jump(direction) {
    const { events } = this.#model;
    // The log of a long run does not have every tick: the view after an event may have a later time.
    const from = this.#jumped?.place_ms === this.#player.place_ms ? this.#jumped.t_ms : this.#player.place_ms;
    const wanted = (event) => (event.t_ms - from) * direction > 0 && this.#events.isWanted(event);
    const found = direction > 0 ? events.find(wanted) : events.findLast(wanted);
    if (!found) return;
    this.#player.seekAfter(found.t_ms);
    const line = [found.robot, eventInWords(found, this.#model.names).what].filter(Boolean).join(" ");
    this.#jumped = { t_ms: found.t_ms, place_ms: this.#player.place_ms, line: `${seconds(found.t_ms, 2)}: ${line}` };
  }

  draw() {
    const { view } = this.#model;
    if (!view) return;
    const slider = byId("time-slider");
    // The slider keeps its position until the views arrive.
    if (!this.#player.isWaiting) slider.value = view.tick;
    slider.setAttribute("aria-valuetext", seconds(this.#model.now, 2));
    text(byId("at-event"), this.#jumped?.place_ms === this.#player.place_ms ? this.#jumped.line : "");
    this.#mark();
  }

  /** Redraws the marks after a change of filter, theme or size. */
  #mark() {
    const canvas = byId("marks");
    const { clientWidth: width, clientHeight: height } = canvas;
    const { events } = this.#model;
    const key = [
      width,
      height,
      devicePixelRatio,
      events.length,
      this.#events.filter,
      document.documentElement.dataset.theme,
    ].join();
    if (key === this.#marked) return;
    this.#marked = key;
    canvas.width = Math.round(width * devicePixelRatio);
    canvas.height = Math.round(height * devicePixelRatio);
    const c = canvas.getContext("2d");
    c.scale(devicePixelRatio, devicePixelRatio);
    c.font = "10px system-ui, sans-serif";
    c.textAlign = "center";
    c.textBaseline = "middle";
    const colors = Object.fromEntries(
      Object.keys(GROUPS).map((group) => [
        group,
        themeColor(group === "faults" ? "--bad" : group === "robots" ? "--ink" : "--ink-2"),
      ]),
    );
    for (const event of events.filter((each) => this.#events.isWanted(each))) {
      const { group } = event;
      const x = THUMB_PX + (event.t_ms / this.#model.run.log.duration_ms) * (width - 2 * THUMB_PX);
      c.fillStyle = colors[group];
      c.fillText(GROUPS[group].sign, x, height / 2);
    }
  }
}

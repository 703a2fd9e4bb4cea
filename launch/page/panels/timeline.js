// The time slider of a log, with marks of the listed events and the times. Many events are drawn as a density. The pointer shows
// the events of a mark, and a click seeks the first one.

import { GROUPS } from "../model/events.js";
import { themeColor } from "../ui/colors.js";
import { attribute, byId, text } from "../ui/dom.js";
import { eventInWords, seconds } from "../ui/words.js";

/** Half of the slider thumb, px. The ends of the slider's range lie this far inside. */
const THUMB_PX = 8;
/** The heights of the row of marks and of the row of times, px. */
const MARKS_PX = 14;
/** Below this distance of two marks on average, px, a group is drawn as a density. */
const CROWDED_PX = 9;
/** The width of a bin of the density, px. */
const BIN_PX = 4;
/** The least distance of two times, px. */
const TIMES_PX = 70;
/** The largest distance of the pointer from the mark of an event, px, and the number of events in its tooltip. */
const NEAR_PX = 5;
const MAX_EVENTS = 8;
/** Groups whose events are always drawn as marks, above all others. */
const ALWAYS = ["robots", "faults", "takeovers"];

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
    const marks = byId("marks");
    marks.addEventListener("pointermove", (event) => {
      const near = this.#eventsUnder(event);
      const lines = near.slice(0, MAX_EVENTS).map((each) => this.#line(each));
      if (near.length > MAX_EVENTS) lines.push(`and ${near.length - MAX_EVENTS} more`);
      attribute(marks, "title", lines.join("\n") || null);
      marks.style.cursor = near.length ? "pointer" : "";
    });
    marks.addEventListener("click", (event) => {
      const [first] = this.#eventsUnder(event);
      if (first) this.#go(first);
    });
  }

  /** Returns the place of a time on the canvas, px. */
  #place(ms) {
    return THUMB_PX + (ms / this.#model.run.log.duration_ms) * (byId("marks").clientWidth - 2 * THUMB_PX);
  }

  /** Returns the listed events at the pointer, those with a mark of their own first. */
  #eventsUnder({ offsetX }) {
    const near = this.#model.events.filter((each) => Math.abs(this.#place(each.t_ms) - offsetX) <= NEAR_PX && this.#events.isWanted(each));
    return near.sort((a, b) => ALWAYS.includes(b.group) - ALWAYS.includes(a.group));
  }

  /** Returns an event in words, with its time. */
  #line(event) {
    return `${seconds(event.t_ms, 2)}: ${[event.robot, eventInWords(event, this.#model.names).what].filter(Boolean).join(" ")}`;
  }

  /** Seeks an event and names it. */
  #go(event) {
    this.#player.seekAfter(event.t_ms);
    this.#jumped = { t_ms: event.t_ms, place_ms: this.#player.place_ms, line: this.#line(event) };
  }

  /** Seeks the next (1) or previous (-1) listed event. */
  jump(direction) {
    const { events } = this.#model;
    // The log of a long run does not have every tick: the view after an event may have a later time.
    const from = this.#jumped?.place_ms === this.#player.place_ms ? this.#jumped.t_ms : this.#player.place_ms;
    const wanted = (event) => (event.t_ms - from) * direction > 0 && this.#events.isWanted(event);
    const found = direction > 0 ? events.find(wanted) : events.findLast(wanted);
    if (found) this.#go(found);
  }

  draw() {
    const { view } = this.#model;
    if (!view) return;
    const slider = byId("time-slider");
    // The slider keeps its position until the views arrive.
    if (!this.#player.isWaiting) slider.value = view.tick;
    slider.setAttribute("aria-valuetext", seconds(this.#model.now, 2));
    const line = this.#jumped?.place_ms === this.#player.place_ms ? this.#jumped.line : "";
    text(byId("at-event"), line);
    attribute(byId("at-event"), "title", line || null);
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
        themeColor({ faults: "--bad", robots: "--ink", takeovers: "--select" }[group] ?? "--ink-2"),
      ]),
    );
    const { duration_ms } = this.#model.run.log;
    const at = (ms) => this.#place(ms);
    const wanted = events.filter((each) => this.#events.isWanted(each));
    const others = wanted.filter(({ group }) => !ALWAYS.includes(group));
    if (others.length * CROWDED_PX > width) drawDensity(c, others.map(({ t_ms }) => at(t_ms)), colors.tasks);
    else drawMarks(c, others, at, colors);
    drawMarks(
      c,
      wanted.filter(({ group }) => ALWAYS.includes(group)),
      at,
      colors,
    );
    drawTimes(c, at, duration_ms, width, height, themeColor("--ink-2"));
  }
}

function drawMarks(c, events, at, colors) {
  for (const { group, t_ms } of events) {
    c.fillStyle = colors[group];
    c.fillText(GROUPS[group].sign, at(t_ms), MARKS_PX / 2);
  }
}

/** Draws the number of events per bin of time by the square root, the highest over the whole height. */
function drawDensity(c, places, color) {
  const bins = new Map();
  for (const x of places) {
    const bin = Math.floor(x / BIN_PX);
    bins.set(bin, (bins.get(bin) ?? 0) + 1);
  }
  const most = Math.max(...bins.values());
  c.fillStyle = color;
  c.globalAlpha = 0.55;
  for (const [bin, count] of bins) {
    const high = Math.max(2, MARKS_PX * Math.sqrt(count / most));
    c.fillRect(bin * BIN_PX, MARKS_PX - high, BIN_PX - 1, high);
  }
  c.globalAlpha = 1;
}

/** Writes round times below the marks. */
function drawTimes(c, at, duration_ms, width, height, color) {
  const least_ms = (duration_ms * TIMES_PX) / width;
  const power = 10 ** Math.floor(Math.log10(least_ms));
  const step_ms = [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least_ms);
  c.fillStyle = color;
  for (let ms = 0; ms <= duration_ms; ms += step_ms) {
    const label = `${Number((ms / 1000).toPrecision(6))} s`;
    const half = c.measureText(label).width / 2;
    c.fillText(label, Math.max(half, Math.min(width - half, at(ms))), (MARKS_PX + height) / 2);
    c.fillRect(at(ms), height - 2, 1, 2);
  }
}

// Charts of the robots' motivations, one chart per robot: a line per behavior set, the threshold, and states as bands.
// An allocator without motivations has utilities, without a threshold. uPlot draws them; index.html loads it.

import { ACTIVE, WAITING } from "../model/curves.js";
import { DETECTED, TOOK_OVER } from "../model/events.js";
import { levels } from "../model/levels.js";
import { themeColor } from "../ui/colors.js";
import { attribute, byId, dot, el, keyed, text } from "../ui/dom.js";
import { isShown } from "../ui/tabs.js";
import { Matrix } from "./matrix.js";

/** The number of robots with a chart at first. */
const INITIAL_ROBOTS = 6;
/** The maximum number of curves per robot. The active and waiting sets come first, then those with the highest levels. */
const MAX_CURVES = 8;
const MIN_HEIGHT_PX = 96;
/** The height of the axis of time with times and without, px. */
const TIMES_PX = 20;
const BARE_PX = 8;
const MAX_HEIGHT_PX = 220;
/** The step of the arrow keys over the charts, px. */
const STEP_PX = 4;
const SVG = "http://www.w3.org/2000/svg";

export class Charts {
  #model;
  #choices;
  #seek;
  #shown;
  #hidden = new Set();
  #charts = new Map();
  #load;
  // Ranks of robots whose curves were requested from the log.
  #requested = new Set();

  /**
   * `seek(ms)` is called on a click into a chart; null in a live run. `load(rank)` loads a robot's curves into the
   * model; null in a live run, which receives them.
   */
  constructor(model, choices, seek, load) {
    this.#model = model;
    this.#choices = choices;
    this.#seek = seek;
    this.#load = load;
    this.#shown = new Set(model.names.slice(0, INITIAL_ROBOTS));
    this.#buildLegend();
    // A large team has hundreds of check boxes: they are built when the list opens.
    const choice = byId("chart-choice");
    choice.addEventListener("toggle", () => this.#buildRobots(), { once: true });
    // The list lies over the charts, so that it closes like a menu.
    choice.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      choice.open = false;
      choice.firstElementChild.focus();
    });
    choice.addEventListener("focusout", ({ relatedTarget }) => {
      if (relatedTarget && !choice.contains(relatedTarget)) choice.open = false;
    });
    byId("span").addEventListener("change", () => this.draw());
    // In a log these keys seek.
    if (!seek) byId("chart-list").addEventListener("keydown", (event) => this.#move(event));
    byId("chart-list").addEventListener("blur", () => this.#point(-1));
  }

  /** Moves the time at which the charts show their values. */
  #move(event) {
    const step = { ArrowLeft: -STEP_PX, ArrowRight: STEP_PX }[event.key];
    const plot = [...this.#charts.values()].find((chart) => chart.plot)?.plot;
    if (!step || !plot) return;
    event.preventDefault();
    const width = plot.over.clientWidth;
    const from = plot.cursor.left >= 0 ? plot.cursor.left : width;
    this.#point(Math.max(0, Math.min(width - 1, from + step)));
  }

  /** Shows the values at a place of the charts, px; -1: the present ones. */
  #point(left) {
    for (const { plot } of this.#charts.values()) plot?.setCursor({ left, top: left < 0 ? -1 : 0 });
  }

  /** Rebuilds all charts after a change of colors. */
  refreshColors() {
    for (const { plot } of this.#charts.values()) plot?.destroy();
    this.#charts.clear();
    keyed(byId("chart-list"), []);
    delete byId("legend").dataset.sets;
    this.#buildLegend();
  }

  #color(set) {
    return this.#model.sets[set].color ?? themeColor("--ink");
  }

  #swatch(set) {
    const svg = document.createElementNS(SVG, "svg");
    const line = document.createElementNS(SVG, "line");
    attribute(svg, "width", "20");
    attribute(svg, "height", "8");
    attribute(svg, "aria-hidden", "true");
    const style = {
      x1: 0,
      x2: 20,
      y1: 4,
      y2: 4,
      stroke: this.#color(set),
      "stroke-width": 2.5,
      "stroke-dasharray": this.#model.sets[set].dash.join(" ") || null,
    };
    for (const [name, value] of Object.entries(style)) attribute(line, name, value);
    svg.append(line);
    return svg;
  }

  /** Shows a chip for each behavior set with a curve, or for all sets of a small mission. */
  #buildLegend() {
    const all = this.#model.sets.map((_, set) => set);
    const drawn = new Set([...this.#charts.values()].flatMap(({ sets }) => sets));
    const listed = all.length <= MAX_CURVES ? all : all.filter((set) => drawn.has(set));
    const key = listed.join(" ");
    if (byId("legend").dataset.sets === key) return;
    byId("legend").dataset.sets = key;
    const buttons = listed.map((set) => this.#chip(set));
    byId("legend").replaceChildren(...buttons);
  }

  #chip(set) {
    const { name } = this.#model.sets[set];
    return el(
      "button",
      {
        type: "button",
        class: "chip",
        "data-legend": name,
        "aria-pressed": String(!this.#hidden.has(set)),
        title: `Show or hide ${name}`,
        onclick: ({ currentTarget }) => this.#toggleSet(set, currentTarget),
      },
      this.#swatch(set),
      name,
    );
  }

  #toggleSet(set, button) {
    if (!this.#hidden.delete(set)) this.#hidden.add(set);
    attribute(button, "aria-pressed", String(!this.#hidden.has(set)));
    for (const { plot, sets } of this.#charts.values()) {
      if (sets.includes(set)) plot.setSeries(sets.indexOf(set) + 1, { show: !this.#hidden.has(set) });
    }
    this.draw();
  }

  #buildRobots() {
    const { names } = this.#model;
    const boxes = names.map((name) => {
      const box = el("input", { type: "checkbox", "data-chart-choice": name, checked: this.#shown.has(name) });
      box.addEventListener("change", () => {
        if (box.checked) this.#shown.add(name);
        else this.#shown.delete(name);
        this.draw();
      });
      return el("label", { class: "check" }, box, name);
    });
    byId("chart-robots").replaceChildren(...boxes);
  }

  draw() {
    if (!isShown("charts") || !this.#model.view) return;
    const list = byId("chart-list");
    list.hidden = byId("legend").hidden = byId("span").hidden = byId("chart-choice").hidden = Matrix.isChosen();
    if (Matrix.isChosen()) {
      text(byId("chart-title"), "Activities");
      return;
    }
    const { names } = this.#model;
    byId("chart-choice").hidden = names.length <= 1;
    const isShownNow = (rank) => this.#shown.has(names[rank]) || rank === this.#choices.selected;
    const ranks = names.map((_, rank) => rank).filter(isShownNow);
    keyed(
      list,
      ranks,
      (rank) => rank,
      (rank) => this.#build(rank),
    );
    for (const [rank, { plot }] of this.#charts) {
      if (ranks.includes(rank)) continue;
      plot?.destroy();
      this.#charts.delete(rank);
    }
    const hasMotivations = ranks.some((rank) => this.#model.view.robots[rank].measure === "motivation");
    text(byId("chart-title"), hasMotivations || ranks.length === 0 ? "Motivations" : "Utilities");
    text(byId("chart-count"), `${ranks.length} of ${this.#model.names.length}`);
    const each = Math.floor((list.clientHeight - TIMES_PX + BARE_PX) / Math.max(1, ranks.length));
    const width = list.clientWidth - 4;
    const height = Math.max(MIN_HEIGHT_PX, Math.min(MAX_HEIGHT_PX, each)) - 24;
    for (const rank of ranks) {
      // Charts that are all visible have one axis of time, below the last one.
      const hasTimes = rank === ranks.at(-1) || each < MIN_HEIGHT_PX;
      this.#update(rank, { width, height: hasTimes ? height + TIMES_PX - BARE_PX : height }, hasTimes);
    }
    this.#buildLegend();
  }

  /**
   * Returns the behavior sets whose curves are drawn. The drawn ones stay until a set without a curve becomes active or
   * waiting. An absent robot has no current sets, but has past ones.
   */
  #setsOf(rank, drawn) {
    const current = this.#model.view.robots[rank].sets.map(({ motivation }) => motivation);
    const past = this.#model.curves.setsOf(rank);
    const byWeight = (a, b) => (b.state !== "Hibernating") - (a.state !== "Hibernating") || b.motivation - a.motivation || a.set - b.set;
    const candidates = new Set([...drawn, ...current.map(({ set }) => set), ...past]);
    if (candidates.size <= MAX_CURVES) return [...candidates].sort((a, b) => a - b);
    const ranked = current.sort(byWeight).filter(({ state, motivation }) => state !== "Hibernating" || motivation > 0);
    const busy = ranked.filter(({ state }) => state !== "Hibernating").map(({ set }) => set);
    if (drawn.length > 0 && busy.every((set) => drawn.includes(set))) return drawn;
    const pastBusy = past.filter((set) => this.#model.corners(rank, set).some(({ state }) => state !== "Hibernating"));
    const all = [...busy, ...drawn.slice(-MAX_CURVES / 2), ...ranked.map(({ set }) => set), ...pastBusy];
    return [...new Set(all)].slice(0, MAX_CURVES).sort((a, b) => a - b);
  }

  /** Returns the time range of the charts, ms. A log also has data after the present. */
  #range() {
    const span_ms = 1000 * Number(byId("span").value);
    const { now, run } = this.#model;
    const end = run.log ? run.log.duration_ms : now;
    if (span_ms === 0) return [0, Math.max(1000, end)];
    const to = Math.max(span_ms, Math.min(end, now + (run.log ? span_ms / 4 : 0)));
    return [to - span_ms, to];
  }

  #build(rank) {
    if (this.#load && !this.#requested.has(rank)) {
      this.#requested.add(rank);
      this.#load(rank);
    }
    const { names, colors } = this.#model;
    const readout = el("span", { class: "values" });
    const title = el("div", { class: "chart-title" }, dot(colors[rank]), el("strong", {}, names[rank]), readout);
    const place = el("div", { class: "plot" });
    const element = el("section", { class: "chart", "data-chart": names[rank] }, title, place);
    const chart = { rank, element, place, readout, values: new Map(), sets: [], bands: [], columns: [[]], size: null, plot: null, hasTimes: false };
    this.#charts.set(rank, chart);
    return element;
  }

  /** Creates the plot of a chart for these behavior sets, and the values next to the robot's name. */
  #plot(chart, shown) {
    const { sets } = this.#model;
    chart.sets = shown;
    chart.size = null;
    chart.plot?.destroy();
    const values = shown.map((set) => [set, el("span", { "data-motivation": sets[set].name })]);
    chart.values = new Map(values);
    const readouts = values.map(([set, number]) => el("span", { class: "value", title: sets[set].name }, this.#swatch(set), number));
    chart.time = el("span", { class: "value dim" });
    chart.readout.replaceChildren(...readouts, chart.time);
    chart.plot = new uPlot(this.#options(chart), [[0], ...shown.map(() => [null])], chart.place);
  }

  #options(chart) {
    const axis = {
      stroke: themeColor("--ink-2"),
      font: "10px system-ui, sans-serif",
      grid: { stroke: themeColor("--line"), width: 1 },
      ticks: { show: false },
    };
    return {
      width: 300,
      height: MIN_HEIGHT_PX,
      padding: [4, 16, 0, 0],
      legend: { show: false },
      cursor: { sync: { key: "motivations" }, drag: { x: false, y: false }, y: false },
      scales: {
        x: { time: false, auto: false, range: () => this.#range().map((ms) => ms / 1000) },
        y: { range: () => [0, 1.12 * this.#top(chart)] },
      },
      axes: [
        { ...axis, size: chart.hasTimes ? TIMES_PX : BARE_PX, gap: 5, space: 60, values: (_, ticks) => ticks.map((tick) => (chart.hasTimes ? `${tick} s` : "")) },
        {
          ...axis,
          size: 38,
          gap: 3,
          splits: () => [0, 0.5, 1].map((share) => share * this.#top(chart)),
          values: (_, ticks) => ticks.map((tick) => this.#tick(chart, tick)),
        },
      ],
      series: [
        {},
        ...chart.sets.map((set) => ({
          stroke: this.#color(set),
          width: 1.75,
          dash: this.#model.sets[set].dash,
          points: { show: false },
          show: !this.#hidden.has(set),
        })),
      ],
      hooks: {
        drawClear: [(plot) => this.#paintBands(plot, chart)],
        draw: [(plot) => this.#paintLines(plot, chart)],
        setCursor: [() => this.#showValues(chart)],
        ready: [(plot) => this.#seekOnClick(plot)],
      },
    };
  }

  #hasUtilities({ rank }) {
    return this.#model.view.robots[rank].measure === "utility";
  }

  /** Returns the top of the vertical scale: the threshold, or the highest utility in the chart. */
  #top(chart) {
    if (!this.#hasUtilities(chart)) return this.#model.run.alliance.threshold;
    const levels = chart.columns.slice(1).flat();
    return levels.reduce((top, level) => Math.max(top, level), 0) || 1;
  }

  #tick(chart, level) {
    if (this.#hasUtilities(chart)) return level.toFixed(2);
    return level === this.#model.run.alliance.threshold ? `θ ${level}` : level;
  }

  #seekOnClick(plot) {
    if (!this.#seek) return;
    plot.over.style.cursor = "pointer";
    plot.over.addEventListener("click", (event) => this.#seek(1000 * plot.posToVal(event.offsetX, "x")));
  }

  #update(rank, { width, height }, hasTimes) {
    const chart = this.#charts.get(rank);
    const { history } = this.#model;
    const shown = this.#setsOf(rank, chart.sets);
    if (!chart.plot || shown.join() !== chart.sets.join() || chart.hasTimes !== hasTimes) {
      chart.hasTimes = hasTimes;
      this.#plot(chart, shown);
    }
    const curves = shown.map((set) => this.#model.corners(rank, set));
    const size = `${width}×${height}`;
    if (chart.size !== size) {
      chart.size = size;
      chart.plot.setSize({ width, height });
    }
    const { columns, bands } = levels(curves, history.samples, rank, ...this.#range());
    const named = bands.map((band) => ({ ...band, set: band.set === null ? null : shown[band.set] }));
    Object.assign(chart, { columns, bands: named });
    chart.plot.setData(columns);
    const what = this.#hasUtilities(chart) ? "Utilities" : "Motivations";
    attribute(chart.element, "aria-label", `${what} of ${this.#model.names[rank]}`);
    attribute(chart.element, "data-measure", this.#model.view.robots[rank].measure);
    attribute(chart.element, "data-state", this.#model.view.robots[rank].state);
    this.#showValues(chart, rank);
  }

  /** Shows the values at the pointer, or the current ones. */
  #showValues(chart) {
    const { idx } = chart.plot?.cursor ?? {};
    const { columns } = chart;
    const at = idx ?? this.#indexOfNow(columns[0]);
    const digits = this.#hasUtilities(chart) ? 2 : 0;
    for (const [set, number] of chart.values) {
      const level = columns[chart.sets.indexOf(set) + 1]?.[at];
      text(number, level === null || level === undefined ? "–" : level.toFixed(digits));
    }
    const isPointer = idx !== null && idx !== undefined;
    text(chart.time, isPointer && at >= 0 ? `at ${columns[0][at].toFixed(2)} s` : "");
    attribute(chart.readout, "data-at", isPointer ? "pointer" : "now");
  }

  /** Returns the row of the current levels. A view lies between two steps; its levels are those of the step before. */
  #indexOfNow(times) {
    const now = (this.#model.now - this.#model.run.scenario.step_ms) / 1000;
    let at = times.length - 1;
    while (at > 0 && times[at] > now) at -= 1;
    return at;
  }

  #paintBands(plot, chart) {
    const { ctx: c, bbox } = plot;
    const ratio = devicePixelRatio;
    c.save();
    c.beginPath();
    c.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    c.clip();
    const lines = [];
    const bandTop = plot.valToPos(this.#top(chart), "y", true) + 3 * ratio;
    for (const { set, state, from, to } of chart.bands) {
      if (set !== null && this.#hidden.has(set)) continue;
      const left = plot.valToPos(from, "x", true);
      const right = Math.max(left + ratio, plot.valToPos(to, "x", true));
      const box = [left, bbox.top, right - left, bbox.height];
      c.fillStyle = c.strokeStyle = set === null ? themeColor("--ink-2") : this.#color(set);
      if (state === ACTIVE) {
        c.globalAlpha = 0.2;
        c.fillRect(...box);
      } else {
        c.globalAlpha = state === WAITING ? 0.6 : 0.35;
        c.lineWidth = ratio;
        stripes(c, box, (state === WAITING ? 5 : 9) * ratio);
      }
      c.globalAlpha = 1;
      const name = this.#model.sets[set]?.name;
      const label = set === null ? state : state === ACTIVE ? name : `waiting: ${name}`;
      paintBandLabel(c, label, Math.max(left, bbox.left), Math.min(right, bbox.left + bbox.width), bandTop, ratio, lines);
    }
    c.restore();
  }

  /** Draws the threshold, takeovers and detections as diamonds on it, and in a log the present. */
  #paintLines(plot, chart) {
    const { ctx: c, bbox } = plot;
    const line = (x1, y1, x2, y2, color, dash) => {
      c.strokeStyle = color;
      c.lineWidth = devicePixelRatio;
      c.setLineDash(dash);
      c.beginPath();
      c.moveTo(x1, y1);
      c.lineTo(x2, y2);
      c.stroke();
      c.setLineDash([]);
    };
    c.save();
    if (!this.#hasUtilities(chart)) {
      const y = plot.valToPos(this.#model.run.alliance.threshold, "y", true);
      line(bbox.left, y, bbox.left + bbox.width, y, themeColor("--ink"), [8, 4]);
    }
    const { events, names } = this.#model;
    c.fillStyle = themeColor("--select");
    c.font = `${13 * devicePixelRatio}px system-ui, sans-serif`;
    c.textAlign = "center";
    c.textBaseline = "middle";
    const [from, to] = this.#range();
    for (const { kind, robot, t_ms } of events) {
      const sign = { [TOOK_OVER]: "◆", [DETECTED]: "◇" }[kind];
      if (!sign || robot !== names[chart.rank] || t_ms < from || t_ms > to) continue;
      c.fillText(sign, plot.valToPos(t_ms / 1000, "x", true), plot.valToPos(this.#top(chart), "y", true));
    }
    const x = plot.valToPos(this.#model.now / 1000, "x", true);
    if (!this.#model.isLive) line(x, bbox.top, x, bbox.top + bbox.height, themeColor("--select"), []);
    c.restore();
  }
}

/** Labels a band that is wide enough, in the first free line of text. `lines` has the right ends of the used lines. */
function paintBandLabel(c, label, left, right, top, ratio, lines) {
  c.font = `${10 * ratio}px system-ui, sans-serif`;
  const width = c.measureText(label).width + 6 * ratio;
  if (width > right - left) return;
  const free = lines.findIndex((end) => end <= left);
  const line = free < 0 ? lines.length : free;
  lines[line] = left + width;
  c.fillStyle = themeColor("--ink");
  c.textAlign = "left";
  c.textBaseline = "top";
  c.fillText(label, left + 3 * ratio, top + 12 * ratio * line);
}

/** Draws diagonal stripes inside a box. */
function stripes(c, [x, y, width, height], step) {
  c.save();
  c.beginPath();
  c.rect(x, y, width, height);
  c.clip();
  c.beginPath();
  // The stripes start at fixed canvas positions, so they do not move while a band grows.
  for (let at = Math.floor((x - height) / step) * step; at < x + width; at += step) {
    c.moveTo(at, y + height);
    c.lineTo(at + height, y);
  }
  c.stroke();
  c.restore();
}

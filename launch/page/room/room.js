// The room from above: draws it to scale and finds the object under the pointer.

import { reception } from "../model/channel.js";
import { affectsLink, inForce, linkState } from "../model/faults.js";
import { TOOK_OVER } from "../model/events.js";
import { progress } from "../model/mission.js";
import { attribute, text } from "../ui/dom.js";
import { Lens, Projection, distanceToLine, isInside, isWithin, radioLines, sameRectangle } from "./geometry.js";
import * as paint from "./paint.js";

const MARGIN_PX = 10;
/** The time for which a takeover is written at its robot, ms of simulated time. */
const TAKEOVER_MS = 15_000;
/** The length of trails, ms of simulated time. */
const TRAIL_MS = 60_000;
/** Above this team size labels have the name only, and only where shown is space. */
const FULL_LABELS = 12;
/** Above this team size, without magnification, only lost and selected robots have a label and only the selected one a trail. */
const ALL_LABELS = 60;
/** The number of robots in the text alternative of the picture. */
const MAX_NAMED = 40;
/** Above this team size only the selected robot's radio lines are drawn. */
const ALL_LINES = 8;
/** The maximum distance of the pointer from a robot or line, px. */
const NEAR_PX = 7;

export class Room {
  /** The obstacle that is being drawn, or null. */
  draft = null;
  lens;
  /** Keeps the selected robot in the middle. */
  follows = false;

  #canvas;
  #model;
  #choices;
  #palette;
  #projection;
  #sides = new Map();
  #signs;
  #size = "";

  constructor(canvas, model, choices) {
    this.#canvas = canvas;
    this.#model = model;
    this.#choices = choices;
    this.#signs = signs(model.names);
    this.refreshPalette();
    this.lens = new Lens(model.run.scenario.room);
    this.#fit();
  }

  /** Reads the theme's colors again. */
  refreshPalette() {
    this.#palette = paint.readPalette(this.#model.run.colors.tasks);
  }

  /** Returns the canvas position of a point of the room in CSS pixels. */
  toScreen(x_m, y_m) {
    return { x: this.#projection.x(x_m), y: this.#projection.y(y_m) };
  }

  /** Returns the point of the room under a pointer event, m. */
  pointUnder(event) {
    const box = this.#canvas.getBoundingClientRect();
    return this.#projection.point(event.clientX - box.left, event.clientY - box.top);
  }

  /** Returns the object under the pointer: `{robot: rank}`, `{link: [from, to]}`, `{obstacle}` or null. */
  pick(event) {
    const { picture: view } = this.#model;
    if (!view) return null;
    const point = this.pointUnder(event);
    const reach_m = this.#model.run.scenario.body.radius_m + NEAR_PX / this.#projection.scale;
    const distance = ({ pose }) => Math.hypot(pose.position[0] - point.x, pose.position[1] - point.y);
    const near = view.robots
      .map((robot, rank) => ({ robot, rank }))
      .filter(({ robot }) => robot.state !== "absent" && distance(robot) <= reach_m);
    near.sort((a, b) => distance(a.robot) - distance(b.robot));
    if (near.length) return { robot: near[0].rank };

    const at = this.toScreen(point.x, point.y);
    const lines = this.#lines().map((line) => ({ line, px: distanceToLine(at, line.a, line.b) }));
    lines.sort((a, b) => a.px - b.px);
    if (lines.length && lines[0].px <= NEAR_PX) return { link: [lines[0].line.from, lines[0].line.to] };

    const obstacle = view.obstacles.findLast((each) => isInside(point, each));
    return obstacle ? { obstacle } : null;
  }

  /** Returns the number of the item on the floor under the pointer, or null. */
  itemUnder(event) {
    const point = this.pointUnder(event);
    const distance = ({ position, radius_m }) => Math.hypot(position[0] - point.x, position[1] - point.y) - radius_m;
    const lying = (this.#model.view?.items ?? []).map((item, number) => ({ item, number })).filter(({ item }) => item.carrier === null);
    const near = lying.filter(({ item }) => distance(item) <= NEAR_PX / this.#projection.scale);
    near.sort((a, b) => distance(a.item) - distance(b.item));
    return near[0]?.number ?? null;
  }

  /** Returns the mark under the pointer that has work, or null. */
  markUnder(event) {
    const point = this.pointUnder(event);
    return this.#model.view?.marks.findLast(({ work, outline }) => work && isWithin(point, outline)) ?? null;
  }

  /** Returns the fault in force that created the obstacle, if any. */
  faultBehind(obstacle) {
    return this.#model.view.faults.findLast(({ order, phase }) => {
      return phase === "in-force" && order.fault.obstacle && sameRectangle(order.fault.obstacle, obstacle);
    });
  }

  #lines() {
    const { radio, selected } = this.#choices;
    if (!radio || (this.#model.names.length > ALL_LINES && selected === null)) return [];
    return radioLines(this.#model.picture, this.#projection, selected);
  }

  #fit() {
    const { clientWidth: width, clientHeight: height } = this.#canvas.parentElement;
    const size = `${width}×${height}×${devicePixelRatio}`;
    this.#projection = new Projection(this.#model.run.scenario.room, width, height, MARGIN_PX, this.lens);
    if (size === this.#size) return;
    this.#size = size;
    this.#canvas.style.width = `${width}px`;
    this.#canvas.style.height = `${height}px`;
    this.#canvas.width = Math.round(width * devicePixelRatio);
    this.#canvas.height = Math.round(height * devicePixelRatio);
  }

  /** Tests whether the team is too large to draw every label and trail. */
  get #isCrowded() {
    return this.#model.names.length > ALL_LABELS && this.lens.zoom < 3;
  }

  draw() {
    const { picture: view, run } = this.#model;
    const followed = this.follows && this.#choices.selected !== null && view?.robots[this.#choices.selected];
    if (followed) this.lens.lookAt({ x: followed.pose.position[0], y: followed.pose.position[1] });
    this.#fit();
    const { scenario } = run;
    const c = this.#canvas.getContext("2d");
    const [p, palette, choices] = [this.#projection, this.#palette, this.#choices];
    c.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    c.fillStyle = palette.outside;
    c.fillRect(0, 0, this.#canvas.width, this.#canvas.height);
    paint.paintFloor(c, p, scenario.room, palette);
    if (view) {
      paint.paintMarks(c, p, view.marks, palette);
      for (const obstacle of view.obstacles) paint.paintObstacle(c, p, obstacle, this.faultBehind(obstacle)?.id ?? "", palette);
    }
    paint.paintBorder(c, p, scenario.room, palette);
    paint.paintScale(c, p, scenario.room, palette);
    if (!view) return;
    if (choices.trails) {
      const ranks = this.#model.names.map((_, rank) => rank);
      paint.paintTrails(c, p, this.#model, TRAIL_MS, this.#isCrowded ? ranks.filter((rank) => rank === choices.selected) : ranks);
    }
    paint.paintItems(c, p, view, scenario.body.radius_m, palette);
    if (choices.rays) {
      view.robots.forEach((robot, rank) => {
        const isWanted = choices.selected === null || choices.selected === rank;
        if (isWanted && (robot.state === "present" || robot.state === "silent")) paint.paintRays(c, p, robot, scenario, palette);
      });
    }
    this.#drawRadio(c);
    this.#drawRobots(c);
    if (this.draft) paint.paintDraft(c, p, this.draft, palette);
    this.#describe();
  }

  #drawRadio(c) {
    const { names, traffic, now, picture: view, run } = this.#model;
    const faults = inForce(view);
    for (const line of this.#lines()) {
      const [from, to] = [names[line.from], names[line.to]];
      const isDisturbed = faults.some((fault) => affectsLink(fault, from, to));
      const state = linkState(traffic.link(line.from, line.to, now), faults, from, to);
      const [at, there] = [line.from, line.to].map((rank) => view.robots[rank].pose.position);
      const expected = reception(run.scenario.radio, at, there, view.obstacles);
      paint.paintRadio(c, line, { ...state, expected }, isDisturbed, this.#palette);
    }
  }

  #drawRobots(c) {
    const { names, colors, picture: view, run } = this.#model;
    const { radius_m } = run.scenario.body;
    const shown = view.robots.map((robot, rank) => ({ robot, rank })).filter(({ robot }) => robot.state !== "absent");
    for (const { robot, rank } of shown) {
      const style = { radius_m, color: colors[rank], sign: this.#signs[rank], isSelected: rank === this.#choices.selected };
      paint.paintBody(c, this.#projection, robot, style, this.#palette);
    }
    // Labels must not cover bodies.
    const gap = Math.max(5, this.#projection.scale * radius_m) + 6;
    const taken = shown.map(({ robot }) => {
      const { x, y } = this.toScreen(...robot.pose.position);
      return { left: x - gap + 4, right: x + gap - 4, top: y - gap + 4, bottom: y + gap - 4 };
    });
    const labeled = shown.filter(({ robot, rank }) => !this.#isCrowded || robot.state !== "present" || rank === this.#choices.selected);
    for (const { robot, rank } of labeled) {
      const { x, y } = this.toScreen(...robot.pose.position);
      const mustShow = names.length <= FULL_LABELS || rank === this.#choices.selected;
      const label = { lines: this.#label(robot, rank), side: this.#sides.get(rank) ?? 0, mustShow };
      this.#sides.set(rank, paint.paintLabel(c, this.#projection, run.scenario.room, x, y, gap, label, taken, this.#palette));
    }
  }

  #label(robot, rank) {
    const { names } = this.#model;
    const lines = [robot.state === "present" ? names[rank] : `${names[rank]}: ${robot.state}`];
    const doing = this.#model.doingInWords(robot);
    if (doing && doing !== "idle" && (names.length <= FULL_LABELS || rank === this.#choices.selected)) lines.push(doing);
    const takeover = this.#model.recentTakeover(rank, TAKEOVER_MS);
    if (takeover?.kind === TOOK_OVER) lines.push(`◆ took over from ${takeover.reason}`);
    else if (takeover) lines.push(`◇ noticed the loss of ${takeover.reason}`);
    return lines;
  }

  /** Sets the text alternative of the picture. */
  #describe() {
    const { names, view, run } = this.#model;
    const current = progress(run.mission.columns, view.mission);
    const robots = view.robots.slice(0, MAX_NAMED).map((robot, rank) => {
      return `${names[rank]} ${robot.state === "present" ? this.#model.doingInWords(robot) : robot.state}`;
    });
    if (names.length > MAX_NAMED) robots.push(`and ${names.length - MAX_NAMED} more`);
    const done = current ? `; ${current.count} ${current.what}` : "";
    attribute(this.#canvas, "aria-label", `The room seen from above: ${robots.join(", ")}${done}`);
  }
}

/** Returns the signs on the robots: the number at the end of the name, or one or two initial letters. */
export function signs(names) {
  const initial = (name) => name[0].toUpperCase();
  return names.map((name) => {
    const isUnique = names.filter((each) => initial(each) === initial(name)).length === 1;
    return name.match(/\d{1,2}$/)?.[0] ?? (isUnique ? initial(name) : initial(name) + name.slice(1, 2));
  });
}

/** Shows the coordinates of a point of the room, or nothing. */
export function showPoint(output, point) {
  text(output, point ? `${point.x.toFixed(2)}, ${point.y.toFixed(2)} m` : "");
}

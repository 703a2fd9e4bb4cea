// The room from above: draws it to scale and finds the object under the pointer.

import { reception } from "../model/channel.js";
import { affectsLink, inForce, linkState } from "../model/faults.js";
import { TOOK_OVER } from "../model/events.js";
import { progress } from "../model/mission.js";
import { signs } from "../model/signs.js";
import { attribute, text } from "../ui/dom.js";
import { Lens, Projection, distanceToLine, isInside, isWithin, lowerLeft, radioLines, sameRectangle } from "./geometry.js";
import { CROWDED_PX, LEAST_PX, paintBody } from "./body.js";
import * as paint from "./paint.js";

const MARGIN_PX = 10;
/** The time for which a takeover is written at its robot, ms of simulated time. */
const TAKEOVER_MS = 15_000;
/** The length of trails, ms of simulated time. */
const TRAIL_MS = 60_000;
/** Above this team size labels have the name only. */
const FULL_LABELS = 12;
/** Above this team size, without magnification, only robots that stand out have a label, and only the selected one a trail. */
const ALL_LABELS = 60;
/**
 * The weights of robots' labels, least first. Known labels, those of the previous picture, and new ones give way to the labels
 * of marks. Takeovers and lost robots are named in any case, if need be over other bodies.
 */
const WEIGHTS = { pointed: 0, takeover: 1, lost: 2, detection: 3, known: 4, other: 5 };
/** The number of robots in the text alternative of the picture. */
const MAX_NAMED = 40;
/** Above this team size only the selected robot's radio lines are drawn. */
const ALL_LINES = 8;
/** The maximum distance of the pointer from a robot or line, px. */
const NEAR_PX = 7;
/** The step of the pointer of the arrow keys, px; with Shift ten times as far. */
const STEP_PX = 8;

export class Room {
  /** The obstacle that is being drawn, or null. */
  draft = null;
  lens;
  /** Keeps the selected robot in the middle. */
  follows = false;
  /** The rank of the robot under the pointer, or null. */
  hovered = null;
  /** The point of the room at which keys act, m, or null. */
  pointer = null;

  #canvas;
  #model;
  #choices;
  #palette;
  #projection;
  // The side of each robot's label in the previous picture.
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

  /** Moves the point of the keys in a direction and shows it. Returns its place in the window. */
  movePointer([dx, dy], isFar) {
    const { room } = this.#model.run.scenario;
    const [left, bottom] = lowerLeft(room);
    const step_m = ((isFar ? 10 : 1) * STEP_PX) / this.#projection.scale;
    this.pointer.x = Math.max(left, Math.min(left + room.width_m, this.pointer.x + dx * step_m));
    this.pointer.y = Math.max(bottom, Math.min(bottom + room.height_m, this.pointer.y + dy * step_m));
    const { x, y } = this.toScreen(this.pointer.x, this.pointer.y);
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (x < 0 || x > width || y < 0 || y > height) this.lens.lookAt(this.pointer);
    return this.underKeys();
  }

  /** Returns the place of the point of the keys in the window, as of a pointer event. */
  underKeys() {
    const box = this.#canvas.getBoundingClientRect();
    const { x, y } = this.toScreen(this.pointer.x, this.pointer.y);
    return { clientX: box.left + x, clientY: box.top + y };
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
    this.#projection = new Projection(this.#model.run.scenario.room, width, height, MARGIN_PX, this.lens, paint.SCALE_SPACE_PX);
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
    paint.paintScale(c, p, scenario.room, palette);
    if (this.draft) paint.paintDraft(c, p, this.draft, palette);
    if (this.pointer) paint.paintPointer(c, p, this.pointer, palette);
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

  /** Draws robots and all labels. As on a map, a name is written where it has space: the most important ones first. */
  #drawRobots(c) {
    const { colors, picture: view, run } = this.#model;
    const { room, body } = run.scenario;
    const [p, palette] = [this.#projection, this.#palette];
    const least_px = this.#isCrowded ? CROWDED_PX : LEAST_PX;
    const reach = Math.max(least_px, p.scale * body.radius_m) + 2;
    const shown = view.robots
      .map((robot, rank) => ({ robot, rank, ...this.toScreen(...robot.pose.position) }))
      .filter(({ robot }) => robot.state !== "absent");
    const bodies = shown.map(({ x, y }) => ({ left: x - reach, right: x + reach, top: y - reach, bottom: y + reach }));
    // Text is harder to read on marks and next to their labels.
    const covered = [...paint.markBoxes(c, p, view.marks), ...paint.findMarkLabels(c, p, room, view.marks).boxes];
    const taken = [];
    const find = (wanted) => {
      const labels = [];
      for (const { x, y, ...label } of wanted) {
        const place = (texts, ...boxes) => paint.findLabel(c, p, room, { x, y, gap: reach + 4 }, { ...label, texts }, ...boxes);
        const isCrucial = label.weight === WEIGHTS.takeover || label.weight === WEIGHTS.lost;
        const free = place(label.texts, [...bodies, ...taken], covered);
        const found = free ?? (isCrucial ? place(label.texts.slice(-1), taken, [...bodies, ...covered]) : null);
        if (!found) continue;
        labels.push(found);
        taken.push(found.box);
      }
      return labels;
    };
    const wanted = this.#wantedLabels(shown);
    const isUsual = ({ weight }) => weight >= WEIGHTS.known;
    const urgent = find(wanted.filter((label) => !isUsual(label)));
    const marks = paint.findMarkLabels(c, p, room, view.marks, taken);
    taken.push(...marks.boxes);
    paint.paintMarkLabels(c, marks.labels, palette);
    for (const { robot, rank } of shown) {
      const style = { radius_m: body.radius_m, least_px, color: colors[rank], sign: this.#signs[rank], isSelected: rank === this.#choices.selected };
      paintBody(c, p, robot, style, palette);
    }
    const labels = [...urgent, ...find(wanted.filter(isUsual))];
    for (const label of labels) paint.paintLabel(c, label, palette);
    this.#sides = new Map(labels.map(({ rank, side }) => [rank, side]));
  }

  /** Returns the wanted labels of robots, the most important first. In a crowd only robots that stand out have one. */
  #wantedLabels(shown) {
    const events = this.#model.recentTakeovers(TAKEOVER_MS);
    const labels = shown.map(({ robot, rank, x, y }) => {
      const isPointed = rank === this.#choices.selected || rank === this.hovered;
      const event = events.get(rank) ?? null;
      const side = this.#sides.get(rank) ?? null;
      const isLost = robot.state !== "present";
      const usual = event ? "detection" : side === null ? "other" : "known";
      const weight = isPointed ? "pointed" : event?.kind === TOOK_OVER ? "takeover" : isLost ? "lost" : usual;
      return { rank, x, y, texts: this.#texts(robot, rank, event, isPointed), side, mustShow: isPointed, weight: WEIGHTS[weight] };
    });
    return labels.filter(({ weight }) => !this.#isCrowded || weight < WEIGHTS.known).sort((a, b) => a.weight - b.weight);
  }

  /** Returns the lines of a robot's label, then the shorter ones for little space. A takeover has no text without it. */
  #texts(robot, rank, event, isPointed) {
    const { names } = this.#model;
    const name = robot.state === "present" ? names[rank] : `${names[rank]}: ${robot.state}`;
    const doing = names.length <= FULL_LABELS || isPointed ? this.#model.doingInWords(robot) : "";
    const tookOver = event?.kind === TOOK_OVER;
    const line = event && (tookOver ? `◆ took over from ${event.reason}` : `◇ noticed the loss of ${event.reason}`);
    const [full, short] = [[name, doing === "idle" ? "" : doing, line], [name, line]].map((lines) => lines.filter(Boolean));
    return tookOver ? [full, short] : [full, short, [name]];
  }

  /** Sets the text alternative of the picture. */
  #describe() {
    const { names, view, run } = this.#model;
    const current = progress(run.mission.columns, view.mission);
    const robots = view.robots.slice(0, MAX_NAMED).map((robot, rank) => {
      return `${names[rank]} ${robot.state === "present" ? this.#model.doingInWords(robot) : robot.state}`;
    });
    if (names.length > MAX_NAMED) robots.push(`and ${names.length - MAX_NAMED} more`);
    const done = current ? `; ${current.count}${current.share === null ? "," : ""} ${current.what}` : "";
    attribute(this.#canvas, "aria-label", `The room seen from above: ${robots.join(", ")}${done}`);
  }
}

/** Shows the coordinates of a point of the room, or nothing. */
export function showPoint(output, point) {
  text(output, point ? `${point.x.toFixed(2)}, ${point.y.toFixed(2)} m` : "");
}

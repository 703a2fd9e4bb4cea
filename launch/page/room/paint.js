// Draws the room on a canvas. Units are CSS pixels of the canvas; `p` is the projection from meters.

import { isDone, labelsOf, shareLeft } from "../model/marks.js";
import { trail } from "../model/trail.js";
import { kindColor, themeColor } from "../ui/colors.js";
import { percent } from "../ui/words.js";
import { lowerLeft } from "./geometry.js";
import { grown, overlaps, placeLabel } from "./labels.js";

/** An obstacle up to this penetrability is solid. */
const SOLID = 0.1;
export const FULL_TURN = 2 * Math.PI;

/** Reads the theme's colors. `tasks` are the colors of tasks and of kinds of marks. */
export function readPalette(tasks) {
  const names = [
    "floor",
    "outside",
    "ink",
    "ink-2",
    "line",
    "label",
    "item",
    "target",
    "target-full",
    "zone",
    "zone-full",
    "goal",
    "goal-full",
    "range",
    "range-full",
    "link",
    "link-full",
    "solid",
    "slow",
    "fast",
    "ray",
    "hit",
    "warn",
    "bad",
    "select",
  ];
  return { tasks, ...Object.fromEntries(names.map((name) => [name, themeColor(`--${name}`)])) };
}

export function paintFloor(c, p, room, palette) {
  c.fillStyle = palette.floor;
  const [left, bottom] = lowerLeft(room);
  c.fillRect(p.x(left), p.y(bottom + room.height_m), p.scale * room.width_m, p.scale * room.height_m);
}

/** Discs with work have at least this radius, px. */
const LEAST_DISC_PX = 3;
/** Discs below this radius, px, have no labels in a crowd. */
const SMALL_DISC_PX = 24;
/** Below this area of the room for each mark, px², only large marks have labels. */
const LABEL_AREA_PX2 = 4000;

/** Draws the mission's marks in the color of their kind or role, filled from below by the share of work left. */
export function paintMarks(c, p, marks, palette) {
  for (const mark of marks) {
    const { outline, role } = mark;
    const share = shareLeft(mark);
    const least_px = mark.work ? LEAST_DISC_PX : 0;
    const box = outlined(c, p, outline, least_px);
    const isOpen = role === "range" || box === null;
    const [light, full] = [palette[role], fullColor(mark, palette)];
    if (!isOpen) {
      c.fillStyle = light;
      c.fill();
      if (share > 0) {
        c.fillStyle = full;
        fillFromBelow(c, box, outline.disc, share);
        outlined(c, p, outline, least_px);
      }
    }
    c.strokeStyle = isOpen ? full : palette["ink-2"];
    const isGoalLine = box === null && role === "goal";
    c.lineWidth = isGoalLine ? 4 : isDone(mark) && !isSmall(p, mark) ? 2 : 1;
    c.setLineDash(role === "zone" || role === "range" ? [4, 4] : []);
    c.stroke();
    c.setLineDash([]);
  }
}

/** Fills a share of the current path from below. A clip is slow, and there may be hundreds of discs. */
function fillFromBelow(c, { left, bottom, width, height }, isDisc, share) {
  if (isDisc) {
    const level = Math.asin(1 - 2 * share);
    c.beginPath();
    c.arc(left + width / 2, bottom - height / 2, width / 2, level, FULL_TURN / 2 - level);
    c.fill();
    return;
  }
  c.save();
  c.clip();
  c.fillRect(left, bottom - share * height, width, share * height);
  c.restore();
}

/** Tests whether a mark is a small disc. */
function isSmall(p, { outline: { disc } }) {
  return disc && p.scale * disc.radius_m < SMALL_DISC_PX;
}

/** The least distance of two labels of marks, px. */
const LABEL_GAP_PX = 4;

/**
 * Finds the labels of marks, within the walls and outside the boxes `avoided`: `{labels, boxes}`. The boxes are those of the
 * labels, and of marks that no label may cover.
 */
export function findMarkLabels(c, p, room, marks, avoided = []) {
  const isCrowded = p.scale ** 2 * room.width_m * room.height_m < LABEL_AREA_PX2 * marks.length;
  // In a crowd a label must not cover small marks, either.
  const isLeftOut = (mark) => isCrowded && isSmall(p, mark);
  const boxes = marks.filter(isLeftOut).map(({ outline }) => discBox(p, outline.disc));
  const walls = visiblePart(c, p, room);
  const labels = [];
  for (const mark of marks) {
    if (isLeftOut(mark)) continue;
    const bold = isDone(mark);
    const { x, y, align } = labelPlace(p, mark.outline);
    const box = (label) => {
      const found = labelBox(c, label, x, y - 8, { bold, align });
      const isInside = x > walls.left && x < walls.right;
      const shift = isInside ? Math.max(walls.left + 2 - found.left, Math.min(0, walls.right - 2 - found.right)) : 0;
      return { ...found, left: found.left + shift, right: found.right + shift };
    };
    const isFree = (line) => ![...boxes, ...avoided].some((other) => overlaps(other, grown(box(line), LABEL_GAP_PX / 2)));
    const line = labelsOf(mark).find(isFree);
    if (!line) continue;
    boxes.push(box(line));
    labels.push({ line, x: box(line).left, y: y - 8, bold });
  }
  return { labels, boxes };
}

/** Draws the labels of marks. */
export function paintMarkLabels(c, labels, palette) {
  for (const { line, x, y, bold } of labels) {
    words(c, line, x, y, { color: bold ? palette.ink : palette["ink-2"], bold, align: "left", outline: palette.floor });
  }
}

/** Returns the boxes of the marks on the floor. Ranges are outlines around robots. */
export function markBoxes(c, p, marks) {
  const boxes = marks.filter(({ role }) => role !== "range").map(({ outline }) => outlined(c, p, outline));
  return boxes.filter(Boolean).map(({ left, bottom, width, height }) => ({ left, bottom, right: left + width, top: bottom - height }));
}

/** Returns the box of a disc in pixels. */
function discBox(p, { center, radius_m }) {
  const [x, y, radius] = [p.x(center[0]), p.y(center[1]), p.scale * radius_m];
  return { left: x - radius, right: x + radius, top: y - radius, bottom: y + radius };
}

/** Returns the box of the visible part of the room in pixels. */
function visiblePart(c, p, room) {
  const { clientWidth: width, clientHeight: height } = c.canvas;
  const [left, bottom] = lowerLeft(room);
  return {
    left: Math.max(0, p.x(left)),
    right: Math.min(width, p.x(left + room.width_m)),
    top: Math.max(0, p.y(bottom + room.height_m)),
    bottom: Math.min(height, p.y(bottom)),
  };
}

/** Returns the color of a mark's work that is left. */
function fullColor({ id, role }, palette) {
  return kindColor(id, palette.tasks) ?? palette[`${role}-full`] ?? palette[role];
}

/** Begins the path of an outline. Returns its bounding box in pixels, or null for a line. A disc has a least radius. */
export function outlined(c, p, outline, least_px = 0) {
  const [[kind, shape]] = Object.entries(outline);
  c.beginPath();
  if (kind === "disc") {
    const [x, y, radius] = [p.x(shape.center[0]), p.y(shape.center[1]), Math.max(least_px, p.scale * shape.radius_m)];
    c.arc(x, y, radius, 0, FULL_TURN);
    return { left: x - radius, bottom: y + radius, width: 2 * radius, height: 2 * radius };
  }
  if (kind === "rectangle") {
    const [left, bottom, right, top] = [p.x(shape.min[0]), p.y(shape.min[1]), p.x(shape.max[0]), p.y(shape.max[1])];
    c.rect(left, top, right - left, bottom - top);
    return { left, bottom, width: right - left, height: bottom - top };
  }
  const [from, to] = [shape.from, shape.to].map(([x, y]) => ({ x: p.x(x), y: p.y(y) }));
  if (kind === "line") {
    c.moveTo(from.x, from.y);
    c.lineTo(to.x, to.y);
    return null;
  }
  // A bar has half a circle at each end.
  const radius = p.scale * shape.half_width_m;
  const angle = Math.atan2(to.y - from.y, to.x - from.x);
  c.arc(to.x, to.y, radius, angle - FULL_TURN / 4, angle + FULL_TURN / 4);
  c.arc(from.x, from.y, radius, angle + FULL_TURN / 4, angle - FULL_TURN / 4);
  c.closePath();
  const [left, right] = [Math.min(from.x, to.x), Math.max(from.x, to.x)];
  const [top, bottom] = [Math.min(from.y, to.y), Math.max(from.y, to.y)];
  return { left: left - radius, bottom: bottom + radius, width: right - left + 2 * radius, height: bottom - top + 2 * radius };
}

/** Returns the label position of an outline: above shape, and left-aligned in a rectangle, which may touch a wall. */
function labelPlace(p, outline) {
  const [[kind, shape]] = Object.entries(outline);
  if (kind === "disc") return { x: p.x(shape.center[0]), y: p.y(shape.center[1] + shape.radius_m), align: "center" };
  if (kind === "rectangle") return { x: p.x(shape.min[0]) + 5, y: p.y(shape.max[1]), align: "left" };
  return { x: p.x((shape.from[0] + shape.to[0]) / 2), y: p.y((shape.from[1] + shape.to[1]) / 2), align: "center" };
}

export function paintBorder(c, p, room, palette) {
  c.strokeStyle = palette.ink;
  c.lineWidth = 3;
  const [left, bottom] = lowerLeft(room);
  c.strokeRect(p.x(left) - 1.5, p.y(bottom + room.height_m) - 1.5, p.scale * room.width_m + 3, p.scale * room.height_m + 3);
}

/** The least length of the scale bar, px. */
const SCALE_PX = 40;

/** Returns the shortest round length that is drawn at least SCALE_PX long, m: 1, 2 or 5 times a power of ten. */
function scaleLength(px_per_m) {
  const least = SCALE_PX / px_per_m;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((length) => length >= least * 0.999);
}

/** The height of the scale bar with its label, px, and the part of it that a picture reserves besides its margin. */
const SCALE_HEIGHT_PX = 16;
export const SCALE_SPACE_PX = 6;

/** Draws a scale bar at the lower right corner of the visible part of the room: below the wall, or inside without space. */
export function paintScale(c, p, room, palette) {
  const length_m = scaleLength(p.scale);
  const width = p.scale * length_m;
  const { right, bottom } = visiblePart(c, p, room);
  const isBelow = c.canvas.clientHeight - bottom >= SCALE_HEIGHT_PX;
  const [x, y] = isBelow ? [right - width, bottom + SCALE_HEIGHT_PX - 4] : [right - width - 12, bottom - 12];
  const outline = isBelow ? palette.outside : palette.floor;
  c.beginPath();
  c.moveTo(x, y - 4);
  c.lineTo(x, y);
  c.lineTo(x + width, y);
  c.lineTo(x + width, y - 4);
  for (const [color, line] of [[outline, 4], [palette["ink-2"], 1.5]]) {
    c.strokeStyle = color;
    c.lineWidth = line;
    c.stroke();
  }
  const label = `${Number(length_m.toPrecision(1))} m`;
  if (isBelow) words(c, label, x - 4, y - 2, { color: palette["ink-2"], outline, align: "right" });
  else words(c, label, x + width / 2, y - 8, { color: palette["ink-2"], outline });
}

/** Draws an obstacle or a patch. `label` is the id of the fault that created shape, or empty. */
export function paintObstacle(c, p, obstacle, label, palette) {
  const box = [p.x(obstacle.x_m), p.y(obstacle.y_m + obstacle.height_m), p.scale * obstacle.width_m, p.scale * obstacle.height_m];
  const { penetrability } = obstacle;
  const isSolid = penetrability <= SOLID;
  const kind = isSolid ? "solid" : penetrability < 1 ? "slow" : penetrability > 1 ? "fast" : "neutral";
  // A neutral obstacle is an outline on the floor.
  const color = palette[kind] ?? palette["ink-2"];
  c.save();
  c.beginPath();
  c.rect(...box);
  c.globalAlpha = isSolid ? 0.85 : kind === "neutral" ? 0.08 : 0.3;
  c.fillStyle = color;
  c.fill();
  c.globalAlpha = isSolid ? 0.5 : 0.7;
  c.clip();
  if (kind !== "neutral") hatch(c, box, kind, isSolid ? palette.floor : color);
  c.restore();
  c.strokeStyle = color;
  c.lineWidth = 1.5;
  c.setLineDash(label ? [5, 3] : []);
  c.strokeRect(...box);
  c.setLineDash([]);
  const note = isSolid ? label : [`${penetrability}×`, label].filter(Boolean).join(" ");
  if (note) badge(c, note, box[0] + box[2] / 2, box[1] + box[3] / 2, palette);
}

/** Fills a box with a pattern: strokes for solid, dots for slow, arrow heads for fast. */
function hatch(c, [x, y, width, height], kind, color) {
  c.strokeStyle = color;
  c.fillStyle = color;
  c.lineWidth = 1.5;
  c.beginPath();
  if (kind === "solid") {
    for (let at = -height; at < width; at += 8) {
      c.moveTo(x + at, y + height);
      c.lineTo(x + at + height, y);
    }
  } else {
    const step = kind === "slow" ? 7 : 14;
    for (let row = y + step / 2; row < y + height; row += step) {
      for (let column = x + step / 2; column < x + width; column += step) {
        if (kind === "slow") {
          c.moveTo(column + 1.2, row);
          c.arc(column, row, 1.2, 0, FULL_TURN);
        } else {
          c.moveTo(column - 3, row - 4);
          c.lineTo(column + 1, row);
          c.lineTo(column - 3, row + 4);
        }
      }
    }
  }
  c.stroke();
}

/** Below this radius of a body, px, items are small and have no edge. */
const SMALL_BODY_PX = 3;

/** Draws the items on the floor, and the carried ones in front of their carriers. */
export function paintItems(c, p, view, body_m, palette) {
  c.fillStyle = palette.item;
  c.strokeStyle = palette.ink;
  c.lineWidth = 0.8;
  c.beginPath();
  // In a large room the edges of items would be a black heap.
  const isLarge = p.scale * body_m < SMALL_BODY_PX;
  const least = isLarge ? 1 : 2.5;
  for (const { position, carrier, radius_m } of view.items) {
    const size = Math.max(least, p.scale * radius_m);
    const front_m = body_m + radius_m;
    const { pose } = carrier === null ? {} : view.robots[carrier];
    const x = p.x(pose ? pose.position[0] + front_m * Math.cos(pose.heading_rad) : position[0]);
    const y = p.y(pose ? pose.position[1] + front_m * Math.sin(pose.heading_rad) : position[1]);
    c.moveTo(x, y - size);
    c.lineTo(x + size, y);
    c.lineTo(x, y + size);
    c.lineTo(x - size, y);
    // Without closePath, which gets slower with a longer path.
    c.lineTo(x, y - size);
  }
  c.fill();
  if (!isLarge) c.stroke();
}

/** Draws the trails of robots over the last `span_ms`. */
export function paintTrails(c, p, model, span_ms, ranks) {
  const { view, now, run } = model;
  c.lineWidth = 2;
  c.globalAlpha = 0.8;
  for (const rank of ranks) {
    const path = new Path2D();
    for (const line of trail(model.history, rank, now - span_ms, now, run.scenario.body.radius_m, view.obstacles)) {
      path.moveTo(p.x(line[0][0]), p.y(line[0][1]));
      for (const [x, y] of line.slice(1)) path.lineTo(p.x(x), p.y(y));
    }
    c.strokeStyle = model.colors[rank];
    c.stroke(path);
  }
  c.globalAlpha = 1;
}

/** Draws the range readings: a free beam at full range, any other up to the hit. */
export function paintRays(c, p, robot, scenario, palette) {
  const { readings } = robot;
  if (!readings) return;
  const [x, y] = robot.pose.position;
  const heading = robot.pose.heading_rad;
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  const { radius_m: radius } = scenario.body;
  const { avoidance_range_m, border_range_m } = scenario.sensors;
  // Converts from the robot's frame (x ahead, y to the left) to the canvas.
  const at = (ahead, left) => [p.x(x + ahead * cos - left * sin), p.y(y + ahead * sin + left * cos)];
  const beam = (ahead, left, dx, dy, range, distance) => {
    const length = distance ?? range;
    const [endX, endY] = at(ahead + dx * length, left + dy * length);
    c.strokeStyle = distance === null ? palette.ray : palette.hit;
    c.lineWidth = distance === null ? 1 : 2;
    c.beginPath();
    c.moveTo(...at(ahead, left));
    c.lineTo(endX, endY);
    c.stroke();
    if (distance !== null) {
      c.fillStyle = palette.hit;
      c.fillRect(endX - 2.5, endY - 2.5, 5, 5);
    }
  };
  const { proximity } = readings;
  if (proximity) {
    [radius, 0, -radius].forEach((left, index) => {
      beam(radius, left, 1, 0, avoidance_range_m, proximity.ahead[index]?.distance_m ?? null);
    });
    [radius, 0, -radius].forEach((ahead, index) => {
      beam(ahead, radius, 0, 1, avoidance_range_m, proximity.left[index]?.distance_m ?? null);
      beam(ahead, -radius, 0, -1, avoidance_range_m, proximity.right[index]?.distance_m ?? null);
    });
  }
  c.setLineDash([6, 3]);
  if (readings.front_border !== null) beam(radius, 0, 1, 0, border_range_m, readings.front_border);
  if (readings.side_border !== null) beam(0, radius, 0, 1, border_range_m, readings.side_border);
  c.setLineDash([]);
  c.strokeStyle = palette.hit;
  c.lineWidth = 1;
  for (const [ahead, left] of robot.sensed) {
    c.beginPath();
    c.arc(...at(ahead, left), 6, 0, FULL_TURN);
    c.stroke();
  }
}

/**
 * Draws a radio line. `link` is `{count, loss, isCut, isHeld, expected}`. A line is fainter the fewer messages are `expected` to
 * arrive by the scenario. `isDisturbed`: a fault in force may affect it.
 */
export function paintRadio(c, { a, b }, { count, loss, isCut, isHeld, expected }, isDisturbed, palette) {
  c.strokeStyle = isCut ? palette.bad : loss > 0 || isDisturbed ? palette.warn : palette["ink-2"];
  c.globalAlpha = (count === 0 && !isDisturbed ? 0.35 : 0.85) * (0.2 + 0.8 * expected);
  c.lineWidth = loss > 0 || isDisturbed ? 2 : 1.2;
  c.setLineDash(isCut ? [2, 5] : loss > 0 || isDisturbed ? [8, 4] : []);
  c.beginPath();
  c.moveTo(a.x, a.y);
  c.lineTo(b.x, b.y);
  c.stroke();
  c.setLineDash([]);
  // The arrow head is at two thirds of the line, so that those of both directions do not overlap.
  const angle = Math.atan2(b.y - a.y, b.x - a.x);
  c.save();
  c.translate(a.x + (b.x - a.x) * 0.66, a.y + (b.y - a.y) * 0.66);
  c.rotate(angle);
  c.fillStyle = c.strokeStyle;
  c.beginPath();
  c.moveTo(5, 0);
  c.lineTo(-4, 4);
  c.lineTo(-4, -4);
  c.fill();
  c.restore();
  c.globalAlpha = 1;
  const sign = isCut ? "⊘ cut" : isHeld ? "◷ held" : `✗ ${percent(loss)}`;
  if (isCut || isHeld || loss > 0) badge(c, sign, a.x + (b.x - a.x) * 0.4, a.y + (b.y - a.y) * 0.4, palette);
}

/** The size of labels, px. */
const LABEL_PX = 11;

/**
 * Finds the place of a robot's label: see placeLabel. `texts` are the wanted lines and the shorter ones that may replace
 * them. Returns the label with its `lines`, `side` and `box`, or null.
 */
export function findLabel(c, p, room, at, label, taken, covered) {
  const sizes = label.texts.map((lines) => ({
    width: Math.max(...lines.map((line, index) => measure(c, line, LABEL_PX, index === 0))) + 6,
    height: lines.length * (LABEL_PX + 2) + 2,
  }));
  // Text across a wall is illegible.
  const place = placeLabel(sizes, at, label, visiblePart(c, p, room), taken, covered);
  return place && { ...label, ...place, lines: label.texts[place.index] };
}

/** Draws a robot's label at its place. */
export function paintLabel(c, { lines, box: { left, top, right, bottom }, mustShow }, palette) {
  if (mustShow) {
    c.fillStyle = palette.label;
    c.beginPath();
    c.roundRect(left, top, right - left, bottom - top, 3);
    c.fill();
  }
  // An outline of the letters hides less than a plate.
  lines.forEach((line, index) => {
    const style = { color: palette.ink, bold: index === 0, size: LABEL_PX, outline: palette.floor };
    words(c, line, (left + right) / 2, top + 2 + (LABEL_PX + 2) * (index + 0.5), style);
  });
}

/** Draws the rectangle in progress, with its size. */
export function paintDraft(c, p, draft, palette) {
  paintObstacle(c, p, draft, "", palette);
  const label = `${draft.width_m} × ${draft.height_m} m`;
  badge(c, label, p.x(draft.x_m + draft.width_m / 2), p.y(draft.y_m + draft.height_m) - 10, palette);
}

/** Draws the pointer of the arrow keys at a point of the room, m. */
export function paintPointer(c, p, { x, y }, palette) {
  c.strokeStyle = palette.select;
  c.lineWidth = 2;
  c.beginPath();
  c.moveTo(p.x(x) - 12, p.y(y));
  c.lineTo(p.x(x) + 12, p.y(y));
  c.moveTo(p.x(x), p.y(y) - 12);
  c.lineTo(p.x(x), p.y(y) + 12);
  c.stroke();
}

/** The widths of lines by font and text, because hundreds of names are measured for each picture. */
const widths = new Map();

function measure(c, line, size, bold) {
  const key = `${font(size, bold)} ${line}`;
  if (!widths.has(key)) {
    if (widths.size > 10_000) widths.clear();
    c.font = font(size, bold);
    widths.set(key, c.measureText(line).width);
  }
  return widths.get(key);
}

const font = (size, bold) => `${bold ? "600 " : ""}${size}px system-ui, sans-serif`;

export function words(c, line, x, y, { color, bold = false, size = 11, outline = null, align = "center" }) {
  c.font = font(size, bold);
  c.textAlign = align;
  c.textBaseline = "middle";
  if (outline) {
    c.strokeStyle = outline;
    c.lineWidth = 2.5;
    c.lineJoin = "round";
    c.strokeText(line, x, y);
  }
  c.fillStyle = color;
  c.fillText(line, x, y);
}

/** Returns the extent of a line of text. */
function labelBox(c, line, x, y, { bold, align }) {
  const width = measure(c, line, 11, bold);
  const left = align === "left" ? x : x - width / 2;
  return { left, right: left + width, top: y - 7, bottom: y + 7 };
}

function badge(c, line, x, y, palette) {
  const width = measure(c, line, 11, false) + 8;
  c.fillStyle = palette.label;
  c.beginPath();
  c.roundRect(x - width / 2, y - 8, width, 16, 3);
  c.fill();
  words(c, line, x, y, { color: palette.ink });
}

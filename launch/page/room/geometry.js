// Geometry of the room in m and of the canvas in CSS pixels.

/** The largest magnification of a room up to 1,000 m. */
const MAX_ZOOM = 40;
/** The least extent of the visible part of a larger room, m. */
const LEAST_SHOWN_M = 25;
/** The least scale, px per m, while the canvas has no size. */
const LEAST_SCALE = 1e-4;

/** The directions of the arrow keys in the room. */
export const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** Returns the coordinates of the lower left corner of the room, m. A scenario omits those that are 0. */
export function lowerLeft({ x_m = 0, y_m = 0 }) {
  return [x_m, y_m];
}

/** The visible part of the room: a magnification and a center. */
export class Lens {
  zoom = 1;
  /** The point of the room in the middle of the canvas, m. */
  center;
  #room;

  constructor(room) {
    this.#room = room;
    this.reset();
  }

  /** Shows the whole room. */
  reset() {
    this.zoom = 1;
    const [x, y] = lowerLeft(this.#room);
    this.center = { x: x + this.#room.width_m / 2, y: y + this.#room.height_m / 2 };
  }

  /** Magnifies by a factor. `point` of the room, m, keeps its place on the canvas. */
  magnify(factor, point) {
    const most = Math.max(MAX_ZOOM, Math.max(this.#room.width_m, this.#room.height_m) / LEAST_SHOWN_M);
    const zoom = Math.max(1, Math.min(most, this.zoom * factor));
    if (zoom === 1) return this.reset();
    const share = this.zoom / zoom;
    this.zoom = zoom;
    this.lookAt({ x: point.x + (this.center.x - point.x) * share, y: point.y + (this.center.y - point.y) * share });
  }

  /** Moves a point of the room, m, to the middle. */
  lookAt({ x, y }) {
    const [left, bottom] = lowerLeft(this.#room);
    const within = (value, from, size) => Math.max(from, Math.min(from + size, value));
    this.center = { x: within(x, left, this.#room.width_m), y: within(y, bottom, this.#room.height_m) };
  }
}

/**
 * Projection of the room onto a canvas, to scale, with a margin, through a lens. Above and below the room, `space_px` is
 * added to the margin.
 */
export class Projection {
  constructor(room, width_px, height_px, margin_px, lens, space_px = 0) {
    const high_px = height_px - 2 * (margin_px + space_px);
    const all = Math.max(LEAST_SCALE, Math.min((width_px - 2 * margin_px) / room.width_m, high_px / room.height_m));
    this.scale = all * lens.zoom;
    this.left = width_px / 2 - this.scale * lens.center.x;
    this.bottom = height_px / 2 + this.scale * lens.center.y;
  }

  x(m) {
    return this.left + this.scale * m;
  }

  y(m) {
    return this.bottom - this.scale * m;
  }

  /** Returns the point of the room under a point of the canvas, m. */
  point(x_px, y_px) {
    return { x: (x_px - this.left) / this.scale, y: (this.bottom - y_px) / this.scale };
  }
}

/** Returns the distance of a point from the line segment between `a` and `b`. */
export function distanceToLine(point, a, b) {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const length = dx * dx + dy * dy;
  const share = length === 0 ? 0 : Math.max(0, Math.min(1, ((point.x - a.x) * dx + (point.y - a.y) * dy) / length));
  return Math.hypot(point.x - a.x - share * dx, point.y - a.y - share * dy);
}

/** Tests whether two obstacles are the same rectangle. The world returns coordinates in single precision. */
export function sameRectangle(a, b) {
  return ["x_m", "y_m", "width_m", "height_m"].every((key) => Math.abs(a[key] - b[key]) < 1e-3);
}

/** Tests whether a point, m, lies in an obstacle. */
export function isInside({ x, y }, obstacle) {
  return x >= obstacle.x_m && x <= obstacle.x_m + obstacle.width_m && y >= obstacle.y_m && y <= obstacle.y_m + obstacle.height_m;
}

/** Tests whether a point, m, lies in the outline of a mark. A line has no inside. */
export function isWithin(point, { disc, rectangle, bar }) {
  if (disc) return Math.hypot(point.x - disc.center[0], point.y - disc.center[1]) <= disc.radius_m;
  if (rectangle) {
    const [x, y] = [point.x, point.y];
    return x >= rectangle.min[0] && x <= rectangle.max[0] && y >= rectangle.min[1] && y <= rectangle.max[1];
  }
  if (!bar) return false;
  const [from, to] = [bar.from, bar.to].map(([x, y]) => ({ x, y }));
  return distanceToLine(point, from, to) <= bar.half_width_m;
}

/**
 * Returns the radio lines on the canvas between robots in the mission. The two directions of a link run side by side.
 * With a rank, only that robot's lines are returned.
 */
export function radioLines(view, projection, selected) {
  const shown = view.robots
    .map(({ state, pose }, rank) => ({ state, rank, x: projection.x(pose.position[0]), y: projection.y(pose.position[1]) }))
    .filter(({ state }) => state !== "absent");
  const lines = [];
  for (const from of shown) {
    for (const to of shown) {
      if (from === to || (selected !== null && from.rank !== selected && to.rank !== selected)) continue;
      const length = Math.hypot(to.x - from.x, to.y - from.y) || 1;
      const [right, down] = [(-5 * (to.y - from.y)) / length, (5 * (to.x - from.x)) / length];
      lines.push({
        from: from.rank,
        to: to.rank,
        a: { x: from.x + right, y: from.y + down },
        b: { x: to.x + right, y: to.y + down },
      });
    }
  }
  return lines;
}

// Curves of the motivations, as corners. A curve is a straight line between two corners, but a fall is a step. The
// world sends every corner, so a curve is exact at any rate of views.

export const HIBERNATING = "Hibernating";
export const WAITING = "Waiting";
export const ACTIVE = "Active";

/** The maximum number of corners of a curve. A live run drops the oldest half above it. */
const MAX_CORNERS = 20_000;

export class Curves {
  /**
   * Corners by time, by rank · sets + set. A corner with `last` ends the curve.
   * @type {Map<number, import("../../page-tests/types.js").Corner[]>}
   */
  #cells = new Map();
  #sets;

  constructor(sets) {
    this.#sets = sets;
  }

  /**
   * Adds corners, ordered by time for each robot. Times are in ms.
   * @param {import("../../page-tests/types.js").Corner[]} corners
   */
  add(corners) {
    for (const corner of corners) {
      const cell = corner.robot * this.#sets + corner.set;
      const known = this.#cells.get(cell);
      if (!known) this.#cells.set(cell, [corner]);
      else if (known.push(corner) > MAX_CORNERS) known.splice(0, MAX_CORNERS / 2);
    }
  }

  /** Returns the sets with a curve of the robot, in ascending order. */
  setsOf(rank) {
    const sets = Array.from({ length: this.#sets }, (_, set) => set);
    return sets.filter((set) => this.#cells.has(rank * this.#sets + set));
  }

  /** Returns the corners of a set of a robot. */
  of(rank, set) {
    return this.#cells.get(rank * this.#sets + set) ?? [];
  }
}

/**
 * Returns the value of a curve at `t` as `{before, level, state}`, or null without a curve. `before` differs from
 * `level` at a step.
 */
export function levelAt(corners, t) {
  const next = firstAfter(corners, t);
  const here = corners[next - 1];
  if (!here) return null;
  if (here.at < t) return here.last || next === corners.length ? null : { ...between(here, corners[next], t), state: here.state };
  // Several corners may have the same time.
  const previous = corners[firstAfter(corners, t - 1) - 1];
  const falls = previous && !previous.last && previous.level > here.level;
  return { before: falls ? previous.level : here.level, level: here.level, state: here.state };
}

function between(a, b, t) {
  const level = b.level < a.level ? a.level : a.level + ((t - a.at) / (b.at - a.at)) * (b.level - a.level);
  return { before: level, level };
}

/** Returns the index of the first corner after `t`. */
export function firstAfter(corners, t) {
  let low = 0;
  let high = corners.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (corners[middle].at <= t) low = middle + 1;
    else high = middle;
  }
  return low;
}

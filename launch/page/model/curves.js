// The curves of the motivations by their corners, as the world tells them: between two corners a curve is a straight line, but
// where it falls it is a step. So a curve is exact, however seldom the page gets a view.

/** States of a behavior set, as a corner has them. */
export const HIBERNATING = "Hibernating";
export const WAITING = "Waiting";
export const ACTIVE = "Active";

/** Corners of one curve that are remembered of a live run. */
const MOST = 20_000;

export class Curves {
  /**
   * rank · sets + set → corners by time; `last`: the curve ends there.
   * @type {Map<number, import("../../page-tests/types.js").Bend[]>}
   */
  #cells = new Map();
  #sets;

  constructor(sets) {
    this.#sets = sets;
  }

  /**
   * Takes in corners, by time for each robot; times in ms.
   * @param {import("../../page-tests/types.js").Bend[]} bends
   */
  add(bends) {
    for (const bend of bends) {
      const cell = bend.robot * this.#sets + bend.set;
      const corners = this.#cells.get(cell);
      if (!corners) this.#cells.set(cell, [bend]);
      else if (corners.push(bend) > MOST) corners.splice(0, MOST / 2);
    }
  }

  /** The sets of which that robot has a curve, in order. */
  setsOf(rank) {
    const sets = Array.from({ length: this.#sets }, (_, set) => set);
    return sets.filter((set) => this.#cells.has(rank * this.#sets + set));
  }

  /** The corners of that set of that robot. */
  of(rank, set) {
    return this.#cells.get(rank * this.#sets + set) ?? [];
  }
}

/**
 * What a curve is at `t`: `{before, level, state}`; `before` is the level until then, another one where the curve makes a step.
 * Null where there is no curve.
 */
export function levelAt(corners, t) {
  const next = firstAfter(corners, t);
  const here = corners[next - 1];
  if (!here) return null;
  if (here.at < t) return here.last || next === corners.length ? null : { ...between(here, corners[next], t), state: here.state };
  // More than one corner may lie at that time.
  const previous = corners[firstAfter(corners, t - 1) - 1];
  const falls = previous && !previous.last && previous.level > here.level;
  return { before: falls ? previous.level : here.level, level: here.level, state: here.state };
}

function between(a, b, t) {
  const level = b.level < a.level ? a.level : a.level + ((t - a.at) / (b.at - a.at)) * (b.level - a.level);
  return { before: level, level };
}

/** Place of the first corner after `t`. */
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

// The data of one robot's chart, from its curves: motivations as columns, states as bands.

import { HIBERNATING, firstAfter, levelAt } from "./curves.js";

/** The number of positions in a chart where the pointer can read a value. */
const POSITIONS = 600;

/**
 * Returns the motivations and states of a robot from `from` to `to`, ms. `curves` contains corners by behavior set. Of
 * the history's `samples` only the agents' states are used. `columns` has the times in seconds, then one column per
 * behavior set, with null where the robot has no such set or is absent. A step has two rows with the same time. Each
 * curve's lowest and highest point at each position are kept. `bands` has `{set, state, from, to}` in seconds where a
 * set is waiting or active. A band with a null set is a time in which the robot was not present, with its state.
 */
export function levels(curves, samples, rank, from, to) {
  const bands = curves.flatMap((corners, set) => stateBands(corners, set, from, to));
  bands.push(...absences(samples, rank, from, to));
  return { columns: columns(curves, from, to), bands };
}

function columns(curves, from, to) {
  const grain_ms = Math.max(1, (to - from) / POSITIONS);
  const rows = [];
  for (const t of times(curves, from, to, grain_ms)) {
    const all = curves.map((corners) => levelAt(corners, t));
    if (all.some((each) => each && each.before !== each.level)) rows.push([t / 1000, ...all.map((each) => each?.before ?? null)]);
    rows.push([t / 1000, ...all.map((each) => each?.level ?? null)]);
  }
  const kept = thin(rows, grain_ms / 1000);
  return Array.from({ length: curves.length + 1 }, (_, column) => kept.map((row) => row[column]));
}

/** Returns the times of all corners, the times right after all ends, and the positions between. */
function times(curves, from, to, grain_ms) {
  const found = new Set([from, to]);
  for (const corners of curves) {
    for (let index = firstAfter(corners, from - 1); index < corners.length && corners[index].at <= to; index += 1) {
      found.add(corners[index].at);
      if (corners[index].last) found.add(corners[index].at + 1);
    }
  }
  for (let position = 0; position <= POSITIONS; position += 1) found.add(Math.round(from + position * grain_ms));
  return [...found].filter((t) => t >= from && t <= to).sort((a, b) => a - b);
}

/** Reduces the rows of each position to the first, the last, and each column's lowest, highest and empty one. */
function thin(rows, grain) {
  const kept = [];
  let begin = 0;
  while (begin < rows.length) {
    const group = Math.floor(rows[begin][0] / grain);
    let end = begin + 1;
    while (end < rows.length && Math.floor(rows[end][0] / grain) === group) end += 1;
    const chosen = new Set([begin, end - 1]);
    for (let column = 1; end - begin > 2 && column < rows[begin].length; column += 1) {
      for (const row of extremes(rows, column, begin, end)) chosen.add(row);
    }
    kept.push(...[...chosen].sort((a, b) => a - b).map((row) => rows[row]));
    begin = end;
  }
  return kept;
}

function extremes(rows, column, begin, end) {
  let [low, high, gap] = [null, null, null];
  for (let row = begin; row < end; row += 1) {
    const level = rows[row][column];
    if (level === null) gap ??= row;
    else {
      if (low === null || level < rows[low][column]) low = row;
      // The last of equal values, so that a step down is vertical.
      if (high === null || level >= rows[high][column]) high = row;
    }
  }
  return [low, high, gap].filter((row) => row !== null);
}

function stateBands(corners, set, from, to) {
  const bands = [];
  let open = null;
  // Starts with the corner before the window.
  for (let index = Math.max(0, firstAfter(corners, from) - 1); index < corners.length; index += 1) {
    const { at, state, last } = corners[index];
    if (open) open.to = Math.min(at, to) / 1000;
    if (at > to) break;
    if (state !== open?.state) {
      const isShown = state !== HIBERNATING && !last;
      open = isShown ? { set, state, from: Math.max(at, from) / 1000, to: Math.max(at, from) / 1000 } : null;
      if (open) bands.push(open);
    }
    if (last) open = null;
  }
  return bands;
}

function absences(samples, rank, from, to) {
  const bands = [];
  let open = null;
  for (const { t, agents } of samples) {
    if (open) open.to = Math.min(t, to) / 1000;
    const state = agents[rank] === "present" ? null : agents[rank];
    if (state !== (open?.state ?? null)) {
      open = state === null || t > to ? null : { set: null, state, from: Math.max(t, from) / 1000, to: Math.max(t, from) / 1000 };
      if (open) bands.push(open);
    }
  }
  return bands.filter((band) => band.to >= from / 1000);
}

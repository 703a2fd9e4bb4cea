// Cuts from the curves what a chart of one robot shows: motivations as columns, states as bands.

import { HIBERNATING, firstAfter, levelAt } from "./curves.js";

/** Places of a chart at which a pointer can read a value; no screen shows more of them. */
const PLACES = 600;

/**
 * Motivations and states of a robot from `from` to `to`, ms. `curves`: corners by behavior set. `samples`: those of the history,
 * of which only the states of the robot's agent count.
 *
 * `columns`: first the times in seconds, then one column per behavior set, null where the robot has no such set or does not take
 * part; where a curve makes a step, its time stands there twice. However many corners there are, each curve's lowest and highest
 * point of each place stay. `bands`: `{set, state, from, to}`, in seconds, where a set waits or is active; with set null where the
 * robot is not present, `state` then being its own.
 */
export function levels(curves, samples, rank, from, to) {
  const bands = curves.flatMap((corners, set) => stateBands(corners, set, from, to));
  bands.push(...absences(samples, rank, from, to));
  return { columns: columns(curves, from, to), bands };
}

function columns(curves, from, to) {
  const grain_ms = Math.max(1, (to - from) / PLACES);
  const rows = [];
  for (const t of times(curves, from, to, grain_ms)) {
    const all = curves.map((corners) => levelAt(corners, t));
    if (all.some((each) => each && each.before !== each.level)) rows.push([t / 1000, ...all.map((each) => each?.before ?? null)]);
    rows.push([t / 1000, ...all.map((each) => each?.level ?? null)]);
  }
  const kept = thin(rows, grain_ms / 1000);
  return Array.from({ length: curves.length + 1 }, (_, column) => kept.map((row) => row[column]));
}

/** All corners, right after all ends, and the places between. */
function times(curves, from, to, grain_ms) {
  const found = new Set([from, to]);
  for (const corners of curves) {
    for (let index = firstAfter(corners, from - 1); index < corners.length && corners[index].at <= to; index += 1) {
      found.add(corners[index].at);
      if (corners[index].last) found.add(corners[index].at + 1);
    }
  }
  for (let place = 0; place <= PLACES; place += 1) found.add(Math.round(from + place * grain_ms));
  return [...found].filter((t) => t >= from && t <= to).sort((a, b) => a - b);
}

/** Of all rows in one grain: the first and last, and of each column its lowest, its highest and its gaps. */
function thin(rows, grain) {
  const kept = [];
  let begin = 0;
  while (begin < rows.length) {
    const group = Math.floor(rows[begin][0] / grain);
    let end = begin + 1;
    while (end < rows.length && Math.floor(rows[end][0] / grain) === group) end += 1;
    const places = new Set([begin, end - 1]);
    for (let column = 1; end - begin > 2 && column < rows[begin].length; column += 1) {
      for (const place of extremes(rows, column, begin, end)) places.add(place);
    }
    kept.push(...[...places].sort((a, b) => a - b).map((place) => rows[place]));
    begin = end;
  }
  return kept;
}

function extremes(rows, column, begin, end) {
  let [low, high, gap] = [null, null, null];
  for (let place = begin; place < end; place += 1) {
    const level = rows[place][column];
    if (level === null) gap ??= place;
    else {
      if (low === null || level < rows[low][column]) low = place;
      // The last of equals: a step down is upright.
      if (high === null || level >= rows[high][column]) high = place;
    }
  }
  return [low, high, gap].filter((place) => place !== null);
}

function stateBands(corners, set, from, to) {
  const bands = [];
  let open = null;
  // From the one before the window on.
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

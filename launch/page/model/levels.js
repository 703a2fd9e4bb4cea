// Cuts from the history what a chart of one robot shows: motivations as columns, states as bands.

import { HIBERNATING, NONE } from "./history.js";

/** Points of a line at most; no screen shows more of them. */
const POINTS = 600;

/**
 * Motivations and states of a robot from `from` to `to`, ms.
 *
 * `columns`: first the times in seconds, then one column per behavior set, null where the robot has no such set or does not take
 * part. `bands`: `{set, state, from, to}`, in seconds, where a set waits or is active; with set null where the robot is not
 * present, `state` then being its own.
 */
export function levels(history, sets, rank, from, to) {
  const { samples } = history;
  const columns = Array.from({ length: sets + 1 }, () => []);
  const bands = [];
  const open = new Array(sets + 1).fill(null);
  const grain_ms = Math.max(1, (to - from) / POINTS);
  let grain = -1;
  let before = -Infinity;
  // One more to the left, so that lines begin at the edge.
  for (let index = Math.max(0, history.indexAt(from) - 1); index < samples.length && samples[index].t <= to; index += 1) {
    const { t, levels: all, states, since, agents } = samples[index];
    const isPresent = agents[rank] === "present";
    band(bands, open, sets, isPresent ? null : agents[rank], t, t, { set: null });
    // A state has been so since before it was sampled, but not since before the last sample in which it was another.
    for (let set = 0; set < sets; set += 1) {
      const cell = rank * sets + set;
      const state = isPresent && states[cell] !== HIBERNATING && states[cell] !== NONE ? states[cell] : null;
      band(bands, open, set, state, Math.min(t, Math.max(before, since[cell])), t, { set });
    }
    before = t;
    const isNewest = index === samples.length - 1 || samples[index + 1].t > to;
    if (Math.floor(t / grain_ms) === grain && !isNewest) continue;
    grain = Math.floor(t / grain_ms);
    columns[0].push(t / 1000);
    for (let set = 0; set < sets; set += 1) {
      const level = all[rank * sets + set];
      columns[set + 1].push(isPresent && !Number.isNaN(level) ? level : null);
    }
  }
  return { columns, bands };
}

/** Goes on with the band in that lane, ends it or begins another at `begun`, ms. */
function band(bands, open, lane, state, begun, t, what) {
  const current = open[lane];
  if (current) current.to = t / 1000;
  if (state === (current?.state ?? null)) return;
  open[lane] = null;
  if (state === null) return;
  open[lane] = { ...what, state, from: begun / 1000, to: t / 1000 };
  bands.push(open[lane]);
}

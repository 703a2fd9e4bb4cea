// Faults: whom they touch, and what the log says of those that are over.

import { faultInWords, termsInWords } from "../ui/words.js";

/** What happens in a moment can neither last nor be undone. */
const MOMENTARY = new Set(["continue", "restart", "waste", "move-waste", "move-robot"]);

export function isMomentary(fault) {
  return MOMENTARY.has(Object.keys(fault)[0]);
}

/** Whether the fault befalls that robot as a whole: its process, its devices, its radio. */
export function concernsRobot(fault, name) {
  const [it] = Object.values(fault);
  return it === name || it.robot === name;
}

const meets = (end, name) => (end ?? "all") === "all" || end === name;

/** Whether the fault may change what `to` hears of `from`. */
export function touchesLink(fault, from, to) {
  const [[kind, it]] = Object.entries(fault);
  switch (kind) {
    case "drop":
    case "delay":
    case "duplicate":
    case "reorder":
    case "hold":
      return meets(it.from, from) && meets(it.to, to);
    case "mute":
      return it === from;
    case "deaf":
      return it === to;
    case "range":
    case "radio":
      return true;
    case "partition": {
      const group = (name) => it.groups.findIndex((each) => each.includes(name));
      const [speaker, hearer] = [group(from), group(to)];
      if (speaker < 0 || hearer < 0 || speaker === hearer) return false;
      return !it.one_way || speaker > hearer;
    }
    default:
      return false;
  }
}

const PHASES = { armed: "armed", applied: "in-force", healed: "over", disarmed: "over", failed: "over" };

/**
 * All faults up to now, latest first: `{id, words, terms, phase, applied_ms, healed_ms, hits, order}`. Those that are armed or in
 * force come from the view; those that are over have left it and are told by the events. Events know the time of effect of
 * both.
 */
export function faultRows(view, events) {
  const rows = new Map();
  for (const event of events) {
    const phase = PHASES[event.kind];
    if (!phase) continue;
    const row = rows.get(event.subject) ?? { id: event.subject, terms: "", applied_ms: null, healed_ms: null, hits: null, order: null };
    rows.set(event.subject, row);
    row.words = event.detail;
    row.phase = phase;
    if (event.kind === "applied") row.applied_ms = event.t_ms;
    if (phase === "over") row.healed_ms = event.t_ms;
  }
  for (const { id, order, phase, applied_ms, hits } of view.faults) {
    const row = rows.get(id) ?? { id, healed_ms: null };
    rows.set(id, row);
    Object.assign(row, { order, phase, hits, words: faultInWords(order.fault), terms: termsInWords(order) });
    row.applied_ms = applied_ms ?? row.applied_ms ?? null;
  }
  return [...rows.values()].reverse();
}

// Faults: whom they touch, and what the log says of those that are over.

import { faultInWords, termsInWords } from "../ui/words.js";

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

const TELLING = new Set(["armed", "applied", "healed", "disarmed", "failed"]);

/**
 * All faults up to now, latest first: `{id, words, terms, phase, applied_ms, healed_ms, hits, failed}`. Those that are armed or in force
 * stand in the view; what else the events tell of is over.
 * @param {import("../../page-tests/types.js").View} view
 */
export function faultRows(view, events) {
  const rows = new Map();
  for (const event of events) {
    if (!TELLING.has(event.kind)) continue;
    const row = rows.get(event.subject) ?? {
      id: event.subject,
      terms: "",
      phase: "over",
      applied_ms: null,
      healed_ms: null,
      hits: null,
    };
    rows.set(event.subject, row);
    row.words = event.detail;
    if (event.kind === "applied") row.applied_ms = event.t_ms;
    if (event.kind === "healed") row.healed_ms = event.t_ms;
  }
  for (const { id, order, phase, applied_ms, hits, failed } of view.faults) {
    const row = rows.get(id) ?? { id, healed_ms: null };
    rows.set(id, row);
    Object.assign(row, { phase, hits, failed, words: faultInWords(order.fault), terms: termsInWords(order) });
    row.applied_ms = applied_ms ?? row.applied_ms ?? null;
  }
  return [...rows.values()].reverse();
}

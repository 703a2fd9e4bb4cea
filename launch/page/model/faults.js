// The robots and links that a fault affects, and the list of faults of a run.

import { cutsInWords, faultInWords, termsInWords } from "../ui/words.js";

/** Tests whether the fault affects the robot itself: its process, its devices or its radio. */
export function affectsRobot(fault, name) {
  const [value] = Object.values(fault);
  return value === name || value.robot === name;
}

const matches = (end, name) => (end ?? "all") === "all" || end === name;

/** Tests whether the fault may change the messages that `to` receives from `from`. */
export function affectsLink(fault, from, to) {
  const [[kind, value]] = Object.entries(fault);
  switch (kind) {
    case "mute":
      return value === from;
    case "deaf":
      return value === to;
    case "range":
    case "radio":
      return true;
    case "partition": {
      const group = (name) => value.groups.findIndex((each) => each.includes(name));
      const [sender, receiver] = [group(from), group(to)];
      if (sender < 0 || receiver < 0 || sender === receiver) return false;
      return !value.one_way || sender > receiver;
    }
    // A fault of a link states its ends; any other fault affects no link.
    default:
      return typeof value === "object" && "from" in value && matches(value.from, from) && matches(value.to, to);
  }
}

/** Tests whether the fault stops every message that `to` would receive from `from`. */
function cutsLink(fault, from, to) {
  const [[kind, value]] = Object.entries(fault);
  const stops = kind === "drop" ? value.p === 1 : ["mute", "deaf", "partition"].includes(kind);
  return stops && affectsLink(fault, from, to);
}

/** Tests whether the fault holds back every message that `to` would receive from `from`. */
function holdsLink(fault, from, to) {
  return "hold" in fault && affectsLink(fault, from, to);
}

/** Returns the faults in force. */
export function inForce(view) {
  return view.faults.filter(({ phase }) => phase === "in-force").map(({ order }) => order.fault);
}

/**
 * Returns the state of a link from the quality of its recent messages, `{count, lost, late}`, and the faults in force:
 * `{count, loss, isCut, isHeld}`. The messages before a cut or a hold say nothing about the link now.
 */
export function linkState({ count, lost }, faults, from, to) {
  const loss = count ? lost / count : 0;
  const isCut = loss === 1 || faults.some((fault) => cutsLink(fault, from, to));
  return { count, loss, isCut, isHeld: !isCut && faults.some((fault) => holdsLink(fault, from, to)) };
}

/**
 * Folds the events of each fault: returns a map from the event that stands for its fault to all phases of it, `{kind,
 * t_ms}` by time. The fault stands at its effect, or at its first phase before that.
 */
export function foldFaults(events) {
  const phases = new Map();
  for (const event of events) {
    if (event.group !== "faults") continue;
    const known = phases.get(event.subject);
    if (known) known.push(event);
    else phases.set(event.subject, [event]);
  }
  const all = [...phases.values()];
  return new Map(all.map((each) => [each.find(({ kind }) => kind === "applied") ?? each[0], each]));
}

const PHASE_EVENTS = new Set(["armed", "applied", "healed", "disarmed", "failed"]);

/**
 * Returns all faults up to now, latest first: `{id, words, terms, phase, applied_ms, healed_ms, hits, failed}`. The
 * view has the faults that are armed or in force. The events have the past ones. `kinds` are the faults of every mission.
 * @param {import("../../page-tests/types.js").View} view
 */
export function faultRows(view, events, kinds) {
  const rows = new Map();
  for (const event of events) {
    if (!PHASE_EVENTS.has(event.kind)) continue;
    const row = rows.get(event.subject) ?? {
      id: event.subject,
      terms: "",
      phase: "over",
      applied_ms: null,
      healed_ms: null,
      hits: null,
    };
    rows.set(event.subject, row);
    row.words = cutsInWords(event.detail);
    if (event.kind === "applied") row.applied_ms = event.t_ms;
    if (event.kind === "healed") row.healed_ms = event.t_ms;
  }
  for (const { id, order, phase, applied_ms, hits, failed } of view.faults) {
    const row = rows.get(id) ?? { id, healed_ms: null };
    rows.set(id, row);
    Object.assign(row, { phase, hits, failed, words: faultInWords(order.fault, kinds), terms: termsInWords(order) });
    row.applied_ms = applied_ms ?? row.applied_ms ?? null;
  }
  return [...rows.values()].reverse();
}

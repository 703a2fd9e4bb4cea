// The comparison of two runs with the same scenario, seed and orders: their figures, and which one is ahead.

import { seconds } from "../ui/words.js";
import { TOOK_OVER } from "./events.js";
import { progress } from "./mission.js";

/**
 * Returns the figures of a run: `{done, left, ended_ms, isComplete, takeovers, messages}`. `done` and `left` count
 * units of work and are null if the mission counts none. `ended_ms` is null before the end.
 */
export function figuresOf(model) {
  const { view, run, events, broadcasts } = model;
  const { columns } = run.mission;
  const sum = (wanted) => columns.reduce((all, { kind }, index) => all + (kind === wanted ? (view.mission[index] ?? 0) : 0), 0);
  const current = progress(columns, view.mission);
  return {
    done: current?.done ?? null,
    left: current && sum("left"),
    ended_ms: view.outcome === null ? null : view.now,
    isComplete: view.outcome === "complete",
    takeovers: events.filter(({ kind }) => kind === TOOK_OVER).length,
    messages: broadcasts,
  };
}

/**
 * Returns which of two runs is ahead, as `{index, why}`; null if neither is. A complete run is ahead of an incomplete one,
 * the earlier of two complete runs is ahead, and otherwise the run with more work done.
 */
export function ahead(figures) {
  const [a, b] = figures;
  const by = (difference, why) => (difference === 0 ? null : { index: difference > 0 ? 0 : 1, why });
  if (a.isComplete && b.isComplete) {
    const gained_ms = b.ended_ms - a.ended_ms;
    return by(gained_ms, `complete ${seconds(Math.abs(gained_ms), 2)} earlier`);
  }
  if (a.isComplete || b.isComplete) return by(a.isComplete ? 1 : -1, "complete");
  const more = (a.done ?? 0) - (b.done ?? 0);
  return by(more, `${Math.abs(more)} more done`);
}

/** Returns the figures as texts, in the order of {@link HEADINGS}. */
export function shown({ done, left, ended_ms, takeovers, messages }) {
  return [
    done === null ? "–" : String(done),
    left === null ? "–" : String(left),
    ended_ms === null ? "–" : seconds(ended_ms, 2),
    String(takeovers),
    messages.toLocaleString("en"),
  ];
}

export const HEADINGS = ["done", "left", "ended at", "takeovers", "messages sent"];

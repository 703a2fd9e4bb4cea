// The state of a mission in words, from the columns that it declares: `{name, kind}`. Every view has a value for each.

import { seconds } from "../ui/words.js";

/** Returns a column's label: `last_report_ms` → `last report`. A time is shown with its unit. */
export function label(name) {
  return name.replace(/_ms$/, "").replaceAll("_", " ");
}

/** Tests whether work can expire. Such work may also come back, so its total is not fixed. */
const canExpire = (columns) => columns.some(({ kind }) => kind === "expired");

/**
 * Returns the progress of the mission as `{done, share, count, what}`, or null if no column counts finished work. The
 * texts are `3 of 24` and `items delivered`, or `9 open,` and `3 done, 2 expired` if work can expire. The share is null
 * if the total is not fixed.
 */
export function progress(columns, values) {
  const sum = (wanted) => columns.reduce((all, { kind }, index) => all + (kind === wanted ? (values[index] ?? 0) : 0), 0);
  const first = columns.find(({ kind }) => kind === "done");
  if (!first) return null;
  const done = sum("done");
  const [left, expired] = [sum("left"), sum("expired")];
  const what = label(first.name);
  if (!canExpire(columns)) return { done, share: done / (done + left || 1), count: `${done} of ${done + left}`, what };
  return { done, share: null, count: `${left} open,`, what: `${done} ${what}${expired ? `, ${expired} expired` : ""}` };
}

/** Returns the other columns as texts, times first. `now` is in ms. */
export function details(columns, values, now) {
  const inProgress = canExpire(columns) ? ["done", "left", "expired"] : ["done"];
  const rest = columns.map((column, index) => ({ ...column, value: values[index] })).filter(({ kind }) => !inProgress.includes(kind));
  rest.sort((a, b) => Number(b.kind === "time") - Number(a.kind === "time"));
  return rest.map(({ name, kind, value }) => `${label(name)} ${inWords(kind, value, now)}`);
}

function inWords(kind, value, now) {
  if (kind === "time") return value === null ? "none yet" : `${seconds(now - value, 0)} ago`;
  if (value === null) return "–";
  return kind === "real" ? value.toFixed(2) : String(value);
}

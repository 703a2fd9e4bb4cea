// The state of a mission in words, from the columns that it declares: `{name, kind}`. Every view has a value for each.

import { seconds } from "../ui/words.js";

/** The suffixes of column names with the factor and the unit of the shown value. */
const UNITS = { _ms: [0.001, "s"], _s: [1, "s"], _m: [1, "m"], _m_s: [1, "m/s"], _rad: [180 / Math.PI, "°"], _j: [1, "J"] };

/** Returns the suffix of a column's name that is a unit, or an empty text. */
function suffixOf(name) {
  return Object.keys(UNITS).findLast((suffix) => name.endsWith(suffix)) ?? "";
}

/** Returns a column's label without its unit: `last_report_ms` → `last report`. A mission may declare another label. */
function labelOf({ name, label }) {
  return label ?? name.slice(0, name.length - suffixOf(name).length).replaceAll("_", " ");
}

/** Tests whether work can expire. Such work may also come back, so its total is not fixed. */
const canExpire = (columns) => columns.some(({ kind }) => kind === "expired");

/**
 * Returns the progress of the mission as `{done, share, count, what}`, or null if no column counts finished work. The
 * texts are `3 of 24` and `items delivered`, or `9 open` and `3 done, 2 expired` if work can expire. The share is null
 * if the total is not fixed.
 */
export function progress(columns, values) {
  const sum = (wanted) => columns.reduce((all, { kind }, index) => all + (kind === wanted ? (values[index] ?? 0) : 0), 0);
  const first = columns.find(({ kind }) => kind === "done");
  if (!first) return null;
  const done = sum("done");
  const [left, expired] = [sum("left"), sum("expired")];
  const what = labelOf(first);
  if (!canExpire(columns)) return { done, share: done / (done + left || 1), count: `${done} of ${done + left}`, what };
  return { done, share: null, count: `${left} open`, what: `${done} ${what}${expired ? `, ${expired} expired` : ""}` };
}

/**
 * Returns the other columns as texts, times first. After `3 of 24 items delivered`, `items carried 2` is `carried 2`.
 * `now` is in ms.
 */
export function details(columns, values, now) {
  const [noun, ...others] = labelOf(columns.find(({ kind }) => kind === "done") ?? { name: "" }).split(" ");
  const shorter = (label) => (others.length > 0 && label.startsWith(`${noun} `) ? label.slice(noun.length + 1) : label);
  const inProgress = canExpire(columns) ? ["done", "left", "expired"] : ["done"];
  const rest = columns.map((column, index) => ({ ...column, value: values[index] })).filter(({ kind }) => !inProgress.includes(kind));
  rest.sort((a, b) => Number(b.kind === "time") - Number(a.kind === "time"));
  return rest.map((column) => `${shorter(labelOf(column))} ${inWords(column, now)}`);
}

function inWords({ name, kind, value }, now) {
  if (kind === "time") return value === null ? "none yet" : `${seconds(now - value, 0)} ago`;
  if (value === null) return "–";
  if (kind !== "real") return String(value);
  const [factor, unit] = UNITS[suffixOf(name)] ?? [1, ""];
  const digits = unit === "°" ? 1 : 2;
  // A small negative number would be shown as -0.00.
  const shown = (Number((factor * value).toFixed(digits)) || 0).toFixed(digits);
  return unit === "°" || unit === "" ? `${shown}${unit}` : `${shown} ${unit}`;
}

// What a mission tells of itself, in the words of the columns that it declares: `{name, kind}`, each with a value in every view.

import { seconds } from "../ui/words.js";

/** `last_report_ms` → `last report`: a time is told with its unit. */
export function label(name) {
  return name.replace(/_ms$/, "").replaceAll("_", " ");
}

/** How far the mission has come: `{done, total, what}`; null if no column counts what is done. */
export function progress(columns, values) {
  const sum = (wanted) => columns.reduce((all, { kind }, place) => all + (kind === wanted ? (values[place] ?? 0) : 0), 0);
  const first = columns.find(({ kind }) => kind === "done");
  if (!first) return null;
  const done = sum("done");
  return { done, total: done + sum("left"), what: label(first.name) };
}

/** What the other columns tell, as texts, times first; `now` in ms. */
export function details(columns, values, now) {
  const others = columns.map((column, place) => ({ ...column, value: values[place] })).filter(({ kind }) => kind !== "done");
  others.sort((a, b) => Number(b.kind === "time") - Number(a.kind === "time"));
  return others.map(({ name, kind, value }) => `${label(name)} ${inWords(kind, value, now)}`);
}

function inWords(kind, value, now) {
  if (kind === "time") return value === null ? "none yet" : `${seconds(now - value, 0)} ago`;
  if (value === null) return "–";
  return kind === "real" ? value.toFixed(2) : String(value);
}

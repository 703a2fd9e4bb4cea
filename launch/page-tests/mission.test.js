// Tests the texts for a mission that the page does not contain, from its declared columns.

import assert from "node:assert/strict";
import { test } from "node:test";

import { groupOf } from "../page/model/events.js";
import { details, progress } from "../page/model/mission.js";

const COLUMNS = [
  { name: "places_left", kind: "left" },
  { name: "places_visited", kind: "done" },
  { name: "last_visit_ms", kind: "time" },
  { name: "way_m", kind: "real" },
];

test("the progress of a mission comes from its own columns", () => {
  assert.deepEqual(progress(COLUMNS, [2, 3, 61_000, 7.5]), { done: 3, share: 0.6, count: "3 of 5", what: "places visited" });
  assert.equal(progress(COLUMNS.slice(2), [61_000, 7.5]), null);
});

test("work that comes back has no fixed total: the head has the open work", () => {
  const returns = [
    { name: "open", kind: "left" },
    { name: "started", kind: "count" },
    { name: "done", kind: "done" },
    { name: "expired", kind: "expired" },
  ];
  // The janitorial scenario at the start and at half time.
  assert.deepEqual(progress(returns, [9, 0, 0, 0]), { done: 0, share: null, count: "9 open", what: "0 done" });
  assert.deepEqual(progress(returns, [0, 0, 28, 0]), { done: 28, share: null, count: "0 open", what: "28 done" });
  assert.deepEqual(progress(returns, [1, 0, 2, 237]), { done: 2, share: null, count: "1 open", what: "2 done, 237 expired" });
  assert.deepEqual(details(returns, [9, 2, 0, 0], 0), ["started 2"]);
});

test("the other columns are shown with their labels, without the noun of the progress", () => {
  assert.deepEqual(details(COLUMNS, [2, 3, 61_000, 7.5], 73_000), ["last visit 12 s ago", "left 2", "way 7.50 m"]);
  assert.deepEqual(details(COLUMNS, [5, 0, null, null], 0), ["last visit none yet", "left 5", "way –"]);
});

test("numbers have their unit, and a mission may declare a label", () => {
  const real = (name, label = null) => ({ name, label, kind: "real" });
  const columns = [real("left_m"), real("skew_rad"), real("work_left_s"), real("share"), { name: "pairs", kind: "count", label: "targets in view" }];
  const texts = ["left 3.37 m", "skew -4.6°", "work left 2.00 s", "share 0.50", "targets in view 4"];
  assert.deepEqual(details(columns, [3.374, -0.08, 2, 0.5, 4], 0), texts);
  assert.deepEqual(details([real("skew_rad")], [-0.0001], 0), ["skew 0.0°"]);
});

test("events of the mission have their own group", () => {
  assert.equal(groupOf("visited", ["visited"]), "mission");
  assert.equal(groupOf("visited", []), "details");
  assert.equal(groupOf("gone", ["visited"]), "robots");
});

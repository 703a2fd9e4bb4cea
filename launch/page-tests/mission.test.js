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
  assert.deepEqual(progress(COLUMNS, [2, 3, 61_000, 7.5]), { done: 3, total: 5, what: "places visited" });
  assert.equal(progress(COLUMNS.slice(2), [61_000, 7.5]), null);
  const expires = [{ name: "open", kind: "left" }, { name: "done", kind: "done" }, { name: "expired", kind: "expired" }];
  assert.deepEqual(progress(expires, [1, 2, 237]), { done: 2, total: 240, what: "done" });
});

test("the other columns are shown with their labels", () => {
  assert.deepEqual(details(COLUMNS, [2, 3, 61_000, 7.5], 73_000), ["last visit 12 s ago", "places left 2", "way m 7.50"]);
  assert.deepEqual(details(COLUMNS, [5, 0, null, null], 0), ["last visit none yet", "places left 5", "way m –"]);
});

test("events of the mission have their own group", () => {
  assert.equal(groupOf("visited", ["visited"]), "mission");
  assert.equal(groupOf("visited", []), "details");
  assert.equal(groupOf("gone", ["visited"]), "robots");
});

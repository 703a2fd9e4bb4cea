// Tests the rows of the event list.

import assert from "node:assert/strict";
import { test } from "node:test";

import { eventRows, groupOf } from "../page/model/events.js";
import { countsInWords } from "../page/ui/words.js";

const event = (t_ms, kind) => ({ t_ms, kind, group: groupOf(kind, ["picked", "delivered"]) });

test("routine events of ten seconds share a row between events that matter", () => {
  const kinds = ["joined", "joined", "picked", "applied", "picked", "activated", "picked", "gone", "ended"];
  const events = kinds.map((kind, index) => event(100 * index, kind));
  const rows = (folds, all = events) => eventRows(all, () => true, 20, folds).map((row) => row.map(({ kind }) => kind));
  assert.deepEqual(rows(true), [["ended"], ["gone"], ["picked", "activated", "picked"], ["applied"], ["picked", "joined", "joined"]]);
  assert.deepEqual(rows(false), kinds.toReversed().map((kind) => [kind]));
  assert.equal(rows(true, [event(9_900, "picked"), event(10_000, "picked")]).length, 2);
});

test("a full list still folds into its last row", () => {
  const events = [event(0, "gone"), event(1, "picked"), event(2, "picked"), event(3, "gone")];
  const rows = eventRows(events, () => true, 2, true);
  assert.deepEqual(rows.map(({ length }) => length), [1, 2]);
});

test("folded events are counted by kind", () => {
  const events = ["picked", "put-down", "picked"].map((kind) => event(0, kind));
  assert.equal(countsInWords(events), "2 picked, 1 put down");
});

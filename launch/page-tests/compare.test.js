// Tests the comparison of two runs with different allocators.

import assert from "node:assert/strict";
import { test } from "node:test";

import { ahead, figuresOf, shown } from "../page/model/compare.js";

const COLUMNS = [
  { name: "items_left", kind: "left" },
  { name: "items_delivered", kind: "done" },
];

/** Returns a model with the values that the comparison reads. */
function model(done, outcome = null, now = 60_000) {
  const events = [{ kind: "took-over" }, { kind: "gone" }, { kind: "detected" }];
  return { view: { mission: [24 - done, done], outcome, now }, run: { mission: { columns: COLUMNS } }, events, broadcasts: 1234 };
}

const leader = (a, b) => ahead([figuresOf(a), figuresOf(b)]);

test("the figures of a run come from its view, its events and its messages", () => {
  const figures = figuresOf(model(3));
  assert.deepEqual(figures, { done: 3, left: 21, ended_ms: null, isComplete: false, takeovers: 1, messages: 1234 });
  assert.deepEqual(shown(figures), ["3", "21", "–", "1", "1,234"]);
  assert.deepEqual(shown(figuresOf(model(24, "complete", 342_550))).slice(0, 3), ["24", "0", "342.55 s"]);
  const countsNothing = { ...model(0), run: { mission: { columns: [] } } };
  assert.deepEqual(shown(figuresOf(countsNothing)).slice(0, 2), ["–", "–"]);
});

test("more work done is ahead before the end", () => {
  assert.deepEqual(leader(model(5), model(3)), { index: 0, why: "2 more done" });
  assert.deepEqual(leader(model(3), model(4)), { index: 1, why: "1 more done" });
  assert.equal(leader(model(3), model(3)), null);
});

test("a complete run is ahead of an incomplete one, and of a later one", () => {
  const [early, late] = [model(24, "complete", 300_000), model(24, "complete", 312_500)];
  assert.deepEqual(leader(late, early), { index: 1, why: "complete 12.50 s earlier" });
  assert.equal(leader(early, early), null);
  assert.deepEqual(leader(early, model(23)), { index: 0, why: "complete" });
  // The end of the time is no completion.
  assert.deepEqual(leader(model(12, "time-limit"), model(13)), { index: 1, why: "1 more done" });
});

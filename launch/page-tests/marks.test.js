// Tests the work left at marks.

import assert from "node:assert/strict";
import { test } from "node:test";

import { labelsOf, markInWords, shareLeft } from "../page/model/marks.js";
import { isWithin } from "../page/room/geometry.js";

const spill = (left) => ({ id: "zone-0", label: "spill (top)", work: { left, all: 12, unit: "items" } });
const site = (left) => ({ id: "report-site", label: "report site", work: { left, all: 1, unit: "" } });

test("the filling of a mark is the work that is left", () => {
  assert.deepEqual([12, 6, 0].map((left) => shareLeft(spill(left))), [1, 0.5, 0]);
  assert.equal(shareLeft({ ...spill(1), work: null }), 0);
});

test("a mark has the amount that is left in its label and in words", () => {
  assert.deepEqual(labelsOf(spill(6)), ["spill (top) 6/12 left", "spill (top)"]);
  assert.equal(markInWords(spill(6)), "spill (top): 6 of 12 items left");
  assert.deepEqual(labelsOf(site(1)), ["report site"]);
  assert.deepEqual([1, 0].map((left) => markInWords(site(left))), ["report site: to do", "report site: done"]);
  const point = { id: "0/p3", label: "p3 dust", work: { left: 4.25, all: 9.5, unit: "s" } };
  assert.deepEqual(labelsOf(point), ["p3 dust 4.3/9.5 s left", "p3 dust"]);
});

test("the label of finished work keeps its tick where space is short", () => {
  assert.deepEqual(labelsOf(spill(0)), ["✓ spill (top)", "✓"]);
  assert.deepEqual(labelsOf({ ...site(0), label: "" }), []);
});

test("the pointer is within a disc, a rectangle or a bar", () => {
  const at = { x: 1, y: 1 };
  assert.equal(isWithin(at, { disc: { center: [1, 2], radius_m: 1 } }), true);
  assert.equal(isWithin(at, { rectangle: { min: [0, 0], max: [0.9, 2] } }), false);
  assert.equal(isWithin(at, { bar: { from: [0, 1.1], to: [3, 1.1], half_width_m: 0.2 } }), true);
  assert.equal(isWithin(at, { line: { from: [0, 1], to: [3, 1] } }), false);
});

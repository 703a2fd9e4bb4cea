// Tests where the labels of robots stand.

import assert from "node:assert/strict";
import { test } from "node:test";

import { overlaps, placeLabel } from "../page/room/labels.js";

const WALLS = { left: 0, top: 0, right: 200, bottom: 100 };
const SIZES = [
  { width: 60, height: 30 },
  { width: 30, height: 15 },
];
const BODY = { x: 100, y: 50, gap: 10 };
const NEW = { side: null, mustShow: false };
const [BELOW, ABOVE, RIGHT] = [0, 1, 2];
const box = (left, top, right, bottom) => ({ left, top, right, bottom });

test("a label avoids other labels, and then filled marks", () => {
  const below = box(60, 70, 140, 75);
  const above = box(60, 20, 140, 30);
  assert.equal(placeLabel(SIZES, BODY, NEW, WALLS, [], []).side, BELOW);
  assert.equal(placeLabel(SIZES, BODY, NEW, WALLS, [below], []).side, ABOVE);
  assert.equal(placeLabel(SIZES, BODY, NEW, WALLS, [below], [above]).side, RIGHT);
  // Text on a mark is better than no text.
  const everywhere = box(0, 0, 200, 100);
  assert.equal(placeLabel(SIZES, BODY, NEW, WALLS, [below], [everywhere]).side, ABOVE);
});

test("a shorter text takes the place of a long one, and a label that must show covers others", () => {
  const all = [box(0, 0, 200, 35), box(0, 78, 200, 100), box(0, 0, 90, 100), box(110, 0, 200, 100)];
  assert.deepEqual(placeLabel(SIZES, { ...BODY, y: 50 }, { side: BELOW, mustShow: false }, WALLS, [all[0], all[1]], []).side, RIGHT);
  const short = placeLabel(SIZES, BODY, { side: BELOW, mustShow: false }, WALLS, [all[0], all[1], box(0, 0, 80, 100), box(120, 0, 200, 100)], []);
  assert.deepEqual([short.index, short.side], [1, BELOW]);
  assert.equal(placeLabel(SIZES, BODY, NEW, WALLS, all, []), null);
  assert.equal(placeLabel(SIZES, BODY, { ...NEW, mustShow: true }, WALLS, all, []).index, 1);
});

test("a label stays within the walls and on its side", () => {
  const place = placeLabel(SIZES, { ...BODY, x: 5 }, NEW, WALLS, [], []);
  assert.ok(place.box.left >= 0 && !overlaps(place.box, box(-10, 0, 0, 100)));
  assert.equal(placeLabel(SIZES, { ...BODY, x: -50 }, NEW, WALLS, [], []), null);
  assert.equal(placeLabel(SIZES, BODY, { side: ABOVE, mustShow: false }, WALLS, [], []).side, ABOVE);
});

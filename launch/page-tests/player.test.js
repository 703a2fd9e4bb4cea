// How many views of a log are taken in, of whatever team and at whatever speed.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Player } from "../page/source/player.js";

/** Views of a log of one view per 50 ms that are taken in by ten seconds of playing, and how many of them are seen, per second. */
function played(robots, speed) {
  const seen = [];
  const taken = [];
  const log = {
    step_ms: 50,
    count: 1_000_000,
    view: (index, level) => `view ${Math.floor(index / level) * level}`,
    viewWithPast: (view) => ({ view, before: [] }),
  };
  const model = { names: Array(robots).fill("any"), jump: () => {}, absorb: (view) => taken.push(view) };
  const player = new Player(log, model, () => {});
  player.setSpeed(speed);
  player.advance(0);
  player.resume();
  for (let picture = 0; picture <= 600; picture += 1) {
    player.advance((picture * 1000) / 60);
    if (taken.at(-1) !== seen.at(-1)) seen.push(taken.at(-1));
  }
  return { taken_per_s: taken.length / 10, seen_per_s: seen.length / 10, place_ms: player.place_ms };
}

test("of any team at least 30 views a second are seen where there are so many", () => {
  for (const robots of [1, 3, 30, 300, 3000]) {
    for (const speed of [1, 1.5, 2, 3, 4, 7, 10, 30, 100, null]) {
      const { seen_per_s, place_ms } = played(robots, speed);
      const there = 20 * (speed ?? 500);
      assert.ok(seen_per_s >= Math.min(30, there) - 0.2, `${robots} robots at ${speed}x: ${seen_per_s}`);
      assert.ok(Math.abs(place_ms - 10_000 * (speed ?? 500)) < 1, `${robots} robots at ${speed}x: at ${place_ms} ms`);
    }
  }
});

test("of a small team every view is taken in, of a large one as many as can be borne", () => {
  assert.ok(played(3, 4).taken_per_s >= 79.8);
  assert.ok(played(3, 20).taken_per_s >= 399);
  for (const robots of [30, 300, 3000]) {
    const { taken_per_s } = played(robots, null);
    assert.ok(taken_per_s <= 2 * Math.max(30, 1500 / robots), `${robots} robots: ${taken_per_s}`);
  }
});

// Tests the rate of views during playback, for several team sizes and speeds.

import assert from "node:assert/strict";
import { test } from "node:test";

import { between } from "../page/model/between.js";
import { Player } from "../page/source/player.js";

/** Plays ten seconds of a log with one view per 50 ms. Returns the added and the displayed views per second. */
function played(robots, speed) {
  const displayed = [];
  const added = [];
  const log = {
    step_ms: 50,
    count: 1_000_000,
    view: (index, level) => `view ${Math.floor(index / level) * level}`,
    viewWithPast: (view) => ({ view, before: [] }),
  };
  const approached = [];
  const model = {
    names: Array(robots).fill("any"),
    jump: () => {},
    addView: (view) => added.push(view),
    approach: (next, share) => approached.push(share),
    settle: () => {},
  };
  const player = new Player(log, model, () => {});
  player.setSpeed(speed);
  player.advance(0);
  player.resume();
  for (let frame = 0; frame <= 600; frame += 1) {
    player.advance((frame * 1000) / 60);
    if (added.at(-1) !== displayed.at(-1)) displayed.push(added.at(-1));
  }
  return { added_per_s: added.length / 10, displayed_per_s: displayed.length / 10, place_ms: player.place_ms, approached };
}

test("at least 30 views per second are displayed for any team, if the log has them", () => {
  for (const robots of [1, 3, 30, 300, 3000]) {
    for (const speed of [1, 1.5, 2, 3, 4, 7, 10, 30, 100, null]) {
      const { displayed_per_s, place_ms } = played(robots, speed);
      const available = 20 * (speed ?? 500);
      assert.ok(displayed_per_s >= Math.min(30, available) - 0.2, `${robots} robots at ${speed}x: ${displayed_per_s}`);
      assert.ok(Math.abs(place_ms - 10_000 * (speed ?? 500)) < 1, `${robots} robots at ${speed}x: at ${place_ms} ms`);
    }
  }
});

test("every view of a small team is added, and a bounded number for a large one", () => {
  assert.ok(played(3, 4).added_per_s >= 79.8);
  assert.ok(played(3, 20).added_per_s >= 399);
  for (const robots of [30, 300, 3000]) {
    const { added_per_s } = played(robots, null);
    assert.ok(added_per_s <= 2 * Math.max(30, 1500 / robots), `${robots} robots: ${added_per_s}`);
  }
});

test("between sparse views, the picture moves in every frame", () => {
  const { approached } = played(3, 0.1);
  assert.ok(approached.length > 570, `${approached.length}`);
  assert.ok(approached.every((share) => share > 0 && share <= 1));
  assert.deepEqual(played(3, 100).approached, []);
});

test("a robot between two views takes the straight way and the shorter turn", () => {
  const robot = (x, heading_rad) => ({ state: "present", pose: { position: [x, 1], heading_rad } });
  const pose = (from, to, share) => between({ tick: 1, robots: [from] }, { tick: 2, robots: [to] }, share).robots[0].pose;
  assert.deepEqual(pose(robot(1, 0), robot(2, 1), 0.25), { position: [1.25, 1], heading_rad: 0.25 });
  assert.ok(Math.abs(pose(robot(1, 3.1), robot(1, -3.1), 0.5).heading_rad - Math.PI) < 1e-9);
  // A relocation has no way.
  assert.deepEqual(pose(robot(1, 0), robot(9, 0), 0.5).position, [1, 1]);
});

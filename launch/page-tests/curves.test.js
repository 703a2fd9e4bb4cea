// Compares the data of charts and trails with the events behind them.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Curves, levelAt } from "../page/model/curves.js";
import { History } from "../page/model/history.js";
import { levels } from "../page/model/levels.js";
import { crosses, trail } from "../page/model/trail.js";

const corner = (at, level, state = "Hibernating", last = false) => ({ robot: 0, set: 0, at, level, state, last });

/** Returns a deterministic generator of numbers from 0 to 1. */
function random(seed) {
  let state = seed;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 2 ** 32;
  };
}

/** Returns a column's highest value within `near` seconds of `t`, or null. */
function highest(columns, column, t, near) {
  const found = columns[column].filter((level, row) => level !== null && Math.abs(columns[0][row] - t) <= near);
  return found.length ? Math.max(...found) : null;
}

test("setsOf returns every set that had a curve", () => {
  const curves = new Curves(3);
  curves.add([{ ...corner(0, 0), robot: 1, set: 2 }, { ...corner(0, 0), robot: 1, set: 0 }, { ...corner(50, 0), robot: 2, set: 1 }]);
  assert.deepEqual([0, 1, 2, 3].map((rank) => curves.setsOf(rank)), [[], [0, 2], [1], []]);
});

test("a peak reaches the threshold in every window, and a reset is vertical", () => {
  // A rise to the threshold at 123.95 s, active for one step, then a fall to 0.
  const corners = [corner(0, 0), corner(123_950, 100, "Active"), corner(124_000, 0), corner(200_000, 40, "Hibernating", true)];
  for (const [from, to] of [
    [0, 203_000],
    [83_000, 203_000],
    [100_000, 130_000],
    [0, 3_600_000],
  ]) {
    const { columns, bands } = levels([corners], [], 0, from, to);
    assert.equal(Math.max(...columns[1]), 100, `${from} to ${to}`);
    const fall = columns[1].findIndex((level, row) => row > 0 && level < columns[1][row - 1]);
    assert.deepEqual([columns[1][fall - 1], columns[1][fall]], [100, 0]);
    assert.equal(columns[0][fall], 124);
    // The fall is vertical, or narrower than a pixel.
    assert.ok(124 - columns[0][fall - 1] <= (to <= 203_000 ? 0 : 0.051));
    assert.deepEqual(bands, [{ set: 0, state: "Active", from: 123.95, to: 124 }]);
  }
});

test("every activation and reset of random curves is drawn, at any number of corners", () => {
  for (let seed = 1; seed <= 30; seed += 1) {
    const next = random(seed);
    const curves = [0, 1, 2].map(() => {
      const corners = [corner(0, 0)];
      let t = 0;
      while (t < 900_000) {
        t += 50 * (1 + Math.floor(next() * 200));
        const isPeak = next() < 0.5;
        corners.push(corner(t, isPeak ? 100 : 20 + 70 * next(), isPeak ? "Active" : "Hibernating"), corner(t + 50, 0));
        t += 50;
      }
      corners.push(corner(t + 50, 1, "Hibernating", true));
      return corners;
    });
    const [from, to] = [100_000 * next(), 400_000 + 500_000 * next()];
    const { columns } = levels(curves, [], 0, from, to);
    // The width of one position in the chart, s.
    const grain = (to - from) / 600 / 1000;
    assert.ok(columns[0].length <= 601 * (2 + 3 * 3), `${columns[0].length} rows`);
    for (let row = 1; row < columns[0].length; row += 1) assert.ok(columns[0][row] >= columns[0][row - 1]);
    curves.forEach((corners, set) => {
      for (const { at, state } of corners.filter((each) => each.at >= from && each.at <= to)) {
        if (state === "Active") assert.equal(highest(columns, set + 1, at / 1000, grain), 100, `${seed}: ${at}`);
      }
      // A fall has no slope: it takes point at one time, or within one position of the chart.
      for (let row = 1; row < columns[0].length; row += 1) {
        const falls = columns[set + 1][row] < columns[set + 1][row - 1];
        if (falls) assert.ok(columns[0][row] - columns[0][row - 1] <= grain + 1e-9);
      }
    });
  }
});

test("an absent robot has a gap in its curve", () => {
  const corners = [corner(0, 0), corner(1000, 10, "Hibernating", true), corner(5000, 0), corner(9000, 40, "Hibernating", true)];
  assert.equal(levelAt(corners, 3000), null);
  assert.equal(levelAt(corners, 7000).level, 20);
  const samples = [0, 1050, 3000, 5050].map((t) => ({ t, agents: [t > 1000 && t < 5000 ? "dead" : "present"] }));
  const { columns, bands } = levels([corners], samples, 0, 0, 10_000);
  columns[0].forEach((t, row) => assert.equal(columns[1][row] === null, (t > 1 && t < 5) || t > 9, `${t} s`));
  assert.deepEqual(bands, [{ set: null, state: "dead", from: 1.05, to: 5.05 }]);
});

test("corners are stored by robot and set, and a long live run drops the oldest", () => {
  const curves = new Curves(2);
  curves.add([{ ...corner(0, 1), robot: 1, set: 1 }, corner(50, 2)]);
  assert.deepEqual(curves.of(1, 1).map(({ level }) => level), [1]);
  assert.deepEqual(curves.of(0, 1), []);
  curves.add(Array.from({ length: 30_000 }, (_, index) => corner(100 + 50 * index, index)));
  assert.ok(curves.of(0, 0).length <= 20_000);
  assert.equal(curves.of(0, 0).at(-1).level, 29_999);
});

const view = (now, position, state = "present") => ({ now, robots: [{ pose: { position }, state }] });

test("a short death between two kept samples stays visible", () => {
  const history = new History(1);
  for (let tick = 0; tick < 100_000; tick += 1) history.add(view(50 * tick, [0, 0], tick === 777 ? "dead" : "present"), 50 * tick);
  assert.ok(history.samples.length <= 6000);
  assert.equal(history.samples.filter(({ agents }) => agents[0] === "dead").length, 1);
});

test("a trail crosses no obstacle, even with few views", () => {
  const wall = { x_m: 4, y_m: 0, width_m: 0.2, height_m: 5, penetrability: 0 };
  // Up along the wall, around its end, and down on the other side.
  const path = [];
  for (let y = 0; y < 5.5; y += 0.025) path.push([3.7, y]);
  for (let x = 3.7; x < 4.5; x += 0.025) path.push([x, 5.5]);
  for (let y = 5.5; y > 0; y -= 0.025) path.push([4.5, y]);
  for (const every of [1, 7, 40, 150, 400]) {
    const history = new History(1);
    path.filter((_, index) => index % every === 0).forEach((point, index) => history.add(view(50 * every * index, point), 0));
    const lines = trail(history, 0, 0, 60_000, 0.25, [wall]);
    for (const line of lines) {
      for (let index = 1; index < line.length; index += 1) assert.ok(!crosses(line[index - 1], line[index], wall), `every ${every}`);
    }
    if (every <= 7) assert.equal(lines.length, 1);
  }
  // A slow zone may be crossed, a wall may not.
  const history = new History(1);
  [[3, 1], [4.1, 1]].forEach((point, index) => history.add(view(5000 * index, point), 0));
  assert.equal(trail(history, 0, 0, 60_000, 0.25, [{ ...wall, penetrability: 0.5 }]).length, 1);
  assert.equal(trail(history, 0, 0, 60_000, 0.25, [wall]).length, 2);
});

// Compares the chart data of a log with the log's rows. A Rust test writes both into one file.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { Curves, levelAt } from "../page/model/curves.js";
import { levels } from "../page/model/levels.js";

const file = process.env.ALLIANCE_LOG;

test("every row, activation and reset of the log is drawn", { skip: file ? false : "run from `cargo test`" }, () => {
  const { robots, sets, duration_ms, corners: cornersOfAll, rows } = JSON.parse(readFileSync(file, "utf8"));
  const curves = new Curves(sets.length);
  for (const each of cornersOfAll) curves.add(each);
  const bySet = new Map(sets.map(({ name }, set) => [name, set]));
  const corners = robots.map((_, rank) => sets.map((_, set) => curves.of(rank, set)));
  const peaks = [];
  const before = new Map();
  for (const [t, robot, name, level, state] of rows) {
    const [rank, set] = [robots.indexOf(robot), bySet.get(name)];
    const drawnAt = levelAt(corners[rank][set], t);
    assert.ok(Math.abs(drawnAt.level - level) < 1e-6 && drawnAt.state.toLowerCase() === state, `${t} ms, ${robot}, ${name}: ${level}`);
    const key = `${robot} ${name}`;
    const [previousLevel, previousState] = before.get(key) ?? [0, ""];
    if (state === "active" && previousState !== "active") peaks.push({ t, rank, set, level });
    if (level < previousLevel) peaks.push({ t, rank, set, level: previousLevel });
    before.set(key, [level, state]);
  }
  assert.ok(peaks.length > 20, `${peaks.length} activations and resets`);
  for (const length of [duration_ms, 120_000, 30_000]) {
    for (const { t, rank, set, level } of peaks) {
      const from = Math.max(0, t - length / 2);
      const { columns } = levels(corners[rank], [], rank, from, from + length);
      const near = length / 600 / 1000;
      const drawn = columns[set + 1].filter((each, row) => each !== null && Math.abs(columns[0][row] - t / 1000) <= near);
      assert.ok(Math.max(...drawn) >= level - 1e-6, `${t} ms, robot ${rank}, set ${set}: ${level}, drawn ${Math.max(...drawn)}`);
    }
  }
});

// Tests the views that the simulator's thread sends while its clock runs.

import assert from "node:assert/strict";
import { mock, test } from "node:test";

import { Runner } from "../page/source/worker.js";

const STEP_MS = 50;

/** Runs a clock for a time at a speed, times real time. Returns the ticks of the sent views. */
function sent(speed, ms) {
  let now_ms = 0;
  let tick = 0;
  const timers = [];
  const posted = [];
  mock.method(performance, "now", () => now_ms);
  mock.method(globalThis, "setTimeout", (run, wait_ms) => timers.push({ run, at_ms: now_ms + wait_ms }));
  mock.method(globalThis, "clearTimeout", () => timers.splice(0));
  globalThis.MessageChannel = class {
    port1 = {};
    port2 = { postMessage: () => timers.push({ run: () => this.port1.onmessage(), at_ms: now_ms }) };
  };
  const due_ms = () => (tick * STEP_MS) / speed;
  const program = {
    advance(at_ms, ticks) {
      for (let done = 0; done < ticks && due_ms() <= at_ms; done += 1) tick += 1;
      return Math.max(0, due_ms() - at_ms);
    },
    frames: () => [tick],
  };
  const runner = new Runner(program, 1000, ({ frames }) => {
    posted.push(frames[0]);
    runner.shown();
  });
  runner.start();
  while (timers.length && timers[0].at_ms <= ms) {
    const { run, at_ms } = timers.shift();
    now_ms = at_ms;
    run();
  }
  mock.restoreAll();
  return posted;
}

test("no view is sent twice while the clock runs", () => {
  const ticks = sent(1, 10_000);
  assert.deepEqual(ticks, [...new Set(ticks)]);
  assert.ok(ticks.length >= 200, `${ticks.length} views of 200 ticks`);
  const fast = sent(8, 10_000);
  assert.deepEqual(fast, [...new Set(fast)]);
  assert.ok(fast.length >= 300, `${fast.length} views in 10 s`);
});

test("a slow clock sends a view per second, so that the page does not take it for frozen", () => {
  const ticks = sent(0.01, 10_000);
  assert.ok(ticks.length >= 10, `${ticks.length} views in 10 s`);
});

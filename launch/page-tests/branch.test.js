// Tests the command of a branch.

import assert from "node:assert/strict";
import { test } from "node:test";

import { CONTINUATIONS, branchCommand, branchRefusal } from "../page/model/branch.js";

test("the command names the run, the time and the faults", () => {
  const run = { folder: "/home/a/runs/first" };
  const start = "alliance run --from /home/a/runs/first --at";
  assert.equal(branchCommand(run, 31_250, "none"), `${start} 31.25s --faults none`);
  assert.equal(branchCommand(run, 0, null), `${start} 0s`);
  assert.equal(branchCommand(run, 60_000, "my faults.toml"), `${start} 60s --faults 'my faults.toml'`);
  const odd = { folder: "/a/it's $HOME" };
  assert.equal(branchCommand(odd, 50, null), "alliance run --from '/a/it'\\''s $HOME' --at 0.05s");
  assert.deepEqual(
    CONTINUATIONS.map(([value]) => value),
    ["none", "faults.toml", null],
  );
});

test("a branch needs a run that has ended, and a time before its end", () => {
  const refusal = (outcome, tick) => branchRefusal({ log: { outcome, ticks: 100 } }, tick);
  assert.equal(refusal("complete", 99), null);
  assert.match(refusal("complete", 100), /earlier/);
  assert.equal(refusal("interrupted", 100), null);
  assert.match(refusal("running", 50), /has ended/);
});

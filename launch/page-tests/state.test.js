// Tests the state of the run on the page.

import assert from "node:assert/strict";
import { test } from "node:test";

import { stateOf } from "../page/model/state.js";

test("only the end of the run is an end, not that of the page's server", () => {
  const view = { tick: 7, robots: [], clock: { waits_for: null } };
  const state = (ended, clockwork = { paused: false }) => stateOf({ view, ended, isFrozen: false, isOpen: ended === null }, clockwork);
  assert.equal(state(null), "running");
  assert.equal(state({ isDisconnected: true }), "disconnected");
  assert.equal(state({ outcome: "complete", folder: "runs/a" }), "ended");
  assert.equal(state(null, { paused: true, atEnd: true }), "ended");
  assert.equal(state(null, { paused: true }), "paused");
});

// Tests the signs on the discs of robots.

import assert from "node:assert/strict";
import { test } from "node:test";

import { signs } from "../page/model/signs.js";

test("a sign is the number at the end of the name, or its first letters", () => {
  assert.deepEqual(signs(["gold", "green", "blue"]), ["Go", "Gr", "B"]);
  assert.deepEqual(signs(["r1", "r2", "r12"]), ["1", "2", "12"]);
});

test("equal numbers have the initials of their names", () => {
  assert.deepEqual(signs(["scout1", "scout2", "hauler2"]), ["1", "S2", "H2"]);
});

// Tests the expected quality of a link.

import assert from "node:assert/strict";
import { test } from "node:test";

import { reception } from "../page/model/channel.js";

const wall = { min: [4, 1], max: [5, 3], penetrability: 0 };
const patch = { ...wall, penetrability: 0.5 };

test("fading follows the closed form", () => {
  const fading = { d0_m: 8, path_loss_exponent: 2 };
  assert.equal(reception({ range_m: null, fading }, [0, 0], [0, 8], []), Math.exp(-1));
  assert.equal(reception({ range_m: null, fading }, [4, 0], [0, 0], []), Math.exp(-0.25));
  assert.equal(reception({ range_m: 3, fading }, [4, 0], [0, 0], []), 0);
  assert.equal(reception(undefined, [4, 0], [0, 0], [wall]), 1);
});

test("only solid obstacles on the line block, and only if walls do", () => {
  const blocks = { range_m: null, walls: "block" };
  for (const [from, to, expected] of [
    [[0, 2], [9, 2], 0],
    [[9, 2], [0, 2], 0],
    [[0, 0], [9, 4], 0],
    [[4.5, 0], [4.5, 9], 0],
    [[0, 2], [3.9, 2], 1],
    [[0, 4], [9, 4], 1],
    [[3, 0], [3, 9], 1],
    [[0, 3], [3, 9], 1],
  ]) {
    assert.equal(reception(blocks, from, to, [wall]), expected, `${from} to ${to}`);
  }
  assert.equal(reception(blocks, [0, 2], [9, 2], [patch]), 1);
  assert.equal(reception({ range_m: null }, [0, 2], [9, 2], [wall]), 1);
});

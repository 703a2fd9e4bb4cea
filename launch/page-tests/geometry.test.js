// Tests the projection of rooms with an origin, and of large rooms.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Lens, Projection } from "../page/room/geometry.js";

/** Returns the projection of a whole room onto a canvas of 220 × 120 px with a margin of 10 px. */
function whole(room) {
  return new Projection(room, 220, 120, 10, new Lens(room));
}

test("a room lies in the middle of the canvas, wherever its origin is", () => {
  for (const [x_m, y_m] of [
    [0, 0],
    [-64, 32],
  ]) {
    const projection = whole({ x_m, y_m, width_m: 20, height_m: 10 });
    assert.deepEqual([projection.x(x_m), projection.y(y_m)], [10, 110]);
    assert.deepEqual(projection.point(110, 60), { x: x_m + 10, y: y_m + 5 });
  }
  const without = whole({ width_m: 20, height_m: 10 });
  assert.deepEqual([without.x(0), without.y(10)], [10, 10]);
});

test("a room of 100 km is shown whole, and magnified up to single robots", () => {
  const room = { x_m: -50000, y_m: -50000, width_m: 100000, height_m: 100000 };
  const projection = whole(room);
  assert.ok(Math.abs(projection.x(50000) - projection.x(-50000) - 100) < 1e-6);
  const lens = new Lens(room);
  lens.magnify(1e9, { x: 49999, y: 0 });
  assert.equal(lens.zoom, 4000);
  lens.lookAt({ x: 60000, y: -70000 });
  assert.deepEqual(lens.center, { x: 50000, y: -50000 });
});

// Tests faults and devices that the page does not contain.

import assert from "node:assert/strict";
import { test } from "node:test";

import { devicesOf } from "../page/model/devices.js";
import { fieldsOf, groupsIn, label, letters, modeOf, ownFault } from "../page/model/own_faults.js";
import { faultInWords, sentence } from "../page/ui/words.js";

const SHAKE = {
  name: "shake-floor",
  about: "shakes the floor",
  arguments: [{ key: "x_m" }, { key: "y_m" }, { key: "times" }],
  place: ["x_m", "y_m"],
  item: null,
};

test("the place of a fault is a click on the floor, all other arguments are fields", () => {
  assert.equal(label(SHAKE), "Shake floor");
  assert.equal(sentence(SHAKE.about), "Shakes the floor");
  assert.deepEqual(fieldsOf(SHAKE), [{ key: "times" }]);
  assert.deepEqual(ownFault(SHAKE, { times: 2 }, { x: 3, y: 4.5 }), { "shake-floor": { times: 2, x_m: 3, y_m: 4.5 } });
});

test("an empty field selects the mission's default", () => {
  assert.deepEqual(ownFault(SHAKE, { times: NaN }, { x: 3, y: 4.5 }), { "shake-floor": { x_m: 3, y_m: 4.5 } });
});

test("a fault without a place has a field for every argument", () => {
  const blow = { name: "blow", arguments: [{ key: "x_m" }, { key: "speed_m_s" }], place: null };
  assert.equal(fieldsOf(blow).length, 2);
  assert.deepEqual(ownFault(blow, { x_m: 1, speed_m_s: 2 }, null), { blow: { x_m: 1, speed_m_s: 2 } });
});

test("groups and modes have the form of files", () => {
  assert.deepEqual(groupsIn("blue, gold / green"), [["blue", "gold"], ["green"]]);
  const mode = { name: "dead", from: null, words: null, takes_deg: false };
  assert.equal(modeOf(mode, null, false), "dead");
  assert.deepEqual(modeOf({ ...mode, name: "slowed", from: 0 }, 0.5, false), { slowed: 0.5 });
  assert.deepEqual(modeOf({ ...mode, name: "one-wheel", words: ["left", "right"] }, "left", false), { "one-wheel": "left" });
  assert.deepEqual(modeOf({ ...mode, name: "bias", from: -1, takes_deg: true }, 0.2, NaN), { bias: { m: 0.2, deg: 0 } });
});

test("each fault has its own key while keys are free", () => {
  const named = (...names) => names.map((name) => ({ name }));
  assert.deepEqual(letters(named("waste", "move-waste", "was", "sa"), ["m", "o", "s"]), ["w", "v", "a", null]);
});

test("a fault is formatted as on the command line", () => {
  const fault = { "shake-floor": { y_m: 4.5, x_m: 3, times: 2 } };
  assert.equal(faultInWords(fault, []), "shake-floor --times 2 --x-m 3 --y-m 4.5");
});

test("a robot has the common devices and its own", () => {
  const devices = [{ name: "position" }, { name: "side-border", is_optional: true }, { name: "nose", is_optional: true }];
  const robots = [{ side_sensor: true }, { side_sensor: false }, { side_sensor: false, devices: ["nose"] }];
  const names = (rank) => devicesOf({ devices, scenario: { robots } }, rank).map(({ name }) => name);
  assert.deepEqual(names(0), ["position", "side-border"]);
  assert.deepEqual(names(1), ["position"]);
  assert.deepEqual(names(2), ["position", "nose"]);
});

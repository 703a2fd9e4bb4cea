// Tests the text form of declared faults.

import assert from "node:assert/strict";
import { test } from "node:test";

import { affectsLink, foldFaults } from "../page/model/faults.js";
import { faultInWords, phasesInWords } from "../page/ui/words.js";

const position = { option: null, default: null, is_time: false };
const KINDS = [
  { name: "kill", arguments: [{ ...position, key: "robot" }] },
  {
    name: "drop",
    arguments: [
      { ...position, key: "from", option: "from" },
      { ...position, key: "to", option: "to" },
      { ...position, key: "p", option: "p" },
      { ...position, key: "burst_s", option: "burst", default: 0, is_time: true },
    ],
  },
  {
    name: "partition",
    arguments: [
      { ...position, key: "groups" },
      { ...position, key: "one_way", option: "one-way" },
    ],
  },
  {
    name: "sensor",
    arguments: ["robot", "device", "mode"].map((key) => ({ ...position, key })),
  },
];

test("a fault is formatted as its declaration states", () => {
  const words = (fault) => faultInWords(fault, KINDS);
  assert.equal(words({ kill: "gold" }), "kill gold");
  const drop = { from: "green", to: "all", p: 0.3, burst_s: 0 };
  assert.equal(words({ drop }), "drop --from green --to all --p 0.3");
  assert.equal(words({ drop: { ...drop, burst_s: 2.5 } }), "drop --from green --to all --p 0.3 --burst 2.5s");
  const groups = [["blue", "gold"], ["green"]];
  assert.equal(words({ partition: { groups, one_way: true } }), "green → blue,gold cut");
  assert.equal(words({ partition: { groups, one_way: false } }), "blue,gold ↔ green cut");
  const sensor = (mode) => words({ sensor: { robot: "gold", device: "position", mode } });
  assert.equal(sensor("dead"), "sensor gold position dead");
  assert.equal(sensor({ dropout: 0.25 }), "sensor gold position dropout 0.25");
  assert.equal(sensor({ bias: { m: 0.5, deg: 3 } }), "sensor gold position bias 0.5 --deg 3");
});

test("a fault that states ends of links affects these links", () => {
  const fault = { jam: { from: "green", to: "all" } };
  assert.equal(affectsLink(fault, "green", "gold"), true);
  assert.equal(affectsLink(fault, "gold", "green"), false);
  assert.equal(affectsLink({ kill: "gold" }, "gold", "green"), false);
});

test("a fault is one event with its phases, at its effect", () => {
  const event = (kind, subject, t_ms, group = "faults") => ({ kind, subject, t_ms, group, detail: "kill gold" });
  const events = [
    event("armed", "f1", 0),
    event("armed", "f2", 100),
    event("gone", "", 5000, "robots"),
    event("applied", "f1", 5000),
    event("hit", "f1", 5050),
  ];
  const folded = foldFaults(events);
  assert.deepEqual([...folded.keys()], [events[3], events[1]]);
  const { what, why } = phasesInWords(folded.get(events[3]));
  assert.equal(what, "f1: kill gold");
  assert.equal(why, "armed 0.00 s, takes effect 5.00 s, first effect 5.05 s");
});

// Tests the words and the state of a link that a fault cuts or holds.

import assert from "node:assert/strict";
import { test } from "node:test";

import { faultRows, linkState } from "../page/model/faults.js";
import { cutsInWords, faultInWords } from "../page/ui/words.js";

const position = { option: null, default: null, is_time: false };
const KINDS = [
  {
    name: "partition",
    arguments: [
      { ...position, key: "groups" },
      { ...position, key: "one_way", option: "one-way" },
    ],
  },
];
const oneWay = { partition: { groups: [["gold"], ["blue"]], one_way: true } };
const recent = { count: 20, lost: 3, late: 0 };

test("a cut is confirmed with its direction", () => {
  assert.equal(faultInWords(oneWay, KINDS), "blue → gold cut");
  assert.equal(faultInWords({ partition: { groups: [["gold"], ["blue"]], one_way: false } }, KINDS), "gold ↔ blue cut");
  const three = "partition gold / blue / green --one-way";
  assert.equal(cutsInWords(three), three);
  assert.equal(cutsInWords("partition gold,red / blue"), "gold,red ↔ blue cut");
  assert.equal(cutsInWords("partition gold,red / blue --one-way from tick 2"), "blue → gold,red cut from tick 2");
});

test("a cut has the same words after its end", () => {
  const event = { kind: "healed", subject: "f3", detail: "partition gold / blue --one-way", t_ms: 5 };
  assert.equal(faultRows({ faults: [] }, [event], KINDS)[0].words, faultInWords(oneWay, KINDS));
});

test("a link that is cut has no share of losses from before the cut", () => {
  assert.deepEqual(linkState(recent, [oneWay], "blue", "gold"), { count: 20, loss: 0.15, isCut: true, isHeld: false });
  assert.deepEqual(linkState(recent, [oneWay], "gold", "blue"), { count: 20, loss: 0.15, isCut: false, isHeld: false });
  assert.equal(linkState({ count: 0, lost: 0, late: 0 }, [oneWay], "blue", "gold").isCut, true);
  assert.equal(linkState(recent, [{ mute: "blue" }], "blue", "green").isCut, true);
  const drop = (p) => [{ drop: { from: "all", to: "all", p } }];
  assert.deepEqual([0.3, 1].map((p) => linkState(recent, drop(p), "blue", "gold").isCut), [false, true]);
});

test("a link with held messages is not good", () => {
  const hold = [{ hold: { from: "blue", to: "all" } }];
  const held = linkState({ count: 20, lost: 0, late: 0 }, hold, "blue", "gold");
  assert.deepEqual(held, { count: 20, loss: 0, isCut: false, isHeld: true });
  assert.equal(linkState(recent, hold, "gold", "blue").isHeld, false);
  assert.equal(linkState(recent, [...hold, oneWay], "blue", "gold").isHeld, false);
});

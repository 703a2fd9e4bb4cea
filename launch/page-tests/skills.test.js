// What the page makes of skills, and of marks of several kinds.

import assert from "node:assert/strict";
import { test } from "node:test";

import { skillsOf } from "../page/model/skills.js";
import { kindColor } from "../page/ui/colors.js";
import { faultInWords } from "../page/ui/words.js";

test("a robot has the skills that are stated, or all of them", () => {
  const robots = [{ skills: { dust: 0.5, floor: 0 } }, {}];
  const run = { skills: ["garbage", "dust", "floor"], scenario: { robots } };
  assert.deepEqual(skillsOf(run, 0), ["dust"]);
  assert.deepEqual(skillsOf(run, 1), ["garbage", "dust", "floor"]);
});

test("a worse skill is told as the command line takes it", () => {
  assert.equal(faultInWords({ skill: { robot: "gold", skill: "dust", share: 0.3 } }), "skill gold dust 0.3");
});

test("marks of several kinds have a color for each", () => {
  assert.notEqual(kindColor("0/p1"), kindColor("1/p2"));
  assert.equal(kindColor("2/p1"), kindColor("2/p9"));
  assert.equal(kindColor("report-site"), null);
});

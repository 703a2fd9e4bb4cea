// Tests skills and marks of several kinds.

import assert from "node:assert/strict";
import { test } from "node:test";

import { skillsOf } from "../page/model/skills.js";
import { kindColor } from "../page/ui/colors.js";

test("a robot has its stated skills, or all skills without any stated", () => {
  const robots = [{ skills: { dust: 0.5, floor: 0 } }, {}];
  const run = { skills: ["garbage", "dust", "floor"], scenario: { robots } };
  assert.deepEqual(skillsOf(run, 0), ["dust"]);
  assert.deepEqual(skillsOf(run, 1), ["garbage", "dust", "floor"]);
});

test("marks of several kinds have a color per kind", () => {
  const hues = ["#111111", "#222222"];
  assert.deepEqual(["0/p1", "1/p2", "2/p9", "report-site"].map((id) => kindColor(id, hues)), [hues[0], hues[1], hues[0], null]);
});

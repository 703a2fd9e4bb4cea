// Tests the links of the playground.

import assert from "node:assert/strict";
import { test } from "node:test";

import { choiceOf, linkOf } from "../page/model/choice.js";

test("a link contains a choice", async () => {
  const choice = { scenario: "waste-cleanup", allocator: "a b&c=d#é", seed: "18446744073709551615", limit_s: 60.5 };
  const link = "#scenario=waste-cleanup&allocator=a%20b%26c%3Dd%23%C3%A9&seed=18446744073709551615&limit_s=60.5";
  assert.equal(await linkOf(choice), link);
  assert.deepEqual(await choiceOf(link), choice);
  const pair = { allocator: "grape", beside: "cbba" };
  assert.equal(await linkOf(pair), "#allocator=grape&beside=cbba");
  assert.deepEqual(await choiceOf("#allocator=grape&beside=cbba"), pair);
  const short = { scenario: "janitorial", allocator: "", seed: "1", orders: [] };
  assert.equal(await linkOf(short), "#scenario=janitorial&seed=1");
  for (const empty of ["", "#"]) assert.deepEqual(await choiceOf(empty), {});
});

test("a link contains orders", async () => {
  const orders = Array.from({ length: 100 }, (_, at) => [at, { fault: { fault: { kill: `r${at}é` } } }]);
  const link = await linkOf({ seed: "2", orders });
  assert.match(link, /^#seed=2&orders=[A-Za-z0-9_-]+$/);
  assert.ok(link.length < 1000, `${link.length}`);
  assert.deepEqual(await choiceOf(link), { seed: "2", orders });
  const word = link.split("&")[1];
  for (const damaged of [word.slice(0, -3), `${word.slice(0, 40)}A${word.slice(41)}`, `${word}*`, "orders=AAAA"]) {
    if (damaged !== word) await assert.rejects(choiceOf(`#${damaged}`), /This link is damaged at 'orders=/);
  }
});

test("a damaged link is refused with the damaged word", async () => {
  for (const word of ["scenario", "scenario=", "speed=3", "seed=1=2", "seed=%E0%A4%A"]) {
    const message = `This link is damaged at '${word}': copy it once more, or choose a run above`;
    await assert.rejects(choiceOf(`#allocator=cbba&${word}`), { message });
  }
  await assert.rejects(choiceOf("#seed=1&seed=2"), /damaged at 'seed=2'/);
  await assert.rejects(choiceOf("#limit_s=soon"), { message: "limit_s in this link is no number: choose a run above" });
});

test("a link contains a scenario and the version of the program", async () => {
  const choice = { file: { name: "mine.toml", text: `# Räume\n${"[[obstacles]]\n".repeat(200)}` }, seed: "2" };
  const link = await linkOf(choice, "0.1.0");
  assert.match(link, /^#version=0\.1\.0&file=[A-Za-z0-9_-]+&seed=2$/);
  assert.ok(link.length < 250, `${link.length}`);
  assert.deepEqual(await choiceOf(link, "0.1.0"), choice);
  await assert.rejects(choiceOf(link.replace("&seed", "A&seed"), "0.1.0"), /This link is damaged at 'file=/);
});

test("a link of another version is refused with the remedy", async () => {
  const message =
    "This link is of version 0.2.0 and this page is of version 0.1.0: open it in a page of version 0.2.0, or choose a run above";
  // Also if it has words that this version does not have.
  for (const link of ["#version=0.2.0&seed=1", "#version=0.2.0&speed=3", "#seed=%E0&version=0.2.0"]) {
    await assert.rejects(choiceOf(link, "0.1.0"), { message });
  }
  await assert.rejects(choiceOf("#version=<b>&seed=1", "0.1.0"), /This link is damaged at 'version=<b>'/);
  assert.deepEqual(await choiceOf("#version=0.1.0&seed=1", "0.1.0"), { seed: "1" });
});

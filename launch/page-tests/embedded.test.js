// Tests the run inside a file against the answers of the server, which a test of the program writes.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";

import { applyChange } from "../page/source/delta.js";
import { Embedded } from "../page/source/embedded.js";

/** Returns a document with the data elements of the file, after a change of their texts. */
function documentOf(html, changed = (name, text) => text) {
  const parts = new Map();
  for (const [, name, text] of html.matchAll(/data-part="([^"]+)">([^<]*)</g)) parts.set(name, changed(name, text));
  const [, index] = html.match(/id="embedded-run">([^<]*)</) ?? [null, null];
  return {
    getElementById: (id) => (id === "embedded-run" && index !== null ? { textContent: index } : null),
    querySelector: (selector) => ({ textContent: parts.get(selector.split('"')[1]) }),
    querySelectorAll: () => [...parts.keys()],
  };
}

test("a change replaces only what it names", () => {
  const before = { tick: 1, robots: [{ x: 1, on: null }, { x: 2, on: [3] }], items: [] };
  const after = applyChange(before, { tick: 2, robots: { 1: { on: [[4]] } }, items: [[7]] });
  assert.deepEqual(after, { tick: 2, robots: [{ x: 1, on: null }, { x: 2, on: [4] }], items: [7] });
  assert.equal(after.robots[0], before.robots[0]);
  assert.deepEqual(before, { tick: 1, robots: [{ x: 1, on: null }, { x: 2, on: [3] }], items: [] });
  assert.deepEqual(applyChange(before, {}), before);
});

test("a page of a server has no run inside", () => {
  assert.equal(Embedded.in(documentOf("<p>")), null);
});

const { ALLIANCE_FILE, ALLIANCE_ANSWERS } = process.env;
const options = { skip: ALLIANCE_FILE === undefined };
const html = ALLIANCE_FILE && readFileSync(ALLIANCE_FILE, "utf8");
const answers = ALLIANCE_ANSWERS && JSON.parse(readFileSync(ALLIANCE_ANSWERS, "utf8"));

test("the file gives the answers of the server", options, async () => {
  const file = Embedded.in(documentOf(html));
  const run = await file.run();
  assert.equal(run.log.hash, answers.hash);
  assert.deepEqual(await file.views({ from: 0, count: 1000, step: 1 }), answers.views);
  // From the middle, with a step, and beyond the end.
  const [from, step] = [Math.floor(answers.views.length / 2), 16];
  const thinned = answers.views.slice(from).filter((_, index) => index % step === 0);
  assert.deepEqual(await Embedded.in(documentOf(html)).views({ from, count: 1000, step }), thinned);
  assert.deepEqual(await file.views({ from: 1e6, count: 3, step: 1 }), []);
  assert.deepEqual(await file.overview(), answers.overview);
  assert.deepEqual(await file.events(), answers.events);
  for (const [rank, corners] of answers.corners.entries()) assert.deepEqual(await file.corners(rank), corners);
});

test("damaged data give one sentence", options, async () => {
  const damaged = { message: /^This file is damaged: .*alliance export/ };
  const other = (text) => text.slice(0, 40) + (text[40] === "A" ? "B" : "A") + text.slice(41);
  const short = Embedded.in(documentOf(html, (name, text) => text.slice(0, -8)));
  await assert.rejects(short.run(), damaged);
  const wrong = Embedded.in(documentOf(html, (name, text) => (name === "views/0" ? other(text) : text)));
  await wrong.run();
  await assert.rejects(wrong.views({ from: 0, count: 3, step: 1 }), damaged);
  // A file that was cut off lacks its last parts.
  const cut = Embedded.in(documentOf(html.slice(0, html.lastIndexOf("data-part"))));
  await assert.rejects(cut.run(), damaged);
});

test("a browser that cannot unpack gives one sentence", options, async () => {
  const { DecompressionStream } = globalThis;
  globalThis.DecompressionStream = undefined;
  try {
    await assert.rejects(Embedded.in(documentOf(html)).run(), { message: /^This browser cannot unpack the run: / });
  } finally {
    globalThis.DecompressionStream = DecompressionStream;
  }
});

// Tests the changes of an edited scenario.

import assert from "node:assert/strict";
import { test } from "node:test";

import {
  Versions,
  decode,
  dragged,
  firstDifference,
  gridOf,
  lineAt,
  neighbor,
  plainName,
  rangeOfLine,
  rectangleBetween,
  shifted,
  snap,
} from "../page/model/draft.js";

/** Returns the file that the versions of a test have. */
const of = (text) => ({ name: "mine.toml", text });

test("versions are undone and redone", () => {
  const versions = new Versions(of("a"));
  assert.ok(!versions.canUndo && !versions.canRedo);
  versions.add(of("b"), null, 0);
  versions.add(of("b"), null, 0);
  versions.add(of("c"), null, 0);
  versions.undo();
  assert.equal(versions.file.text, "b");
  versions.redo();
  assert.equal(versions.file.text, "c");
  assert.ok(!versions.canRedo);
  versions.undo();
  versions.undo();
  versions.undo();
  assert.equal(versions.file.text, "a");
  // A new version removes those that were undone.
  versions.add(of("d"), null, 0);
  assert.ok(!versions.canRedo);
  versions.undo();
  assert.equal(versions.file.text, "a");
});

test("versions are restored with their place", () => {
  const versions = new Versions(of("a"));
  for (const text of ["b", "c", "d"]) versions.add(of(text), null, 0);
  versions.undo();
  const saved = versions.save(1000);
  const restored = Versions.restore(saved);
  assert.equal(restored.save(1000), saved);
  assert.deepEqual(restored.file, of("c"));
  restored.redo();
  assert.equal(restored.file.text, "d");
  assert.ok(!restored.canRedo);
  for (const text of ["c", "b", "a"]) {
    restored.undo();
    assert.equal(restored.file.text, text);
  }
  assert.ok(!restored.canUndo);
  // Each file has 31 letters. The oldest ones are left out first, and the present one stays.
  const texts = (max) => JSON.parse(versions.save(max)).files.map(({ text }) => text).join("");
  assert.deepEqual([1000, 127, 126, 95, 63, 0].map(texts), ["abcd", "abcd", "bcd", "bcd", "cd", "c"]);
  assert.deepEqual(Versions.restore(versions.save(0)).file, of("c"));
});

test("texts that are no versions restore none", () => {
  for (const text of [null, "", "7", "{}", '{"files":[],"place":0}', '{"files":[{"name":"a"}],"place":0}', '{"files":[{"name":"a","text":""}],"place":1}']) {
    assert.equal(Versions.restore(text), null, text);
  }
});

test("typing without a pause is one version", () => {
  const versions = new Versions(of(""));
  versions.add(of("h"), "typing", 0);
  versions.add(of("he"), "typing", 900);
  versions.add(of("hey"), "typing", 2000);
  versions.add(of("hey!"), "move robot 1", 2100);
  versions.undo();
  assert.equal(versions.file.text, "hey");
  versions.undo();
  assert.equal(versions.file.text, "he");
  // Typing after an undo is a version of its own.
  versions.add(of("her"), "typing", 2200);
  versions.undo();
  assert.equal(versions.file.text, "he");
  versions.undo();
  assert.equal(versions.file.text, "");
});

test("only the newest versions are kept", () => {
  const versions = new Versions(of("0"));
  for (let at = 1; at <= 600; at += 1) versions.add(of(`${at}`), null, 0);
  while (versions.canUndo) versions.undo();
  assert.equal(versions.file.text, "101");
});

test("the grid suits the room", () => {
  assert.equal(gridOf({ width_m: 12, height_m: 9 }), 0.05);
  assert.equal(gridOf({ width_m: 1.2, height_m: 1.2 }), 0.005);
  assert.equal(gridOf({ width_m: 9, height_m: 400 }), 0.5);
  assert.equal(snap(3.14159, 0.05), 3.15);
  assert.equal(snap(-0.026, 0.05), -0.05);
});

test("a drag moves, enlarges or turns an item", () => {
  const box = { x_m: 1, y_m: 2, numbers: { width_m: 2, height_m: 1 } };
  const from = { x: 3, y: 3 };
  assert.deepEqual(dragged(box, null, from, { x: 3.52, y: 2.5 }, 0.05), { x_m: 1.5, y_m: 1.5 });
  assert.deepEqual(dragged(box, "corner", from, { x: 4, y: 0 }, 0.05), { x_m: 1, y_m: 2, width_m: 3, height_m: 0.05 });
  const robot = { x_m: 1, y_m: 2, numbers: { heading_deg: 0 } };
  assert.deepEqual(dragged(robot, "heading", from, { x: 1, y: 9 }, 0.05), { x_m: 1, y_m: 2, heading_deg: 90 });
  assert.equal(dragged(robot, "heading", from, { x: 0, y: 1.9 }, 0.05).heading_deg, -175);
});

test("a rectangle is between any two corners, or has its default size", () => {
  const [a, b] = [{ x: 3.01, y: 1 }, { x: 1, y: 2.5 }];
  const expected = { x_m: 1, y_m: 1, width_m: 2, height_m: 1.5 };
  assert.deepEqual(rectangleBetween(a, b, 0.05), expected);
  assert.deepEqual(rectangleBetween(b, a, 0.05), expected);
  assert.deepEqual(rectangleBetween(a, a, 0.05), { x_m: 3, y_m: 1 });
});

test("outlines move", () => {
  assert.deepEqual(shifted({ disc: { center: [1, 2], radius_m: 3 } }, 1, -1), { disc: { center: [2, 1], radius_m: 3 } });
  assert.deepEqual(shifted({ rectangle: { min: [0, 0], max: [1, 1] } }, 1, 2), { rectangle: { min: [1, 2], max: [2, 3] } });
  const bar = { from: [0, 0], to: [0, 2], half_width_m: 0.1 };
  assert.deepEqual(shifted({ bar }, 1, 0), { bar: { from: [1, 0], to: [1, 2], half_width_m: 0.1 } });
});

test("the next item follows the last one", () => {
  const items = [0, 1, 2].map((index) => ({ kind: "robot", index }));
  assert.equal(neighbor(items, null, 1), items[0]);
  assert.equal(neighbor(items, null, -1), items[2]);
  assert.equal(neighbor(items, "robot 2", 1), items[0]);
  assert.equal(neighbor(items, "robot 0", -1), items[2]);
  assert.equal(neighbor([], null, 1), null);
});

test("lines and places of a text", () => {
  const text = "one\ntwo\n\nfour";
  assert.equal(lineAt(text, 0), 1);
  assert.equal(lineAt(text, 5), 2);
  assert.deepEqual(rangeOfLine(text, 2), [4, 7]);
  assert.deepEqual(rangeOfLine(text, 3), [8, 8]);
  assert.equal(firstDifference(text, "one\ntoo"), 5);
  assert.equal(firstDifference(text, text), text.length);
});

test("a name of a file needs no quotes", () => {
  assert.equal(plainName("mine.toml"), "mine.toml");
  assert.equal(plainName("my room (2).TOML"), "my-room-2-.toml");
  assert.equal(plainName("$(rm -rf).toml"), "rm--rf-.toml");
  assert.equal(plainName("räume"), "r-ume.toml");
  assert.equal(plainName("..."), "scenario.toml");
});

test("a file is UTF-8, and its first other byte has a line", () => {
  const text = "# Räume\n\nname = 'a'\n# end";
  const bytes = new TextEncoder().encode(text);
  assert.equal(decode("a.toml", bytes), text);
  assert.equal(decode("a.toml", new Uint8Array()), "");
  bytes[11] = 0xff;
  const message = "a.toml:3: the bytes are not UTF-8 text; save the file as UTF-8";
  assert.throws(() => decode("a.toml", bytes), { message });
});

// Tests events that arrive after later ones, and the event at the end of a run.

import assert from "node:assert/strict";
import { test } from "node:test";

import { Model } from "../page/model/model.js";
import { eventInWords } from "../page/ui/words.js";

const RUN = {
  mode: "live",
  log: null,
  scenario: { robots: [{ name: "gold" }, { name: "green" }], step_ms: 50 },
  catalog: { tasks: [{ name: "dig" }, { name: "rest" }], sets: [{ name: "dig", task: 0 }, { name: "rest", task: 1 }] },
  colors: { robots: ["#000", "#111"], tasks: ["#222"] },
  mission: { events: ["found"] },
};

const event = (t_ms, kind, robot, subject = "", reason = "", detail = "") => ({ t_ms, kind, robot, subject, reason, detail });

function modelAt(now) {
  const model = new Model(RUN, () => {});
  model.view = { tick: now / 50, now, robots: [] };
  return model;
}

test("a takeover stands after the events of its own time, although it arrives later", () => {
  const model = modelAt(900);
  model.addEvents([event(100, "gone", "gold"), event(800, "activated", "green", "dig"), event(850, "found", "green")]);
  model.addEvents([event(800, "took-over", "green", "dig", "gold", "0.70 s after its death")]);
  assert.deepEqual(
    model.events.map(({ kind, group }) => `${kind} ${group}`),
    ["gone robots", "activated tasks", "took-over takeovers", "found mission"],
  );
  assert.equal(model.recentTakeovers(1000).get(1)?.reason, "gold");
  assert.equal(model.recentTakeovers(1000).get(0), undefined);
  model.addEvents([event(860, "detected", "green", "dig", "gold"), event(870, "detected", "gold", "dig", "green")]);
  assert.equal(model.recentTakeovers(1000).get(1)?.kind, "took-over");
  assert.equal(model.recentTakeovers(1000).get(0)?.kind, "detected");
  // The events are known since 900 ms.
  assert.equal(model.recentTakeovers(30).get(1)?.kind, "took-over");
  model.view = { tick: 19, now: 950, robots: [] };
  assert.equal(model.recentTakeovers(30).get(1), undefined);
});

test("takeovers, detections and the end have words", () => {
  const words = (...args) => eventInWords(event(0, ...args), ["gold", "green"]);
  const delay = "4.45 s after its death";
  assert.deepEqual(words("took-over", "green", "dig", "gold", delay), { what: "takes over dig from gold", why: delay });
  const detected = { what: "notices the loss of gold", why: `${delay}: impatience for dig rises` };
  assert.deepEqual(words("detected", "green", "dig", "gold", delay), detected);
  assert.equal(words("ended", "", "complete").what, "The mission is complete");
  assert.equal(words("ended", "", "time-limit").what, "The run ends: time-limit");
});

test("a live run ends once", () => {
  const model = modelAt(5000);
  model.setEnded({ outcome: "complete", folder: "runs/a" });
  model.setEnded({ isDisconnected: true });
  assert.deepEqual(model.events.map(({ kind, t_ms }) => [kind, t_ms]), [["ended", 5000]]);
  // Without an outcome nothing is known about the end.
  const lost = modelAt(5000);
  lost.setEnded({ isDisconnected: true });
  assert.deepEqual(lost.events, []);
});

// The progress of the mission and the state of the run.

import { shellWord } from "../model/branch.js";
import { details, progress } from "../model/mission.js";
import { showBar } from "../ui/bars.js";
import { attribute, byId, text } from "../ui/dom.js";

export function drawMission(model) {
  const { view, now, run } = model;
  if (!view) return;
  const { columns } = run.mission;
  const current = progress(columns, view.mission);
  // Without a bar, the two texts are a list.
  const comma = current && current.share === null ? "," : "";
  text(byId("progress-count"), current ? current.count + comma : "");
  text(byId("progress-what"), current ? current.what : "");
  const bar = byId("progress-bar");
  bar.hidden = (current?.share ?? null) === null;
  if (!bar.hidden) bar.value = current.share;
  const texts = details(columns, view.mission, now);
  text(byId("mission-details"), texts.join(", "));
  byId("mission-details").title = texts.join("\n");
  attribute(byId("mission"), "data-done", current ? current.done : null);
}

/**
 * Sets the document's mode, state and tick, and the state texts. `state`: connecting, waiting, running, paused,
 * standing, frozen, disconnected or ended. `isLoading`: the views of a log at the wanted time have not arrived.
 */
export function drawState(model, state, isLoading) {
  const { body } = document;
  body.dataset.mode = model.run.mode;
  body.dataset.state = state;
  body.dataset.tick = model.view ? model.view.tick : "";
  text(byId("state"), isLoading ? "loading" : state);
  body.toggleAttribute("data-loading", isLoading);
  if (model.isLive) {
    const { run } = model.run;
    if (state === "frozen") {
      const line = "The world has sent nothing for some seconds; its process may be stopped. See:";
      showBar("warning", line, `alliance status --run ${run}`);
    } else {
      showBar("warning", state === "standing" ? `The clock waits for ${model.view?.clock.waits_for}.` : null);
    }
  }
  if (!model.ended) return;
  const { outcome, folder, isDisconnected, stopped } = model.ended;
  const result = outcome ? `The run is over: ${outcome}.` : "The run stopped unexpectedly.";
  if (stopped) {
    showBar("ended", stopped);
  } else if (model.run.command) {
    showBar("ended", `${result} Without orders of this page, the program repeats it with:`, model.run.command);
  } else if (isDisconnected) {
    const line = "The process that serves this page has ended; the run may still go on. Open it again with:";
    showBar("ended", line, `alliance watch ${model.run.run}`);
  } else if (model.run.stays) {
    showBar("ended", `${result} Its log opens here.`);
  } else {
    showBar("ended", `${result} View it again with:`, `alliance watch ${shellWord(folder)}`);
  }
}

// How the mission goes, in its own words, and what the page and the run are up to.

import { details, progress } from "../model/mission.js";
import { attribute, byId, text } from "../ui/dom.js";

/** Shows the figures of the newest view. */
export function drawMission(model) {
  const { view, now, run } = model;
  if (!view) return;
  const { columns } = run.mission;
  const so_far = progress(columns, view.mission);
  text(byId("progress-count"), so_far ? `${so_far.done} of ${so_far.total}` : "");
  text(byId("progress-what"), so_far ? so_far.what : "");
  const rest = details(columns, view.mission, now);
  text(byId("mission-details"), rest.join(", "));
  byId("mission-details").title = rest.join("\n");
  attribute(byId("mission"), "data-done", so_far ? so_far.done : null);
}

/** Keeps the document's mode, state and tick. `state`: connecting, waiting, running, paused or ended. */
export function drawState(model, state) {
  const { body } = document;
  body.dataset.mode = model.run.mode;
  body.dataset.state = state;
  body.dataset.tick = model.view ? model.view.tick : "";
  text(byId("state"), state);
  if (model.isLive) {
    const warning = {
      frozen: `Nothing has come from the world for some seconds: its process may be stopped. See: alliance status --run ${model.run.run}`,
      standing: `The clock waits for ${model.view?.clock.waits_for}.`,
    }[state];
    byId("warning").hidden = warning === undefined;
    text(byId("warning"), warning ?? "");
  }
  const ended = byId("ended");
  ended.hidden = model.ended === null;
  if (model.ended) {
    const { outcome, folder, isServerGone } = model.ended;
    const next = model.run.stays ? "Its log follows here." : `Look at it again with: alliance view ${folder}`;
    const how = outcome ? `The run is over: ${outcome}.` : "The run has gone without a word.";
    text(
      ended,
      isServerGone
        ? `The process that serves this page has gone; the run may go on. See it again with: alliance watch ${model.run.run}`
        : `${how} ${next}`,
    );
  }
}

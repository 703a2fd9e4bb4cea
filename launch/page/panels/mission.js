// How the mission goes: items, the latest report, and what the page and the run are up to.

import { attribute, byId, text } from "../ui/dom.js";
import { seconds } from "../ui/words.js";

/** Shows the figures of the newest view. */
export function drawMission(model) {
  const { view, now } = model;
  if (!view) return;
  const { delivered, carried, in_spills, on_floor } = view.items;
  const total = delivered + carried + in_spills + on_floor;
  text(byId("delivered"), `${delivered} of ${total}`);
  text(byId("items-rest"), `${in_spills} in spills, ${carried} carried, ${on_floor} on the floor`);
  text(byId("last-report"), view.last_report === null ? "none yet" : `${seconds(now - view.last_report, 0)} ago`);
  attribute(byId("mission"), "data-delivered", delivered);
}

/** Keeps the document's mode, state and tick. `state`: connecting, waiting, running, paused or ended. */
export function drawState(model, state) {
  const { body } = document;
  body.dataset.mode = model.run.mode;
  body.dataset.state = state;
  body.dataset.tick = model.view ? model.view.tick : "";
  text(byId("state"), state);
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

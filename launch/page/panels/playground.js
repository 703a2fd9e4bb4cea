// The choice of a run in the playground, its link, and the hash of the shown run.

import { linkOf } from "../model/choice.js";
import { byId, el, text } from "../ui/dom.js";
import { notify } from "../ui/notices.js";
import { offerBeside } from "./beside.js";
import { showGallery } from "./gallery.js";

/**
 * Shows the form. `list`: the scenarios and allocators of the simulator. `choice`: the current run. `version`: that of this
 * page.
 */
export function showChoice(list, choice, version) {
  const option = (value, label, title) => el("option", { value, title }, label);
  const team = (robots) => `${robots} robot${robots === 1 ? "" : "s"}`;
  const scenarios = list.scenarios.map(({ name, robots, about }) => option(name, `${name} (${team(robots)})`, about));
  const { file } = choice;
  // An empty value is the scenario of the link.
  if (file) scenarios.unshift(option("", file.name, "The edited scenario of this link"));
  byId("choose-scenario").replaceChildren(...scenarios);
  const allocators = list.allocators.map(({ name, about }) => option(name, name, about));
  byId("choose-allocator").replaceChildren(option("", "the scenario's"), ...allocators);
  byId("choose-scenario").value = choice.scenario ?? (file ? "" : list.scenarios[0].name);
  byId("choose-allocator").value = choice.allocator ?? "";
  byId("choose-seed").value = choice.seed ?? "1";
  offerBeside(list, choice);
  showGallery(list.gallery);
  const form = byId("playground");
  form.hidden = false;
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const [scenario, allocator, beside, seed] = ["scenario", "allocator", "beside", "seed"].map((name) => byId(`choose-${name}`).value);
    const link = await linkOf({ scenario, file: scenario ? null : file, allocator, beside, seed }, version);
    // Another link starts the page again. The same one starts the run again.
    if (location.hash === link) location.reload();
    else location.hash = link;
  });
}

/** Makes the button for the link of the shown run, which has its choice and the orders so far. */
export function offerLink(engine, choice, version) {
  const share = byId("share");
  share.hidden = false;
  share.addEventListener("click", async () => {
    const orders = await engine.orders();
    // The address is the link also where the browser does not copy. No new run starts.
    history.replaceState(null, "", await linkOf({ ...choice, orders }, version));
    const content = `The link of this run has ${orders.length} order${orders.length === 1 ? "" : "s"}`;
    const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
    notify("done", copied ? `${content} and is copied` : `${content}: copy the address of this page`);
  });
}

export function drawHash(model) {
  byId("run-hash").hidden = model.hash === null;
  text(byId("run-hash"), model.hash === null ? "" : `hash ${model.hash}`);
}

// The choice of a run in the playground, and the hash of the shown run.

import { linkOf } from "../model/choice.js";
import { byId, el, text } from "../ui/dom.js";

/** Shows the form. `list`: the scenarios and allocators of the simulator. `choice`: the current run. */
export function showChoice(list, choice) {
  const option = (value, label, title) => el("option", { value, title }, label);
  const scenarios = list.scenarios.map(({ name, robots, about }) => option(name, `${name} (${robots} robot${robots === 1 ? "" : "s"})`, about));
  byId("choose-scenario").replaceChildren(...scenarios);
  const own = option("", "the scenario's");
  byId("choose-allocator").replaceChildren(own, ...list.allocators.map(({ name, about }) => option(name, name, about)));
  byId("choose-scenario").value = choice.scenario ?? list.scenarios[0].name;
  byId("choose-allocator").value = choice.allocator ?? "";
  byId("choose-seed").value = choice.seed ?? "1";
  const form = byId("playground");
  form.hidden = false;
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const [scenario, allocator, seed] = ["scenario", "allocator", "seed"].map((name) => byId(`choose-${name}`).value);
    const link = linkOf({ scenario, allocator, seed });
    // Another link starts the page again. The same one starts the run again.
    if (location.hash === link) location.reload();
    else location.hash = link;
  });
}

export function drawHash(model) {
  byId("run-hash").hidden = model.hash === null;
  text(byId("run-hash"), model.hash === null ? "" : `hash ${model.hash}`);
}

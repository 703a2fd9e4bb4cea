// The menu "Branch from here": the command that repeats a finished run up to the displayed time and goes on from there.
// The page of a finished run starts no processes, so the command is copied.

import { CONTINUATIONS, branchCommand, branchRefusal } from "../model/branch.js";
import { copyCommand } from "../ui/bars.js";
import { byId, el } from "../ui/dom.js";
import { closeMenu, openMenu, selectField } from "../ui/menu.js";
import { notify } from "../ui/notices.js";
import { seconds } from "../ui/words.js";

/** Opens the menu at the displayed time. */
export function openBranch({ run, view, now }, player) {
  if (!view) return;
  player.pause();
  const refusal = branchRefusal(run, view.tick);
  if (refusal) {
    notify("refused", refusal);
    return;
  }
  const choices = CONTINUATIONS.map(([value, words]) => [value ?? "", words]);
  const choice = selectField("Go on", choices, { "data-field": "continuation" });
  const command = el("textarea", { readonly: true, rows: 5, "aria-label": "Command", "data-field": "command", spellcheck: "false" });
  const write = () => {
    command.value = branchCommand(run, now, choice.input.value || null);
  };
  choice.input.addEventListener("change", write);
  write();
  const copy = async () => {
    command.select();
    if (await copyCommand(command.value)) closeMenu();
  };
  openMenu(
    `Branch at ${seconds(now, 2)}`,
    byId("branch"),
    el("p", {}, "This command repeats the run up to here, in the same bytes, and then goes on:"),
    run.log.is_file ? el("p", {}, `Type it in a terminal, beside the run's folder ${run.folder}.`) : null,
    el(
      "div",
      { class: "choices" },
      choice.element,
      command,
      el("button", { type: "button", "data-action": "copy", onclick: copy }, "Copy the command"),
    ),
  );
}

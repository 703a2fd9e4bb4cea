// Messages that stay: a warning, and the end of the run. They lie over the room, so that nothing moves when one appears.

import { attribute, byId, el, text } from "./dom.js";
import { notify } from "./notices.js";

// Element id → the line that the user has closed.
const closed = new Map();

/** Copies a command and shows a notice. Returns whether the browser allows it. */
export async function copyCommand(command) {
  try {
    await navigator.clipboard.writeText(command);
  } catch {
    notify("refused", "The browser does not copy: select the command and press Ctrl+C");
    return false;
  }
  notify("done", "The command is copied: run it in a terminal");
  return true;
}

/** Shows a line in the element `id`, with a button for the command that the line ends with, if any; null hides it. */
export function showBar(id, line, command = null) {
  const bar = byId(id);
  if (!bar.firstChild) {
    const copy = () => copyCommand(bar.dataset.command);
    const close = () => {
      closed.set(id, bar.firstChild.textContent);
      bar.hidden = true;
    };
    bar.append(
      el("span", {}),
      el("button", { type: "button", "data-action": "copy", onclick: copy }, "Copy"),
      el("button", { type: "button", class: "quiet", "aria-label": "Close this message", onclick: close }, "✕"),
    );
  }
  const shown = line === null ? null : command === null ? line : `${line} ${command}`;
  if (shown !== null) text(bar.firstChild, shown);
  attribute(bar, "data-command", command);
  bar.children[1].hidden = command === null;
  bar.hidden = shown === null || closed.get(id) === shown;
}

// Short notices in a corner of the page. Screen readers announce them.

import { byId, el } from "./dom.js";

const DURATION_MS = 8000;
const MAX_NOTICES = 2;

/** Shows a line for some seconds. `kind` is `done` or `refused`; `action`, if any, is `{label, run}`. */
export function notify(kind, line, action = null) {
  const close = () => notice.remove();
  const act =
    action && el("button", { type: "button", "data-action": "undo", onclick: () => (action.run(), close()) }, action.label);
  const dismiss = el("button", { type: "button", "aria-label": "Close this notice", class: "quiet", onclick: close }, "✕");
  const role = kind === "refused" ? "alert" : "status";
  const notice = el("div", { class: "notice", "data-notice": kind, role }, el("span", {}, line), act, dismiss);
  // A repeated line replaces the older one.
  for (const old of [...byId("notices").children]) if (old.firstChild.textContent === line) old.remove();
  byId("notices").prepend(notice);
  while (byId("notices").children.length > MAX_NOTICES) byId("notices").lastChild.remove();
  setTimeout(close, kind === "refused" ? 2 * DURATION_MS : DURATION_MS);
}

// Keyboard shortcuts and the list of them.

import { byId, el } from "./dom.js";

/** Tests whether the focused element or an open window uses the key itself. */
function isTaken(event) {
  const { target } = event;
  // In a window, too, a clicked button loses the focus to the page.
  if (document.querySelector("dialog:modal")) return true;
  if (event.ctrlKey || event.metaKey || event.altKey || target.closest("#menu")) return true;
  if (event.key === "Escape") return false;
  if (target.matches("select, textarea, input:not([type=checkbox], [type=range])")) return true;
  if (target.matches("input[type=range], [role=tab]") && event.key.startsWith("Arrow")) return true;
  // The space bar presses a focused button.
  return event.key === " " && target.matches("button, summary, a, input[type=checkbox]");
}

/**
 * Listens for `shortcuts`, a list of `{keys, shown, action, run}`: `keys` as in KeyboardEvent.key, `shown` and `action`
 * for users, and `run(event)`.
 */
export function startKeys(shortcuts) {
  // A clicked button loses the focus, otherwise the space bar would press it again. This happens before the click has
  // an effect, so that a menu action not return the focus to its button.
  document.addEventListener("click", ({ detail, target }) => detail > 0 && target.closest("button")?.blur(), true);
  document.addEventListener("pointerup", ({ target }) => target.matches?.("input[type=range]") && target.blur());
  const byKey = new Map(shortcuts.flatMap((shortcut) => shortcut.keys.map((key) => [key, shortcut])));
  document.addEventListener("keydown", (event) => {
    const shortcut = byKey.get(event.key);
    if (!shortcut || isTaken(event)) return;
    event.preventDefault();
    shortcut.run(event);
  });
  const rows = shortcuts.map(({ shown, action }) =>
    el("tr", {}, el("th", { scope: "row" }, el("kbd", {}, shown)), el("td", {}, action)),
  );
  byId("shortcuts").replaceChildren(...rows);
}

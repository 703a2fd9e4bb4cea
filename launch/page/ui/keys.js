// Keyboard shortcuts, and the list of them.

import { byId, el } from "./dom.js";

/** Where letters are typed or keys have a meaning of their own. */
function isTaken(event) {
  const { target } = event;
  if (event.ctrlKey || event.metaKey || event.altKey || target.closest("#menu, dialog")) return true;
  if (event.key === "Escape") return false;
  if (target.matches("select, textarea, input:not([type=checkbox], [type=range])")) return true;
  if (target.matches("input[type=range], [role=tab]") && event.key.startsWith("Arrow")) return true;
  // A button in focus is pressed by the space bar.
  return event.key === " " && target.matches("button, summary, a, input[type=checkbox]");
}

/**
 * Listens for `shortcuts`, a list of `{keys, shown, does, run}`: `keys` as in KeyboardEvent.key, `shown` and `does` for people;
 * `run(event)` does it.
 */
export function startKeys(shortcuts) {
  // What was clicked with a pointer gives the keyboard back: else the space bar would press it again. Before the click does
  // anything, so that a menu that it opens does not give the focus back to it.
  document.addEventListener("click", ({ detail, target }) => detail > 0 && target.closest("button")?.blur(), true);
  document.addEventListener("pointerup", ({ target }) => target.matches?.("input[type=range]") && target.blur());
  const byKey = new Map(shortcuts.flatMap((shortcut) => shortcut.keys.map((key) => [key, shortcut])));
  document.addEventListener("keydown", (event) => {
    const shortcut = byKey.get(event.key);
    if (!shortcut || isTaken(event)) return;
    event.preventDefault();
    shortcut.run(event);
  });
  const rows = shortcuts.map(({ shown, does }) =>
    el("tr", {}, el("th", { scope: "row" }, el("kbd", {}, shown)), el("td", {}, does)),
  );
  byId("shortcuts").replaceChildren(...rows);
}

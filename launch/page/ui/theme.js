// Dark and light theme: as in the system's settings, or as chosen here. The browser stores the choice.

import { attribute } from "./dom.js";

const KEY = "alliance-theme";
const system = matchMedia("(prefers-color-scheme: dark)");

/** Applies the theme and returns its name. */
export function showTheme() {
  const theme = localStorage.getItem(KEY) ?? (system.matches ? "dark" : "light");
  attribute(document.documentElement, "data-theme", theme);
  return theme;
}

/** Applies the theme and connects the button. `changed` is called after a change of colors. */
export function startTheme(button, changed) {
  const show = () => {
    button.setAttribute("aria-pressed", String(showTheme() === "dark"));
    changed();
  };
  system.addEventListener("change", show);
  button.addEventListener("click", () => {
    localStorage.setItem(KEY, document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    show();
  });
  show();
}

// Dark and light: as the system says, or as chosen here, which the browser remembers.

import { attribute } from "./dom.js";

const KEY = "alliance-theme";
const system = matchMedia("(prefers-color-scheme: dark)");

/** Applies the theme and makes the button switch it; `changed` is called whenever colors are others. */
export function startTheme(button, changed) {
  const show = () => {
    const theme = localStorage.getItem(KEY) ?? (system.matches ? "dark" : "light");
    attribute(document.documentElement, "data-theme", theme);
    button.setAttribute("aria-pressed", String(theme === "dark"));
    changed();
  };
  system.addEventListener("change", show);
  button.addEventListener("click", () => {
    localStorage.setItem(KEY, document.documentElement.dataset.theme === "dark" ? "light" : "dark");
    show();
  });
  show();
}

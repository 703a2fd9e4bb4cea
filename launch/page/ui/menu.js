// A small window next to the clicked element. The browser closes it on Escape and on a click outside.

import { byId, el } from "./dom.js";

const EDGE_PX = 8;

const CONTROLS = "button, select, input, textarea";

let place = () => {};
// A menu may grow after a choice in it.
const observer = new ResizeObserver(() => place());

/** Keeps Tab within the open menu, because the next element of the page is at its other end. Escape leaves the menu. */
function keepFocus(event) {
  const controls = [...event.currentTarget.querySelectorAll(CONTROLS)].filter(({ disabled }) => !disabled);
  const [from, to] = event.shiftKey ? [controls[0], controls.at(-1)] : [controls.at(-1), controls[0]];
  if (event.key !== "Tab" || event.target !== from) return;
  event.preventDefault();
  to.focus();
}

/** Opens a menu at an element or a point `{x, y}` (CSS pixels of the window). Closes any other menu. */
export function openMenu(title, at, ...content) {
  const menu = byId("menu");
  if (menu.matches(":popover-open")) menu.hidePopover();
  const close = el("button", { type: "button", class: "quiet", "aria-label": "Close", onclick: () => menu.hidePopover() }, "✕");
  menu.replaceChildren(el("div", { class: "menu-head" }, el("h2", { id: "menu-title" }, title), close), ...content.filter(Boolean));
  menu.showPopover();
  const box = at instanceof Element ? at.getBoundingClientRect() : { left: at.x, bottom: at.y, top: at.y };
  place = () => {
    const { width, height } = menu.getBoundingClientRect();
    const below = box.bottom + 4;
    const top = below + height <= innerHeight - EDGE_PX ? below : box.top - height - 4;
    menu.style.left = `${Math.max(EDGE_PX, Math.min(box.left, innerWidth - width - EDGE_PX))}px`;
    menu.style.top = `${Math.max(EDGE_PX, Math.min(top, innerHeight - height - EDGE_PX))}px`;
  };
  place();
  observer.observe(menu);
  menu.onkeydown = keepFocus;
  menu.querySelector("select, input, .choices button")?.focus();
}

/** Closes the menu, if it is open. */
export function closeMenu() {
  const menu = byId("menu");
  if (menu.matches(":popover-open")) menu.hidePopover();
}

/** Creates a labeled number field. `options` are attributes of the input. */
export function numberField(label, options) {
  const input = el("input", { type: "number", ...options });
  return { input, element: el("label", { class: "field" }, el("span", {}, label), input) };
}

/** Creates a labeled text field. `options` are attributes of the input. */
export function textField(label, options) {
  const input = el("input", { type: "text", ...options });
  return { input, element: el("label", { class: "field" }, el("span", {}, label), input) };
}

/** Creates a labeled choice of `values` = `[[value, text], …]`. */
export function selectField(label, values, options = {}) {
  const input = el("select", options, ...values.map(([value, shown]) => el("option", { value }, shown)));
  return { input, element: el("label", { class: "field" }, el("span", {}, label), input) };
}

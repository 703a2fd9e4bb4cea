// Tabs that show one of several panels. On a narrow page the robots and the charts have tabs, too.

import { byId } from "./dom.js";

const KEY = "alliance-tab";
const narrow = matchMedia("(max-width: 899px)");

/** Starts the tab bar. `changed` is called when another panel shows. Returns a function that shows the tab of a name. */
export function startTabs(changed) {
  const tabs = [...document.querySelectorAll("#tabs [role=tab]")];
  const offered = () => tabs.filter((tab) => narrow.matches || !tab.hasAttribute("data-narrow"));
  const show = (wanted, focus = false) => {
    const tab = offered().find((each) => each.dataset.tab === wanted) ?? offered()[0];
    for (const each of tabs) {
      const chosen = each === tab;
      each.setAttribute("aria-selected", String(chosen));
      each.tabIndex = chosen ? 0 : -1;
      byId(each.getAttribute("aria-controls")).toggleAttribute("data-chosen", chosen);
    }
    document.body.dataset.tab = tab.dataset.tab;
    if (focus) tab.focus();
    changed();
  };
  for (const tab of tabs) {
    tab.addEventListener("click", () => {
      sessionStorage.setItem(KEY, tab.dataset.tab);
      show(tab.dataset.tab);
    });
  }
  byId("tabs").addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    const all = offered();
    const at = all.findIndex((each) => each.dataset.tab === document.body.dataset.tab);
    show(all[(at + step + all.length) % all.length].dataset.tab, true);
    event.preventDefault();
    event.stopPropagation();
  });
  narrow.addEventListener("change", () => show(document.body.dataset.tab));
  show(sessionStorage.getItem(KEY) ?? (narrow.matches ? "robots" : "tasks"));
  return show;
}

/** Tests whether a panel is visible. Others are not updated. Needs no layout, unlike `offsetParent` and `checkVisibility`. */
export function isShown(id) {
  return byId(id).hasAttribute("data-chosen") || (!narrow.matches && byId(`tab-${id}`).hasAttribute("data-narrow"));
}

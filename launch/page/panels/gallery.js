// The gallery: runs worth watching, each with a sentence that says what to see and where it comes from.

import { linkOf } from "../model/choice.js";
import { byId, el } from "../ui/dom.js";

/** Adds the list of runs to the form, and the sentence of the shown run below it. */
export async function showGallery(entries) {
  const shown = await Promise.all(entries.map(async (entry) => ({ ...entry, link: await linkOf(entry.choice) })));
  const page = location.href.split("#")[0];
  const heading = el("h2", { id: "gallery-title" }, "Gallery");
  const about = el("p", { class: "dim" }, "Each run waits at its start. The space bar starts it, m runs it as fast as possible.");
  const close = el("form", { method: "dialog" }, el("button", {}, "Close"));
  const rows = shown.map(({ title, see, source, link }) => {
    // The dialog closes, because a link to the shown run changes nothing else.
    const open = el("a", { href: page + link, onclick: () => dialog.close() }, title);
    return el("li", {}, open, el("p", {}, see, el("span", { class: "dim" }, ` ${source}`)));
  });
  const dialog = el("dialog", { id: "gallery", "aria-labelledby": "gallery-title" }, heading, about, el("ol", {}, ...rows), close);
  document.body.append(dialog);
  const button = el("button", { type: "button", id: "open-gallery", "aria-haspopup": "dialog", onclick: () => dialog.showModal() }, "Gallery");
  byId("run-hash").before(button);
  const current = shown.find(({ link }) => link === location.hash);
  if (current) {
    const { title, see, source } = current;
    byId("playground").append(el("p", { id: "gallery-entry" }, el("strong", {}, title), `: ${see} `, el("span", { class: "dim" }, source)));
  }
}

// Files of the editor: opens a file of this computer, and saves one. Nothing is sent to a server.

import { decode } from "../model/draft.js";
import { el } from "../ui/dom.js";

/** Reads a scenario file. Throws an Error with one line, as of the program, if it is no text. */
export async function readFile(file) {
  return decode(file.name, new Uint8Array(await file.arrayBuffer()));
}

/** Saves a text in the folder for downloads. */
export function saveFile(name, text) {
  const url = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
  el("a", { href: url, download: name }).click();
  // The browser has started to read it.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

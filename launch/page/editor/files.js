// Files of the editor: opens a file of this computer, and saves one. Nothing is sent to a server.

import { el } from "../ui/dom.js";

/** Reads a scenario file. Throws an Error with one line if it is no text. */
export async function readFile(file) {
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(await file.arrayBuffer());
  } catch {
    throw new Error(`${file.name}: the bytes are not UTF-8 text; save the file as UTF-8`);
  }
}

/** Saves a text in the folder for downloads. */
export function saveFile(name, text) {
  const url = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
  el("a", { href: url, download: name }).click();
  // The browser has started to read it.
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

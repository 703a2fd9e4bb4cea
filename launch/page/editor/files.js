// Files of the editor: opens a file of this computer, saves one, and keeps the versions of a tab. Nothing is sent to a
// server.

import { Versions, decode } from "../model/draft.js";
import { el } from "../ui/dom.js";

/** The session key of the versions. */
const VERSIONS = "alliance-edited-versions";
/** Browsers store at least 2.5 million letters per page. */
const MAX_LETTERS = 2_000_000;

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

/** Keeps the versions while this tab exists, because each run starts the page again. */
export function keepVersions(versions) {
  try {
    sessionStorage.setItem(VERSIONS, versions.save(MAX_LETTERS));
  } catch {
    // A browser may refuse to store data. Then undo ends at the start of a run.
  }
}

/** Returns the versions that this tab keeps, or null. */
export function keptVersions() {
  try {
    return Versions.restore(sessionStorage.getItem(VERSIONS));
  } catch {
    return null;
  }
}

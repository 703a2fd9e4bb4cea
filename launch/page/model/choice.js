// The choice of a run in the link of the playground, such as `#scenario=janitorial&allocator=cbba&seed=3`. A scenario and
// orders of a person are compressed in it. Nothing is sent to a server. A copied link has the version of the program,
// because another version may run the same choice differently.

const KEYS = ["version", "scenario", "file", "allocator", "beside", "seed", "limit_s", "orders"];
/** The keys whose values are compressed. */
const PACKED = ["file", "orders"];

/** The number of letters of a damaged word that a line shows. */
const MAX_WORD = 40;

const damaged = (word) => {
  const shown = word.length > MAX_WORD ? `${word.slice(0, MAX_WORD)}…` : word;
  return new Error(`This link is damaged at '${shown}': copy it once more, or choose a run above`);
};

const otherVersion = (theirs, own) => {
  const remedy = `open it in a page of version ${theirs}, or choose a run above`;
  return new Error(`This link is of version ${theirs} and this page is of version ${own}: ${remedy}`);
};

/**
 * Returns the choice in the part of a link after the #. `version` is that of this page. Throws an Error with one line if
 * the link is damaged or of another version. The simulator checks the names.
 */
export async function choiceOf(hash, version) {
  const choice = {};
  const words = hash.replace(/^#/, "").split("&").filter(Boolean);
  // Another version may have other words.
  const theirs = words.find((word) => word.startsWith("version="))?.slice("version=".length);
  if (theirs && /^[0-9A-Za-z.+-]+$/.test(theirs) && theirs !== version) throw otherVersion(theirs, version);
  for (const word of words) {
    const [key, value, ...rest] = word.split("=");
    if (!KEYS.includes(key) || !value || rest.length || key in choice || (key === "version" && value !== version)) throw damaged(word);
    try {
      choice[key] = PACKED.includes(key) ? await unpacked(value) : decodeURIComponent(value);
    } catch {
      throw damaged(word);
    }
  }
  if ("limit_s" in choice) {
    choice.limit_s = Number(choice.limit_s);
    if (Number.isNaN(choice.limit_s)) throw new Error("limit_s in this link is no number: choose a run above");
  }
  delete choice.version;
  return choice;
}

/** Returns the part of a link after the # for a choice, without empty entries. `version` is that of this page. */
export async function linkOf(choice, version) {
  const words = [];
  const all = { ...choice, version };
  for (const key of KEYS.filter((each) => all[each] && all[each].length !== 0)) {
    words.push(`${key}=${PACKED.includes(key) ? await packed(all[key]) : encodeURIComponent(all[key])}`);
  }
  return `#${words.join("&")}`;
}

/** Returns a value as compressed text, in the alphabet of base64 for links. */
async function packed(value) {
  const bytes = await through(new CompressionStream("deflate"), new TextEncoder().encode(JSON.stringify(value)));
  const text = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
  return text.replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** Returns the value of a compressed text. Fails if the text is damaged, because the format has a checksum. */
async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text.replaceAll("-", "+").replaceAll("_", "/")), (letter) => letter.charCodeAt(0));
  return JSON.parse(new TextDecoder().decode(await through(new DecompressionStream("deflate"), bytes)));
}

async function through(transform, bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(transform);
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// The choice of a run in the link of the playground, such as `#scenario=janitorial&allocator=cbba&seed=3`. Orders of a
// person are compressed in it. Nothing is sent to a server.

const KEYS = ["scenario", "allocator", "beside", "seed", "limit_s", "orders"];

const damaged = (word) => new Error(`This link is damaged at '${word}': copy it once more, or choose a run above`);

/**
 * Returns the choice in the part of a link after the #. Throws an Error with one line if the link is damaged. The
 * simulator checks the names.
 */
export async function choiceOf(hash) {
  const choice = {};
  for (const word of hash.replace(/^#/, "").split("&").filter(Boolean)) {
    const [key, value, ...rest] = word.split("=");
    if (!KEYS.includes(key) || !value || rest.length || key in choice) throw damaged(word);
    try {
      choice[key] = key === "orders" ? await unpacked(value) : decodeURIComponent(value);
    } catch {
      throw damaged(word);
    }
  }
  if ("limit_s" in choice) {
    choice.limit_s = Number(choice.limit_s);
    if (Number.isNaN(choice.limit_s)) throw new Error("limit_s in this link is no number: choose a run above");
  }
  return choice;
}

/** Returns the part of a link after the # for a choice, without empty entries. */
export async function linkOf(choice) {
  const words = [];
  for (const key of KEYS.filter((each) => choice[each])) {
    const value = choice[key];
    if (key !== "orders") words.push(`${key}=${encodeURIComponent(value)}`);
    else if (value.length) words.push(`orders=${await packed(value)}`);
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

// The choice of a run in the link of the playground, such as `#scenario=janitorial&allocator=cbba&seed=3`.

const KEYS = ["scenario", "allocator", "seed", "limit_s"];

/**
 * Returns the choice in the part of a link after the #. Throws an Error with one line if the link is damaged. The
 * simulator checks the names.
 */
export function choiceOf(hash) {
  const choice = {};
  for (const word of hash.replace(/^#/, "").split("&").filter(Boolean)) {
    const [key, value, ...rest] = word.split("=");
    const text = decoded(value);
    if (!KEYS.includes(key) || !text || rest.length || key in choice) {
      throw new Error(`This link is damaged at '${word}': copy it once more, or choose a run above`);
    }
    choice[key] = key === "limit_s" ? Number(text) : text;
    if (Number.isNaN(choice[key])) throw new Error(`limit_s in this link is no number: choose a run above`);
  }
  return choice;
}

function decoded(value) {
  try {
    return decodeURIComponent(value ?? "");
  } catch {
    return null;
  }
}

/** Returns the part of a link after the # for a choice, without empty entries. */
export function linkOf(choice) {
  const words = KEYS.filter((key) => choice[key]).map((key) => `${key}=${encodeURIComponent(choice[key])}`);
  return `#${words.join("&")}`;
}

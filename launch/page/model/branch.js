// Branches of a finished run: the command that repeats the run up to a time and goes on from there.

/** The choices of what follows the branch: [value of `--faults` or null, words]. */
export const CONTINUATIONS = [
  ["none", "no more faults"],
  ["faults.toml", "faults of a file"],
  [null, "like the run"],
];

/** Quotes a path as one word of a shell. A path that begins with `-` would be read as an option. */
export function shellWord(path) {
  const text = path.startsWith("-") ? `./${path}` : path;
  return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

/** Returns the command for a branch at a simulated time, ms. `faults` is the value of `--faults`, or null. */
export function branchCommand({ folder }, at_ms, faults) {
  const words = ["alliance", "run", "--from", shellWord(folder), "--at", `${at_ms / 1000}s`];
  if (faults !== null) words.push("--faults", shellWord(faults));
  return words.join(" ");
}

/** Returns the reason why a run cannot be branched at a tick, or null. */
export function branchRefusal({ log }, tick) {
  if (log.outcome === "running") return "A branch needs a run that has ended, and this one has not";
  if (log.outcome !== "interrupted" && tick >= log.ticks) return "The run has ended here: go back to an earlier time";
  return null;
}

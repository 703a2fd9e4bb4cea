// Faults and their values as the run declares them.

/** Returns the label of a fault's button: `move-robot` → `Move robot`. */
export function label({ name }) {
  const words = name.replaceAll("-", " ");
  return words.slice(0, 1).toUpperCase() + words.slice(1);
}

/** Returns the arguments that need a field: all but the place, which is a click on the floor. */
export function fieldsOf({ arguments: all, place }) {
  return all.filter(({ key }) => !place?.includes(key));
}

/** Returns the fault of an order. `values` are numbers and names by key; NaN selects the default. `point` is its place, m. */
export function ownFault({ name, place }, values, point) {
  const stated = Object.entries(values).filter(([, value]) => !Number.isNaN(value));
  const at = place ? [[place[0], point.x], [place[1], point.y]] : [];
  return { [name]: Object.fromEntries([...stated, ...at]) };
}

/** Returns the groups of robots in a text such as `blue,gold / green`. */
export function groupsIn(text) {
  return text.split("/").map((group) => group.split(/[,\s]+/).filter(Boolean));
}

/** Returns a declared mode with its size in the form of files. */
export function modeOf({ name, from, words, takes_deg }, size, deg) {
  if (takes_deg) return { [name]: { m: size, deg: Number.isNaN(deg) ? 0 : deg } };
  return from === null && words === null ? name : { [name]: size };
}

/** Returns a key for each fault: the first letter of its name that is still free, or null. */
export function letters(specs, taken) {
  const used = new Set(taken);
  return specs.map(({ name }) => {
    const letter = [...name].find((each) => /[a-z]/.test(each) && !used.has(each)) ?? null;
    used.add(letter);
    return letter;
  });
}

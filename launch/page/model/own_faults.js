// Faults that only the mission knows, made from what it declares of them.

/** What a fault is called on its button: `move-robot` → `Move robot`. */
export function label({ name }) {
  const words = name.replaceAll("-", " ");
  return words.slice(0, 1).toUpperCase() + words.slice(1);
}

/** What is stated in fields: all but a place, for which there is the floor. */
export function fieldsOf({ arguments: all, place }) {
  return all.filter(({ key }) => !place?.includes(key));
}

/** The fault as it is ordered: `values` are numbers by key, those that are NaN have their defaults; `point`: its place, m. */
export function ownFault({ name, place }, values, point) {
  const stated = Object.entries(values).filter(([, value]) => !Number.isNaN(value));
  const at = place ? [[place[0], point.x], [place[1], point.y]] : [];
  return { [name]: Object.fromEntries([...stated, ...at]) };
}

/** A key for each of them, in their order: the first letter of its name that is not taken yet; null where there is none. */
export function letters(specs, taken) {
  const gone = new Set(taken);
  return specs.map(({ name }) => {
    const letter = [...name].find((each) => /[a-z]/.test(each) && !gone.has(each)) ?? null;
    gone.add(letter);
    return letter;
  });
}

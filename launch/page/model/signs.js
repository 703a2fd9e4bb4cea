// The signs on the discs of robots, one to three characters.

const initial = (name) => name[0].toUpperCase();
const number = (name) => name.match(/\d{1,3}$/)?.[0];

/** Returns the sign of each name: the number at its end, with the initial if names with another one have the same number, or one or two letters. */
export function signs(names) {
  const used = new Map();
  for (const name of names) {
    for (const part of [number(name), initial(name)]) used.set(part, (used.get(part) ?? 0) + 1);
  }
  return names.map((name) => {
    const [digits, letter] = [number(name), initial(name)];
    if (digits) return used.get(digits) === 1 ? digits : letter + digits;
    return used.get(letter) === 1 ? letter : letter + name.slice(1, 2);
  });
}

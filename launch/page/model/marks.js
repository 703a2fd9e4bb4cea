// The work that is left at a mark, as a share and in words. A mark is filled by the share that is left.

/** Returns the share of a mark's work that is left, 0 to 1; 0 without work. */
export function shareLeft({ work }) {
  return work ? Math.max(0, Math.min(1, work.left / work.all)) : 0;
}

/** Tests whether a mark had work and none is left. */
export function isDone({ work }) {
  return work !== null && work.left <= 0;
}

/** Formats an amount with the decimals that `all` needs. */
function amount(value, all) {
  return String(all >= 10 ? Math.ceil(value) : Number(value.toFixed(1)));
}

/**
 * Returns a mark's label with the work that is left, such as `box 6/12 left`, `p3 dust 4/9 s left` or `✓ box`, then a shorter
 * one for little space. A mark without a name has none.
 */
export function labelsOf(mark) {
  const { label, work } = mark;
  if (!label) return [];
  if (isDone(mark)) return [`✓ ${label}`, "✓"];
  if (!work?.unit) return [label];
  // A label has room for the symbol of a unit, and not for the name of counted things.
  const unit = work.unit.length > 2 ? "" : ` ${work.unit}`;
  return [`${label} ${amount(work.left, work.all)}/${amount(work.all, work.all)}${unit} left`, label];
}

/** Returns a mark with its work in words: `box: 6 of 12 items left`. */
export function markInWords(mark) {
  const { id, label, work } = mark;
  const name = label || id;
  if (!work) return name;
  if (!work.unit) return `${name}: ${isDone(mark) ? "done" : "to do"}`;
  return `${name}: ${amount(work.left, work.all)} of ${amount(work.all, work.all)} ${work.unit} left`;
}

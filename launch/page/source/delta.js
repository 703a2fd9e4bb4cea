// Changes between successive views, in which a file with a run stores them. The program writes them
// (launch/src/page/delta.rs).

/**
 * Returns the value after a change. An object changes some entries, an array of one element replaces the value by that
 * element, and any other value replaces it. Unchanged parts are shared, not copied.
 */
export function applyChange(before, change) {
  if (change === null || typeof change !== "object") return change;
  if (Array.isArray(change)) return change[0];
  const after = Array.isArray(before) ? before.slice() : { ...before };
  for (const key in change) after[key] = applyChange(before[key], change[key]);
  return after;
}

// Colors of behavior sets, marks and the theme. The colors of robots and tasks come from the server, which uses the
// palette of reports. A color is never the only mark: robots have names, behavior sets have line styles.

const DASHES = [[], [6, 3], [2, 2], [9, 3, 2, 3]];

/**
 * Returns color and dash of each behavior set, by id. `hues` are the colors of tasks, in turn. The last task has null,
 * which is the text color. Sets of a task and tasks of similar colors differ in their dashes.
 */
export function setStyles(catalog, hues) {
  const last = catalog.tasks.length - 1;
  const sameTask = new Map();
  return catalog.sets.map(({ task }) => {
    const nth = sameTask.get(task) ?? 0;
    sameTask.set(task, nth + 1);
    return {
      color: task === last ? null : hues[task % hues.length],
      dash: DASHES[(task === 0 ? 2 * nth : task - 1) % DASHES.length],
    };
  });
}

/** Returns the color of a mark of several kinds: `2/p7` is of the third kind. Returns null for any other mark. */
export function kindColor(id, hues) {
  const kind = /^(\d+)\//.exec(id);
  return kind && hues[Number(kind[1]) % hues.length];
}

/** Returns a custom property of the theme, such as `--ink`. */
export function themeColor(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

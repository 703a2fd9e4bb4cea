// Colors that color-blind people can distinguish, after Okabe and Ito, legible on light and dark floors. A color is
// never the only mark: robots have names, behavior sets have line styles.

/** Robots with the name of a color have that color. */
const BY_NAME = {
  blue: "#1a7fc4",
  gold: "#e69f00",
  green: "#009e73",
  red: "#d55e00",
  orange: "#d55e00",
  violet: "#b0609a",
  purple: "#b0609a",
  magenta: "#b0609a",
  pink: "#cc79a7",
  cyan: "#56b4e9",
  yellow: "#d9c615",
  brown: "#8c6239",
  black: "#4d4d4d",
  gray: "#8a8a8a",
  grey: "#8a8a8a",
};

/** Colors of all other robots, in turn. */
const OTHERS = ["#d55e00", "#cc79a7", "#56b4e9", "#1a7fc4", "#e69f00", "#009e73", "#d9c615", "#8c6239"];

/** Returns a color for each robot, by rank. */
export function robotColors(names) {
  let next = 0;
  return names.map((name) => BY_NAME[name] ?? OTHERS[next++ % OTHERS.length]);
}

const TASK_COLORS = ["#b0609a", "#d55e00", "#3b9bd6", "#a08c00", "#009e73", "#8c6239"];
const DASHES = [[], [6, 3], [2, 2], [9, 3, 2, 3]];

/**
 * Returns color and dash of each behavior set, by id. Each task has a color; the last one has null, which is the text
 * color. Sets of a task and tasks of similar colors differ in their dashes.
 */
export function setStyles(catalog) {
  const last = catalog.tasks.length - 1;
  const sameTask = new Map();
  return catalog.sets.map(({ task }) => {
    const nth = sameTask.get(task) ?? 0;
    sameTask.set(task, nth + 1);
    return {
      color: task === last ? null : TASK_COLORS[task % TASK_COLORS.length],
      dash: DASHES[(task === 0 ? 2 * nth : task - 1) % DASHES.length],
    };
  });
}

/** Returns the color of a mark of several kinds: `2/p7` is of the third kind. Returns null for any other mark. */
export function kindColor(id) {
  const kind = /^(\d+)\//.exec(id);
  return kind && TASK_COLORS[Number(kind[1]) % TASK_COLORS.length];
}

/** Returns a custom property of the theme, such as `--ink`. */
export function themeColor(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

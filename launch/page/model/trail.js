// The path of a robot as lines that cross no obstacle.

/** An obstacle up to this penetrability is solid. */
const SOLID = 0.1;
/** A longer distance between two samples within a second is a relocation, not a drive. */
const RELOCATION_M = 1.5;

/**
 * Returns the lines of a robot's trail from `from` to `to`, ms. Each line is a list of points `[x, y]`, m. A body of
 * that radius keeps its distance from solid obstacles, so a short straight line cannot cross one. A longer line is left
 * out where it would.
 */
export function trail(history, rank, from, to, radius_m, obstacles) {
  const solid = obstacles.filter(({ penetrability }) => penetrability <= SOLID);
  const lines = [];
  let last = null;
  const { samples } = history;
  for (let index = history.indexAt(from); index < samples.length && samples[index].t <= to; index += 1) {
    const { t, positions, agents } = samples[index];
    if (agents[rank] === "absent") continue;
    const point = [positions[2 * rank], positions[2 * rank + 1]];
    const length = last ? Math.hypot(point[0] - last.point[0], point[1] - last.point[1]) : Infinity;
    const isNewest = index === samples.length - 1 || samples[index + 1].t > to;
    if (length < radius_m / 2 && !isNewest) continue;
    const isRelocated = !last || (length > RELOCATION_M && t - last.t < 1000);
    const isBlocked = !isRelocated && length > radius_m && solid.some((each) => crosses(last.point, point, each));
    if (isRelocated || isBlocked) lines.push([point]);
    else lines.at(-1).push(point);
    last = { point, t };
  }
  return lines;
}

/** Tests whether the line from a to b crosses the rectangle. */
export function crosses(a, b, { x_m, y_m, width_m, height_m }) {
  let [from, to] = [0, 1];
  for (const [start, step, low, size] of [
    [a[0], b[0] - a[0], x_m, width_m],
    [a[1], b[1] - a[1], y_m, height_m],
  ]) {
    if (step === 0) {
      if (start <= low || start >= low + size) return false;
      continue;
    }
    const [enter, leave] = [(low - start) / step, (low + size - start) / step].sort((x, y) => x - y);
    from = Math.max(from, enter);
    to = Math.min(to, leave);
  }
  return from < to;
}

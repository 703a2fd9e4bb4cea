// Where a robot came along, as lines that cross no obstacle.

/** Up to this penetrability an obstacle is solid. */
const SOLID = 0.1;
/** A robot cannot have come this far between two samples that lie close together in time: it was put there. */
const LEAP_M = 1.5;

/**
 * The lines of a robot's trail from `from` to `to`, ms, each a list of points `[x, y]`, m. Its body of that radius never came
 * nearer to a solid obstacle than that, so a straight line between places half a radius apart cannot cross one; a longer one, of
 * a page that saw little of the way, is left out where it would.
 */
export function trail(history, rank, from, to, radius_m, obstacles) {
  const solid = obstacles.filter(({ penetrability }) => penetrability <= SOLID);
  const lines = [];
  let last = null;
  const { samples } = history;
  for (let index = history.indexAt(from); index < samples.length && samples[index].t <= to; index += 1) {
    const { t, places, agents } = samples[index];
    if (agents[rank] === "absent") continue;
    const point = [places[2 * rank], places[2 * rank + 1]];
    const length = last ? Math.hypot(point[0] - last.point[0], point[1] - last.point[1]) : Infinity;
    const isNewest = index === samples.length - 1 || samples[index + 1].t > to;
    if (length < radius_m / 2 && !isNewest) continue;
    const leaps = !last || (length > LEAP_M && t - last.t < 1000);
    const isBlocked = !leaps && length > radius_m && solid.some((each) => crosses(last.point, point, each));
    if (leaps || isBlocked) lines.push([point]);
    else lines.at(-1).push(point);
    last = { point, t };
  }
  return lines;
}

/** Whether the line from a to b passes through the rectangle. */
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

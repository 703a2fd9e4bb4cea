// The expected quality of a radio link by the scenario: range, fading and obstacles, without faults. The world computes
// the same in world-server/src/world/radio.rs and channel.rs.

/** The greatest penetrability of a solid obstacle. */
const SOLID = 0.1;

/**
 * Returns the probability that a message between two places is received, 0 to 1. `radio` is the section of the scenario,
 * and undefined if every message is received.
 */
export function reception(radio, from, to, obstacles) {
  if (!radio) return 1;
  const distance = Math.hypot(to[0] - from[0], to[1] - from[1]);
  if (radio.range_m && distance > radio.range_m) return 0;
  if (radio.walls === "block" && obstacles.some((each) => each.penetrability <= SOLID && isBetween(each, from, to))) return 0;
  const { fading } = radio;
  return fading ? Math.exp(-((distance / fading.d0_m) ** fading.path_loss_exponent)) : 1;
}

/** Tests whether a rectangle lies on the straight line between two places: the parts of the line in x and y overlap. */
function isBetween({ min, max }, from, to) {
  let [enter, leave] = [0, 1];
  for (const axis of [0, 1]) {
    const way = to[axis] - from[axis];
    if (way === 0) {
      if (from[axis] < min[axis] || from[axis] > max[axis]) return false;
      continue;
    }
    const [one, other] = [(min[axis] - from[axis]) / way, (max[axis] - from[axis]) / way];
    enter = Math.max(enter, Math.min(one, other));
    leave = Math.min(leave, Math.max(one, other));
  }
  return enter <= leave;
}

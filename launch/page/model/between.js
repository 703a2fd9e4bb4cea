// The picture between two views of a log, for a smooth playback of views that are far apart in time.

/** A longer way between two views is a relocation, not a drive, m. */
const RELOCATION_M = 1.5;
const HALF_TURN = Math.PI;

/**
 * Returns the view with the poses of the robots moved toward the next view. `share` is 0 for the view and 1 for the next one.
 * @param {import("../../page-tests/types.js").View} view
 * @param {import("../../page-tests/types.js").View} next
 * @param {number} share
 * @returns {import("../../page-tests/types.js").View}
 */
export function between(view, next, share) {
  return { ...view, robots: view.robots.map((robot, rank) => ({ ...robot, pose: poseBetween(robot.pose, next.robots[rank].pose, share) })) };
}

function poseBetween(from, to, share) {
  const [dx, dy] = [to.position[0] - from.position[0], to.position[1] - from.position[1]];
  if (Math.hypot(dx, dy) > RELOCATION_M) return from;
  // The shorter turn.
  const turn = ((to.heading_rad - from.heading_rad + 3 * HALF_TURN) % (2 * HALF_TURN)) - HALF_TURN;
  return { ...from, position: [from.position[0] + share * dx, from.position[1] + share * dy], heading_rad: from.heading_rad + share * turn };
}

// The state of the run on this page, in one word.

/**
 * Returns connecting, waiting, running, paused, standing, frozen, disconnected or ended. `clockwork` is a LiveClock, or
 * the Player of a log. Only the end of the run itself is `ended`: after the end of the page's server the run may go on.
 */
export function stateOf(model, clockwork) {
  if (!model.view) return "connecting";
  if (model.ended) return model.ended.isDisconnected ? "disconnected" : "ended";
  if (clockwork.paused && clockwork.atEnd) return "ended";
  if (model.isFrozen) return "frozen";
  if (clockwork.paused) return "paused";
  if (model.isOpen && model.view.clock.waits_for) return "standing";
  const isTeamComplete = model.view.tick > 0 || model.view.robots.every(({ state }) => state === "present" || state === "absent");
  return isTeamComplete ? "running" : "waiting";
}

// Skills, as the run declares them.

/** Those that a robot has: names. Where none of it are stated, it has all. */
export function skillsOf({ skills, scenario }, rank) {
  const own = scenario.robots[rank].skills;
  return own ? skills.filter((name) => own[name] > 0) : skills;
}


/** Returns the names of a robot's skills. A robot without stated skills has all. */
export function skillsOf({ skills, scenario }, rank) {
  const stated = scenario.robots[rank].skills;
  return stated ? skills.filter((name) => stated[name] > 0) : skills;
}

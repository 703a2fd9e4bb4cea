// Kinds of events in groups, by which they are filtered, marked on the time line and jumped to.

/** Groups: what they are called, their sign and their kinds; the mission declares its own. Whatever is new counts as a detail. */
export const GROUPS = {
  tasks: { label: "tasks", sign: "▲", kinds: ["activated", "waiting", "hibernated"] },
  mission: { label: "mission", sign: "★", kinds: [] },
  robots: { label: "robots", sign: "●", kinds: ["joined", "gone", "stalled", "back", "energy-out"] },
  faults: { label: "faults", sign: "✖", kinds: ["armed", "applied", "hit", "healed", "disarmed", "failed"] },
  details: { label: "details", sign: "·", kinds: ["progress", "detour", "lost"] },
};

/** @type {Map<string, string>} */
const GROUP_OF = new Map();
for (const [group, { kinds }] of Object.entries(GROUPS)) for (const kind of kinds) GROUP_OF.set(kind, group);

/** The group of a kind of events; `ofMission`: the kinds that the mission declares. */
export function groupOf(kind, ofMission) {
  return GROUP_OF.get(kind) ?? (ofMission.includes(kind) ? "mission" : "details");
}

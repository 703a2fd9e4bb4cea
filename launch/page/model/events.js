// Groups of event kinds. The list, the time line and the keys filter by group.

/** The kind of a takeover from a lost robot. */
export const TOOK_OVER = "took-over";
/** The kind of the detection of a lost robot. */
export const DETECTED = "detected";

/** The groups with label, sign and kinds. The mission declares its own kinds. Any other kind is a detail. */
export const GROUPS = {
  takeovers: { label: "takeovers", sign: "◆", kinds: [TOOK_OVER, DETECTED] },
  tasks: { label: "tasks", sign: "▲", kinds: ["activated", "waiting", "hibernated"] },
  mission: { label: "mission", sign: "★", kinds: ["ended"] },
  robots: { label: "robots", sign: "●", kinds: ["joined", "gone", "stalled", "back", "energy-out"] },
  faults: { label: "faults", sign: "✖", kinds: ["armed", "applied", "hit", "healed", "disarmed", "failed"] },
  details: { label: "details", sign: "·", kinds: ["progress", "detour", "lost"] },
};

/** @type {Map<string, string>} */
const GROUP_OF = new Map();
for (const [group, { kinds }] of Object.entries(GROUPS)) for (const kind of kinds) GROUP_OF.set(kind, group);

/** Returns the group of an event kind. `missionKinds` lists the kinds that the mission declares. */
export function groupOf(kind, missionKinds) {
  return GROUP_OF.get(kind) ?? (missionKinds.includes(kind) ? "mission" : "details");
}

// Kinds of events in groups, by which they are filtered, marked on the time line and jumped to.

/** Groups: what they are called, their sign and their kinds. Whatever is new counts as a detail. */
export const GROUPS = {
  tasks: { label: "tasks", sign: "▲", kinds: ["activated", "waiting", "hibernated"] },
  items: { label: "items", sign: "◆", kinds: ["picked", "dropped", "delivered", "put-down", "pick-failed"] },
  mission: {
    label: "mission",
    sign: "★",
    kinds: ["reported", "position-update", "locations-learned", "locations-withdrawn", "spill-empty"],
  },
  robots: { label: "robots", sign: "●", kinds: ["joined", "gone", "stalled", "back", "energy-out"] },
  faults: { label: "faults", sign: "✖", kinds: ["armed", "applied", "hit", "healed", "disarmed", "failed"] },
  details: { label: "details", sign: "·", kinds: ["progress", "detour", "lost"] },
};

const GROUP_OF = new Map(Object.entries(GROUPS).flatMap(([group, { kinds }]) => kinds.map((kind) => [kind, group])));

/** The group of an event. */
export function groupOf(event) {
  return GROUP_OF.get(event.kind) ?? "details";
}

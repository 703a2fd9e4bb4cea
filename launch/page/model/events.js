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

/** Routine events of the same time span share a row, ms. */
const FOLDED_MS = 10_000;

/** Tests whether an event is ordinary work, and neither trouble nor an end. */
function isRoutine({ group, kind }) {
  return group === "tasks" || group === "details" || (group === "mission" && kind !== "ended") || kind === "joined";
}

/**
 * Returns the rows of a list of the wanted events, newest first, at most `most`. A row is a list of events, newest first:
 * one event or, if `folds`, routine events of the same ten seconds with no other event between them.
 */
export function eventRows(events, isWanted, most, folds) {
  const rows = [];
  const span = ({ t_ms }) => Math.floor(t_ms / FOLDED_MS);
  for (const event of events.toReversed()) {
    if (!isWanted(event)) continue;
    const [latest] = rows.at(-1) ?? [];
    const isFolded = folds && latest && isRoutine(event) && isRoutine(latest) && span(event) === span(latest);
    if (isFolded) rows.at(-1).push(event);
    else if (rows.length === most) break;
    else rows.push([event]);
  }
  return rows;
}

// Texts for times, faults, events and deliveries.

/** Formats milliseconds as seconds. */
export function seconds(ms, digits = 1) {
  return `${(ms / 1000).toFixed(digits)} s`;
}

/** Formats meters, to the centimeter at most. */
export function meters(m) {
  return `${Number(m.toFixed(2))} m`;
}

/** Formats a number with its noun, in the singular for 1. */
export function count(number, noun) {
  return `${number} ${noun}${number === 1 ? "" : "s"}`;
}

const percent = (share) => `${Math.round(100 * share)} %`;

/** Formats a share from 0 to 1 in percent. */
export { percent };

/** Formats the value of an argument: a number, a name, groups of robots, or a mode with its size. */
function valueInWords(value) {
  if (Array.isArray(value)) return value.map((group) => group.join(",")).join(" / ");
  if (typeof value !== "object") return `${value}`;
  const [[name, size]] = Object.entries(value);
  if (typeof size !== "object") return `${name} ${size}`;
  return `${name} ${size.m ?? 0}${size.deg ? ` --deg ${size.deg}` : ""}`;
}

/** Replaces partitions of two groups in a text by the direction that they cut: `blue → gold,red cut`. */
export function cutsInWords(text) {
  return text.replace(/\bpartition ([^\s/]*[^\s,/]) \/ ([^\s/]*[^\s,/])( --one-way)?(?=\s|$)(?! \/)/g, (_, first, second, isOneWay) => {
    return isOneWay ? `${second} → ${first} cut` : `${first} ↔ ${second} cut`;
  });
}

/**
 * Formats a fault as on the command line and in the log: `drop --from green --to all --p 0.3`. `kinds` are the faults
 * of every mission, as the run declares them. A partition of two groups has the words of `cutsInWords`.
 */
export function faultInWords(fault, kinds) {
  const [[name, content]] = Object.entries(fault);
  const kind = kinds.find((each) => each.name === name);
  if (!kind) {
    // A fault of the mission.
    const keys = Object.keys(content).sort();
    return [name, ...keys.map((key) => `--${key.replaceAll("_", "-")} ${content[key]}`)].join(" ");
  }
  const values = typeof content === "string" ? { [kind.arguments[0].key]: content } : content;
  const words = kind.arguments.flatMap(({ key, option, default: usual, is_time }) => {
    const value = values[key] ?? null;
    if (value === null || (option !== null && value === usual)) return [];
    // The option of a flag changes its default.
    if (typeof value === "boolean") return value === (usual === 1) ? [] : [`--${option}`];
    const shown = valueInWords(value) + (is_time ? "s" : "");
    return [option === null ? shown : `--${option} ${shown}`];
  });
  return cutsInWords([name, ...words].join(" "));
}

/** Capitalizes the first letter: `put an item elsewhere` → `Put an item elsewhere`. */
export function sentence(text) {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}

/** Formats the times of an order, as after the fault: ` --at 60s --for 30s`. */
export function termsInWords(order) {
  const timed = ["at", "every", "for"].map((name) => {
    const value = order[`${name}_s`];
    return value === null || value === undefined ? "" : ` --${name} ${value}s`;
  });
  return timed.join("") + (order.when ? ` --when "${order.when}"` : "");
}

const REASONS = {
  threshold: "motivation reached the threshold",
  "not-applicable": "no longer applicable",
  suppressed: "another set of the robot is active",
  "acquiesced-psi": "acquiesced: ψ has passed and a teammate waits for the task",
  "gave-up-lambda": "gave up: λ has passed",
  arbitration: "a teammate's claim has priority",
  "wait-over": "no robot executes the task any more",
  "wait-bound": "waited ψ + τ without success",
};

function reasonInWords(reason) {
  return REASONS[reason] ?? reason.replace(/^reset-by (.*)$/, "reset by the first claim of $1");
}

const SENTENCES = {
  activated: (event) => `activates ${event.subject}`,
  waiting: (event) => `waits for ${event.subject}`,
  hibernated: (event) => `deactivates ${event.subject}`,
  "energy-out": () => "has no energy left",
  joined: () => "joins",
  gone: () => "is dead",
  stalled: () => "is silent",
  "took-over": (event) => `takes over ${event.subject} from ${event.reason}`,
  detected: (event) => `notices the loss of ${event.reason}`,
  ended: (event) => (event.subject === "complete" ? "The mission is complete" : `The run ends: ${event.subject}`),
  back: () => "is back",
  lost: () => "lost a message",
  progress: (event) => `makes progress in ${event.detail}`,
  detour: () => "drives around an obstacle",
  armed: (event) => `${event.subject} is armed`,
  applied: (event) => `${event.subject} takes effect`,
  hit: (event) => `${event.subject} has its first effect`,
  healed: (event) => `${event.subject} is healed`,
  disarmed: (event) => `${event.subject} is disarmed`,
  failed: (event) => `${event.subject} fails`,
};

const STATE_KINDS = new Set(["activated", "waiting", "hibernated"]);

/** Shortens long decimals and replaces robot numbers by names. */
function tidy(detail, names) {
  const short = detail.replace(/-?\d+\.\d{4,}/g, (number) => String(Number(Number(number).toFixed(2)) || 0));
  return cutsInWords(short).replace(/robot#(\d+)/g, (rank, index) => names[index] ?? rank);
}

/** Returns an event without its robot as `{what, why}`; `why` may be empty. `names` are the robots' names, by rank. */
export function eventInWords(event, names) {
  const what = SENTENCES[event.kind]?.(event) ?? [event.kind.replaceAll("-", " "), event.subject].filter(Boolean).join(" ");
  if (STATE_KINDS.has(event.kind)) return { what, why: reasonInWords(event.reason) };
  if (event.kind === "progress") return { what, why: "" };
  if (event.kind === "took-over") return { what, why: event.detail };
  if (event.kind === "detected") return { what, why: `${event.detail}: impatience for ${event.subject} rises` };
  return { what, why: tidy([event.reason, event.detail].filter(Boolean).join("; "), names) };
}

/** Returns the numbers of routine events by kind, most frequent first: `12 picked, 3 activated`. */
export function countsInWords(events) {
  const counts = new Map();
  for (const { kind } of events) counts.set(kind, (counts.get(kind) ?? 0) + 1);
  const sorted = [...counts].sort(([, a], [, b]) => b - a);
  return sorted.map(([kind, number]) => `${number} ${kind.replaceAll("-", " ")}`).join(", ");
}

const PHASES = { armed: "armed", applied: "takes effect", hit: "first effect", healed: "healed", disarmed: "disarmed", failed: "fails" };

/** Returns a fault with its phases as `{what, why}`: `f1: kill gold` and `armed 20.0 s, takes effect 153.0 s`. */
export function phasesInWords(phases) {
  const [first] = phases;
  const texts = phases.map(({ kind, t_ms }) => `${PHASES[kind] ?? kind} ${seconds(t_ms, 2)}`);
  return { what: `${first.subject}: ${cutsInWords(first.detail)}`, why: texts.join(", ") };
}

/** Delivery of a message at a receiver: a sign that needs no color, and a word. */
export const DELIVERIES = {
  Received: { sign: "✓", word: "received" },
  Delayed: { sign: "◷", word: "received late" },
  Pending: { sign: "…", word: "in flight" },
  Lost: { sign: "✗", word: "lost" },
  Dropped: { sign: "✗", word: "dropped by a fault" },
  Cut: { sign: "⊘", word: "cut" },
  Duplicate: { sign: "⧉", word: "received twice" },
  Faded: { sign: "✗", word: "lost by fading" },
  Blocked: { sign: "⊘", word: "blocked by an obstacle" },
  Corrupted: { sign: "✗", word: "lost by bit errors" },
  Damaged: { sign: "≠", word: "received with bit errors" },
};

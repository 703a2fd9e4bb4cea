// How things are said: times, faults as the command line takes them, events.

/** Milliseconds as seconds. */
export function seconds(ms, digits = 1) {
  return `${(ms / 1000).toFixed(digits)} s`;
}

/** Meters, to the centimeter at most. */
export function meters(m) {
  return `${Number(m.toFixed(2))} m`;
}

const percent = (share) => `${Math.round(100 * share)} %`;

/** A share of 0 to 1 in percent. */
export { percent };

const ends = (link) => ` --from ${link.from ?? "all"} --to ${link.to ?? "all"}`;
const option = (name, value, unit = "") => (value ? ` --${name} ${value}${unit}` : "");

function sensorMode(mode) {
  if (typeof mode === "string") return mode;
  const [[name, value]] = Object.entries(mode);
  return typeof value === "number" ? `${name} ${value}` : `${name} ${value.m ?? 0}${option("deg", value.deg)}`;
}

function actuatorMode(mode) {
  if (typeof mode === "string") return mode;
  const [[name, value]] = Object.entries(mode);
  return `${name} ${value}`;
}

/** A fault as the command line takes it and the log has it: `drop --from green --to all --p 0.3`. */
export function faultInWords(fault) {
  const [[name, it]] = Object.entries(fault);
  if (typeof it === "string") return `${name} ${it}`;
  switch (name) {
    case "drop":
      return `drop${ends(it)} --p ${it.p}${option("burst", it.burst_s, "s")}`;
    case "delay":
      return `delay${ends(it)} --by ${it.delay_s}s${option("jitter", it.jitter_s, "s")}`;
    case "duplicate":
    case "reorder":
      return `${name}${ends(it)} --p ${it.p}`;
    case "hold":
      return `hold${ends(it)}`;
    case "partition":
      return `partition ${it.groups.map((group) => group.join(",")).join(" / ")}${it.one_way ? " --one-way" : ""}`;
    case "range":
      return `range ${it.range_m}`;
    case "sensor":
      return `sensor ${it.robot} ${it.device} ${sensorMode(it.mode)}`;
    case "actuator":
      return `actuator ${it.robot} ${actuatorMode(it.mode)}`;
    case "skill":
      return `skill ${it.robot} ${it.skill} ${it.share}`;
    case "obstacle":
      return `obstacle ${it.x_m} ${it.y_m} ${it.width_m} ${it.height_m}${option("penetrability", it.penetrability)}`;
    case "move-robot":
      return `move-robot ${it.robot} ${it.x_m} ${it.y_m}${option("heading", it.heading_deg)}`;
    // What only the mission knows.
    default:
      return [name, ...Object.keys(it).sort().map((key) => `--${key.replaceAll("_", "-")} ${it[key]}`)].join(" ");
  }
}

/** `put an item elsewhere` → `Put an item elsewhere`. */
export function sentence(text) {
  return text.slice(0, 1).toUpperCase() + text.slice(1);
}

/** When and for how long an order holds, beside the fault itself: ` --at 60s --for 30s`. */
export function termsInWords(order) {
  const timed = ["at", "every", "for"].map((name) => {
    const value = order[`${name}_s`];
    return value === null || value === undefined ? "" : ` --${name} ${value}s`;
  });
  return timed.join("") + (order.when ? ` --when "${order.when}"` : "");
}

const REASONS = {
  threshold: "its motivation reached the threshold",
  "not-applicable": "not applicable any more",
  suppressed: "another set of the robot is active",
  "acquiesced-psi": "it acquiesced: ψ has passed and a teammate wants the task",
  "gave-up-lambda": "it gave up: λ has passed",
  arbitration: "a teammate's claim goes first",
  "wait-over": "nobody executes the task any more",
  "wait-bound": "it waited ψ + τ in vain",
};

function reasonInWords(reason) {
  return REASONS[reason] ?? reason.replace(/^reset-by (.*)$/, "reset by the first word of $1");
}

const SENTENCES = {
  activated: (it) => `activates ${it.subject}`,
  waiting: (it) => `waits for ${it.subject}`,
  hibernated: (it) => `hibernates ${it.subject}`,
  "energy-out": () => "has no energy left",
  joined: () => "joins",
  gone: () => "is dead",
  stalled: () => "falls silent",
  back: () => "is back",
  lost: () => "did not get a message",
  progress: (it) => `makes progress in ${it.detail}`,
  detour: () => "goes round an obstacle",
  armed: (it) => `${it.subject} is armed`,
  applied: (it) => `${it.subject} takes effect`,
  hit: (it) => `${it.subject} has its first effect`,
  healed: (it) => `${it.subject} is healed`,
  disarmed: (it) => `${it.subject} is disarmed`,
  failed: (it) => `${it.subject} fails`,
};

const STATE_KINDS = new Set(["activated", "waiting", "hibernated"]);

/** Numbers of few digits, and robots by their names. */
function tidy(detail, names) {
  const short = detail.replace(/-?\d+\.\d{4,}/g, (number) => String(Number(Number(number).toFixed(2)) || 0));
  return short.replace(/robot#(\d+)/g, (rank, index) => names[index] ?? rank);
}

/** What an event says, without its robot, as `{what, why}`; `why` may be empty. `names` are those of the robots, by rank. */
export function eventInWords(event, names) {
  const what = SENTENCES[event.kind]?.(event) ?? [event.kind.replaceAll("-", " "), event.subject].filter(Boolean).join(" ");
  if (STATE_KINDS.has(event.kind)) return { what, why: reasonInWords(event.reason) };
  if (event.kind === "progress") return { what, why: "" };
  return { what, why: tidy([event.reason, event.detail].filter(Boolean).join("; "), names) };
}

/** What became of a message at a receiver: a sign that needs no color, and the word. */
export const DELIVERIES = {
  Heard: { sign: "✓", word: "heard" },
  Delayed: { sign: "◷", word: "heard late" },
  Pending: { sign: "…", word: "on its way" },
  Lost: { sign: "✗", word: "lost" },
  Dropped: { sign: "✗", word: "dropped by a fault" },
  Cut: { sign: "⊘", word: "cut off" },
  Duplicate: { sign: "⧉", word: "came twice" },
};

// Made from the Rust types by the test `the_page_s_types_are_those_of_rust`; not to be changed by hand.

/** A broken actuator. */
export type ActuatorFault = {
  /** How. */
  mode: ActuatorMode;
  /** Whose. */
  robot: string;
};

/** How an actuator fails. */
export type ActuatorMode = "dead" | {
  slowed: number;
} | {
  "turn-bias": number;
} | {
  "one-wheel": Side;
} | "gripper";

/** What an agent is up to. */
export type AgentState = "absent" | "dead" | "coming" | "present" | "silent";

/** A behavior set, by its place in [`crate::scenario::Catalog::sets`]; the same for every robot that has it. */
export type BehaviorId = number;

/** State of a behavior set (thesis §3.3.1). */
export type BehaviorState = "Hibernating" | "Waiting" | "Active";

/** A behavior set of a robot. */
export type BehaviorView = {
  /** Its motivation, with its factors and its state; the utility of its task in its place where there are no motivations, 0 while that is not applicable. */
  motivation: Motivation;
  /** Since when it is in that state. */
  since: SimTime;
};

/** A corner of the curve of a motivation or a utility. Between two corners the curve is a straight line, but for a reset, which is a step. */
export type Bend = {
  /** Time of the step, as in motivations.csv. */
  at: SimTime;
  /** Whether the curve ends here, for the robot took no part in the step after it. */
  last: boolean;
  /** The motivation or utility at its end. */
  level: number;
  /** Whose. */
  robot: RobotId;
  /** Of which behavior set. */
  set: BehaviorId;
  /** The state at its end, until the next corner. */
  state: BehaviorState;
};

/** The kinds of broadcast; each has its own key below `team/<robot>/`. */
export type BroadcastKind = "Heartbeat" | "FirstBulletin" | "SecondBulletin" | "Allocation";

/** Something that befalls some messages on directed links. */
export type Chance = {
  /** Who speaks. */
  from: Who;
  /** Share of messages that it befalls, 0 to 1. */
  p: number;
  /** Who hears it. */
  to: Who;
};

/** The step clock. */
export type ClockStatus = {
  /** Whether no further tick begins. */
  paused: boolean;
  /** Multiple of real time; `null`: as fast as possible. */
  speed: number | null;
  /** Ticks that a step command has left. */
  steps_left: number;
  /** The tick under way, or the next one. */
  tick: number;
  /** For whom it waits, and what would help, once it has stood still for some seconds though nobody holds it. */
  waits_for: string | null;
};

/** Delay of messages on directed links. */
export type Delay = {
  /** Delay of every message, s. */
  delay_s: number;
  /** Who speaks. */
  from: Who;
  /** Up to this much more, evenly distributed, s. */
  jitter_s: number;
  /** Who hears it. */
  to: Who;
};

/** What became of a broadcast at one receiver. */
export type Delivery = "Heard" | "Lost" | "Delayed" | "Duplicate" | "Dropped" | "Cut" | "Pending";

/** A sensing device, by its name: one of [`Device::COMMON`], or one of the mission's own. */
export type Device = string;

/** What goes wrong. Robots go by their names. */
export type Fault = {
  kill: string;
} | {
  terminate: string;
} | {
  pause: string;
} | {
  continue: string;
} | {
  restart: string;
} | {
  add: string;
} | {
  remove: string;
} | {
  drop: Loss;
} | {
  delay: Delay;
} | {
  duplicate: Chance;
} | {
  reorder: Chance;
} | {
  hold: Link;
} | {
  partition: Partition;
} | {
  mute: string;
} | {
  deaf: string;
} | {
  range: RangeFault;
} | {
  radio: RadioQuality;
} | {
  sensor: SensorFault;
} | {
  actuator: ActuatorFault;
} | {
  power: string;
} | {
  babble: string;
} | {
  obstacle: Obstacle;
} | {
  "move-robot": MoveRobot;
} | {
  skill: SkillFault;
};

/** A fault as the world sees it now. */
export type FaultStatus = {
  /** When it last took effect. */
  applied_ms: SimTime | null;
  /** Why it could not be done when it last should; `null` when it could. */
  failed: string | null;
  /** When it last healed. */
  healed_ms: SimTime | null;
  /** How often it has changed something: messages, ticks with a false reading or a disobeyed command, signals. */
  hits: number;
  /** Its id. */
  id: string;
  /** What was ordered. */
  order: Order;
  /** Where it stands. */
  phase: Phase;
};

/** Penetrability of the ground (DESIGN §7): 1 is neutral, less slows down, more speeds up. */
export type Ground = {
  /** One body radius beyond its front. */
  ahead: number;
  /** Under the robot's center. */
  here: number;
};

/** A solid within range of one beam. */
export type Hit = {
  /** Free way along the beam, counted from the robot's edge, m; 0 is contact. */
  distance_m: number;
  /** Direction of the outward surface normal at the hit, in the robot's frame, rad in (-π, π]. */
  normal_rad: number;
};

/** An item that robots take, counted from 0. */
export type ItemId = number;

/** An item. */
export type ItemView = {
  /** Who carries it. */
  carrier: RobotId | null;
  /** Where it lies, m; while it is carried, where it was picked up. */
  position: [number, number];
  /** Half its size, m. */
  radius_m: number;
};

/** Directed links: what `to` hears of `from`. */
export type Link = {
  /** Who speaks. */
  from: Who;
  /** Who hears it. */
  to: Who;
};

/** Loss of messages on directed links. */
export type Loss = {
  /** Mean length of a burst in which every message is lost, s; 0: each message has its own draws (Gilbert 1960). */
  burst_s: number;
  /** Who speaks. */
  from: Who;
  /** Share of messages that get lost in the long run, 0 to 1. */
  p: number;
  /** Who hears it. */
  to: Who;
};

/** Something of a mission that can be seen, for eyes that do not know the mission. */
export type Mark = {
  /** What tells it from the others; the same in every view. Marks of several kinds begin with the number of their kind, which has a color of its own: `2/p7`. */
  id: string;
  /** What people call it; may be empty. */
  label: string;
  /** Where it is. */
  outline: MarkOutline;
  /** What it is there for. */
  role: MarkRole;
  /** How much of it is done, 0 to 1; `None`: that means nothing here. */
  share: number | null;
};

/** The outline of a mark, m. */
export type MarkOutline = {
  disc: {
    /** Its center. */
    center: [number, number];
    /** Its radius. */
    radius_m: number;
  };
} | {
  rectangle: {
    /** Upper right corner. */
    max: [number, number];
    /** Lower left corner. */
    min: [number, number];
  };
} | {
  bar: {
    /** One end. */
    from: [number, number];
    /** Half of its thickness. */
    half_width_m: number;
    /** The other end. */
    to: [number, number];
  };
} | {
  line: {
    /** One end. */
    from: [number, number];
    /** The other end. */
    to: [number, number];
  };
};

/** What a mark is there for: eyes have a color for each. */
export type MarkRole = "item" | "target" | "zone" | "goal" | "range" | "link";

/** What an allocator computes for each behavior set, and what is drawn as its curve. */
export type Measure = "motivation" | "utility";

/** What became of a message at a receiver. */
export type MessageView = {
  /** At whom. */
  receiver: RobotId;
  /** The message and its delivery. */
  reception: Reception;
};

/** One row of motivations.csv: a motivational behavior at the end of a step, with the factors of eq. 2.7. */
export type Motivation = {
  /** Factor (eq. 2.6); `false` = yields or gives up. */
  acquiescence: boolean;
  /** Factor (eq. 2.3); `false` = another set of the robot is active. */
  activity_suppression: boolean;
  /** Rate of this step, motivation/s (eq. 2.4). */
  impatience: number;
  /** Factor (eq. 2.5); `false` = reset in this step. */
  impatience_reset: boolean;
  /** m, in [0, θ]. */
  motivation: number;
  /** Factor (eq. 2.1). */
  sensory_feedback: boolean;
  /** The behavior set. */
  set: BehaviorId;
  /** State at the end of the step. */
  state: BehaviorState;
};

/** A robot elsewhere. */
export type MoveRobot = {
  /** New heading, degrees counter-clockwise from x; absent: as it is. */
  heading_deg: number | null;
  /** Which one. */
  robot: string;
  /** Center, m. */
  x_m: number;
  /** Center, m. */
  y_m: number;
};

/** A rectangle on the floor. */
export type Obstacle = {
  /** Extent in y, m. */
  height_m: number;
  /** [0, 0.1] solid, (0.1, 1) slows by that factor, 1 neutral, above 1 speeds up (thesis §3.2.2.1). */
  penetrability: number;
  /** Extent in x, m. */
  width_m: number;
  /** Lower left corner, m. */
  x_m: number;
  /** Lower left corner, m. */
  y_m: number;
};

/** "Let this happen then, for so long." Without a trigger it happens at once. */
export type Order = {
  /** At this simulated time, s; one that has passed is now. */
  at_s: number | null;
  /** Again and again, this long after the time before, s; the first time at `at_s`, or at once. */
  every_s: number | null;
  /** What happens. */
  fault: Fault;
  /** How long it lasts, s; absent: until it is cleared. What happens in a moment, such as a restart, has no duration. */
  for_s: number | null;
  /** Name, by which it can be cleared; absent: the world gives it one. */
  id: string | null;
  /** When this happens next. */
  when: When | null;
};

/** How a run ended. */
export type Outcome = "complete" | "time-limit" | "interrupted" | "no-robot-left";

/** A partition of the team. */
export type Partition = {
  /** Groups of robots, each robot in one at most. */
  groups: ((string)[])[];
  /** Later groups still hear earlier ones. */
  one_way: boolean;
};

/** Where a fault stands. */
export type Phase = "armed" | "in-force" | "over";

/** Where a body is and where it faces. */
export type Pose = {
  /** Heading in (-π, π], rad counter-clockwise from x. */
  heading_rad: number;
  /** Centre, m. */
  position: [number, number];
};

/** The collision-avoidance sensor (thesis Fig. 4.5 and 4.6): what is solid ahead and beside the robot, the border included. `None` is a free beam. */
export type Proximity = {
  /** Ahead: left, center, right. The outer beams run parallel to the heading at the sides of the body; the center one is as wide as the body, so that it is free exactly when the robot can move ahead by its length. */
  ahead: [Hit | null, Hit | null, Hit | null];
  /** To the left: beams at right angles to the heading from the front, the center and the rear of the body. */
  left: [Hit | null, Hit | null, Hit | null];
  /** The same to the right. */
  right: [Hit | null, Hit | null, Hit | null];
};

/** Quality of the radio on all links. The figures are round numbers of this project, chosen so that a team at the default heartbeat rate of 1 in 2 s hardly notices the first, works worse with the second, and falls apart at times with the third. */
export type RadioQuality = "good-radio" | "poor-radio" | "severe-radio";

/** Radio range. */
export type RangeFault = {
  /** Greatest distance, center to center, m. */
  range_m: number;
};

/** One step's sensor values. Each device is `None` when the robot lacks it or when it is dead. */
export type Readings = {
  /** Energy left, J; `None` where energy is not simulated. */
  energy_j: number | null;
  /** Distance from the robot's edge to the border straight ahead, m, `Some(None)` beyond the sensor's range. */
  front_border: number | null;
  /** Ground sensor. */
  ground: Ground | null;
  /** What the mission's own devices tell. */
  mission: unknown;
  /** Position sensor. */
  pose: Pose | null;
  /** Collision avoidance. */
  proximity: Proximity | null;
  /** The same to the left side; only robots built with a side sensor have it. */
  side_border: number | null;
};

/** One row of messages.csv: a broadcast at one receiver. */
export type Reception = {
  /** When it was, or would have been, audible. */
  at: SimTime;
  /** What became of it. */
  delivery: Delivery;
  /** In which incarnation. */
  incarnation: number;
  /** What it said; `None` when it never arrived. */
  said: Said | null;
  /** Who sent it. */
  sender: RobotId;
  /** When it was sent. */
  sent: SimTime;
};

/** A robot, by its rank: its place in the scenario's list of robots, counted from 0. */
export type RobotId = number;

/** One robot. */
export type RobotView = {
  /** Active behavior set. */
  active: BehaviorId | null;
  /** What it carries. */
  carrying: ItemId | null;
  /** Energy left, J; `None` where energy is not simulated. */
  energy_j: number | null;
  /** Incarnation of its agent, if it has one that is alive. */
  incarnation: number | null;
  /** What the levels of its behavior sets are. */
  measure: Measure;
  /** Process id of its agent, if it has one and is not shown from a log. */
  pid: number | null;
  /** Where its body is. */
  pose: Pose;
  /** What its sensors told it last, broken ones as they are. */
  readings: Readings;
  /** Where devices of the mission's own tell that something is, in the robot's frame, m. */
  sensed: ([number, number])[];
  /** Its behavior sets as last reported, in the order of the catalog. */
  sets: (BehaviorView)[];
  /** How fast it moved in the last step, m/s. */
  speed_m_s: number;
  /** What its agent is up to. */
  state: AgentState;
};

/** The logged part of a broadcast's contents. */
export type Said = {
  /** Its kind. */
  kind: BroadcastKind;
  /** Progress count it claims. */
  progress: number | null;
  /** Running number within the incarnation. */
  seq: number;
  /** Behavior set it is about. */
  set: BehaviorId | null;
  /** Since when; heartbeats only. */
  since: SimTime | null;
  /** State it claims; heartbeats only. */
  state: TaskState | null;
  /** Task it is about. */
  task: TaskId | null;
};

/** Size of an error: the standard deviation of noise, or the amount of a bias. Distances and coordinates, in x and y alike, are off by meters, the heading by degrees. */
export type SensorError = {
  /** Of the heading; position sensor only, degrees. */
  deg: number;
  /** Of lengths, m. */
  m: number;
};

/** A broken sensor. */
export type SensorFault = {
  /** Which one. */
  device: Device;
  /** How. */
  mode: SensorMode;
  /** Whose. */
  robot: string;
};

/** How a sensor fails. */
export type SensorMode = "dead" | "stuck" | {
  noise: SensorError;
} | {
  bias: SensorError;
} | {
  dropout: number;
};

/** A side of a robot. */
export type Side = "left" | "right";

/** Simulated time since the mission's start, in milliseconds; also used for spans of it. */
export type SimTime = number;

/** A skill that has got worse. */
export type SkillFault = {
  /** Whose. */
  robot: string;
  /** Share that is left of it, 0 to 1. */
  share: number;
  /** Which one, by the name that the mission gives it. */
  skill: string;
};

/** A high-level task of the mission, by its place in [`crate::scenario::Catalog::tasks`]. */
export type TaskId = number;

/** What a robot does about a task, as its heartbeats say it. */
export type TaskState = "Executing" | "Waiting" | "Idle" | "Released";

/** What an observer sees. */
export type View = {
  /** Where curves of motivations have bent since the view before, by time for each robot; none in the first view. */
  bends: (Bend)[];
  /** The step clock; `None` of a run that is shown from its log. */
  clock: ClockStatus | null;
  /** Faults that are armed or in force. */
  faults: (FaultStatus)[];
  /** All items that robots can carry, by id. */
  items: (ItemView)[];
  /** What else there is to see of the mission, [`MARKS_MAX`] at most. */
  marks: (Mark)[];
  /** What has become of messages since the view before, the newest [`MESSAGES_MAX`] of them. */
  messages: (MessageView)[];
  /** How many more there were. */
  messages_left_out: number;
  /** The values of mission.csv now, in the order of its columns. */
  mission: (number | null)[];
  /** Its simulated time. */
  now: SimTime;
  /** All rectangles on the floor, solid and not, in the order in which they were put there. */
  obstacles: (Obstacle)[];
  /** How the run ended, once it has: such a view is the last one. */
  outcome: Outcome | null;
  /** One entry per robot, by rank. */
  robots: (RobotView)[];
  /** The tick under way: those before it are finished. */
  tick: number;
};

/** The next event that fits triggers: `ROBOT|any VERB [SUBJECT]`. */
export type When = string;

/** One end of a link: a robot by its name, or `all`. */
export type Who = string;

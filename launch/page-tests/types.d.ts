// Generated from the Rust types by the test `the_page_types_are_up_to_date`. Do not edit.

export type ActuatorFault = {
  mode: ActuatorMode;
  robot: string;
};

export type ActuatorMode = "dead" | {
  slowed: number;
} | {
  "turn-bias": number;
} | {
  "one-wheel": Side;
} | "gripper";

export type AgentState = "absent" | "dead" | "coming" | "present" | "silent";

/** A behavior set: its index in [`crate::Catalog::sets`], the same for every robot that has the set. */
export type BehaviorId = number;

/** The state of a behavior set (thesis §3.3.1). */
export type BehaviorState = "Active" | "Hibernating" | "Waiting";

export type BehaviorView = {
  /** The motivation with its factors and state. For allocators without motivations it contains the utility of the task, or 0 while the task is not applicable. */
  motivation: Motivation;
  /** The time since which the set has been in this state. */
  since: SimTime;
};

/** The kinds of broadcast. Each has its own key below `team/<robot>/`. */
export type BroadcastKind = "Heartbeat" | "FirstBulletin" | "SecondBulletin" | "Allocation";

/** The logged part of a broadcast's contents. */
export type BroadcastSummary = {
  kind: BroadcastKind;
  progress: number | null;
  seq: number;
  set: BehaviorId | null;
  /** The start of the sender's state; heartbeats only. */
  since: SimTime | null;
  /** The sender's state; heartbeats only. */
  state: TaskState | null;
  task: TaskId | null;
};

/** The state of the step clock. */
export type ClockStatus = {
  /** True if no further tick starts. */
  paused: boolean;
  /** The multiple of real time; `null` runs as fast as possible. */
  speed: number | null;
  /** The number of ticks left of a step command. */
  steps_left: number;
  /** The tick in progress, or the next one. */
  tick: number;
  /** The missing robots or processes and a remedy, after an unpaused clock has stood still for some seconds. */
  waits_for: string | null;
};

/** A corner of the curve of a motivation or utility. The curve is a straight line between two corners, except for a reset, which is a step. */
export type Corner = {
  /** The time of the step, as in motivations.csv. */
  at: SimTime;
  /** `true` if the curve ends here, because the robot did not take part in the next step. */
  last: boolean;
  level: number;
  robot: RobotId;
  set: BehaviorId;
  /** The state at the end of the step, valid until the next corner. */
  state: BehaviorState;
};

/** Bit errors in messages on directed links. */
export type Corruption = {
  /** True if receivers drop damaged messages. Otherwise they receive the damaged messages that can be decoded. */
  checksum: boolean;
  from: LinkEnd;
  /** The probability that a bit of the payload flips, 0 to 1. Bits are independent of each other. */
  p: number;
  to: LinkEnd;
};

/** Delay of messages on directed links. */
export type Delay = {
  /** The delay of every message, s. */
  delay_s: number;
  from: LinkEnd;
  /** The maximum additional delay, uniformly distributed, s. */
  jitter_s: number;
  to: LinkEnd;
};

/** The delivery of a broadcast at one receiver. */
export type Delivery = "Received" | "Lost" | "Delayed" | "Duplicate" | "Dropped" | "Cut" | "Pending" | "Faded" | "Blocked" | "Corrupted" | "Damaged";

/** The name of a sensing device: one of [`Device::COMMON`] or one of the mission's own. */
export type Device = string;

/** A trigger by the next event that matches `ROBOT|any VERB [SUBJECT]`. */
export type EventTrigger = string;

/** A failure and its target. Robots are identified by name. */
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
  duplicate: LinkChance;
} | {
  reorder: LinkChance;
} | {
  hold: LinkSelection;
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
} | {
  corrupt: Corruption;
};

/** The present state of a fault. */
export type FaultStatus = {
  /** The simulated time at which the fault last took effect, ms. */
  applied_ms: SimTime | null;
  /** The reason if the latest attempt failed; `null` after a success. */
  failed: string | null;
  /** The simulated time at which the fault last healed, ms. */
  healed_ms: SimTime | null;
  /** The number of effects: messages, ticks with a false reading or an ignored command, and signals. */
  hits: number;
  id: string;
  /** The order that armed the fault. */
  order: Order;
  phase: Phase;
};

/** The penetrability of the ground: 1 is neutral, smaller values slow the robot down, larger values speed it up. */
export type Ground = {
  /** The value one body radius beyond the robot's front. */
  ahead: number;
  /** The value under the robot's center. */
  here: number;
};

/** A solid object within the range of one beam. */
export type Hit = {
  /** The free distance along the beam, m; 0 is contact. It counts from the line at right angles to the beam that touches the body, one radius from its center. For the center beam this is the robot's edge; for the outer beams, the edge is up to one radius behind the line. */
  distance_m: number;
  /** The direction of the outward surface normal at the hit, in the robot's frame, rad in (-π, π]. */
  normal_rad: number;
};

/** An item that robots can carry, numbered from 0. */
export type ItemId = number;

export type ItemView = {
  carrier: RobotId | null;
  /** The position, m. For a carried item, the place where it was picked up. */
  position: [number, number];
  /** Half of the item's size, m. */
  radius_m: number;
};

/** The quantity that an allocator computes for each behavior set, and that its curve shows. */
export type LevelUnit = "motivation" | "utility";

/** A random effect on messages of directed links. */
export type LinkChance = {
  from: LinkEnd;
  /** The share of affected messages, 0 to 1. */
  p: number;
  to: LinkEnd;
};

/** An end of a link: a robot by its name, or `all`. */
export type LinkEnd = string;

/** Directed links from senders to receivers. */
export type LinkSelection = {
  from: LinkEnd;
  to: LinkEnd;
};

/** Loss of messages on directed links. */
export type Loss = {
  /** The mean length of a burst in which every message is lost, s; 0 makes losses independent (Gilbert 1960). */
  burst_s: number;
  from: LinkEnd;
  /** The share of messages that get lost in the long run, 0 to 1. */
  p: number;
  to: LinkEnd;
};

/** A visible object of a mission, in a form that is independent of the mission. */
export type Mark = {
  /** The identifier, constant over all views. If there are several kinds of marks, it begins with the number of the kind, which selects the color: `2/p7`. */
  id: string;
  /** The name for people, possibly empty. */
  label: string;
  outline: MarkOutline;
  role: MarkRole;
  /** The work at the place, whose rest is shown as its filling; `None` if it does not apply. */
  work: Work | null;
};

export type MarkOutline = {
  disc: {
    center: [number, number];
    radius_m: number;
  };
} | {
  rectangle: {
    max: [number, number];
    min: [number, number];
  };
} | {
  bar: {
    from: [number, number];
    half_width_m: number;
    to: [number, number];
  };
} | {
  line: {
    from: [number, number];
    to: [number, number];
  };
};

/** The role of a mark. Observers use one color per role. */
export type MarkRole = "item" | "target" | "zone" | "goal" | "range" | "link";

export type MessageView = {
  receiver: RobotId;
  reception: Reception;
};

/** A row of motivations.csv: a motivational behavior at the end of a step, with the factors of eq. 2.7. */
export type Motivation = {
  /** The factor of eq. 2.6; `false` if the robot yields or gives up. */
  acquiescence: boolean;
  /** The factor of eq. 2.3; `false` if another set of the robot is active. */
  activity_suppression: boolean;
  /** The rate of this step, motivation/s (eq. 2.4). */
  impatience: number;
  /** The factor of eq. 2.5; `false` for a reset in this step. */
  impatience_reset: boolean;
  /** The motivation m, in [0, θ]. */
  motivation: number;
  /** The factor of eq. 2.1. */
  sensory_feedback: boolean;
  set: BehaviorId;
  state: BehaviorState;
};

/** A new place for a robot's body. */
export type MoveRobot = {
  /** The new heading, degrees counter-clockwise from x; absent keeps the present one. */
  heading_deg: number | null;
  robot: string;
  /** The x coordinate of the center, m. */
  x_m: number;
  /** The y coordinate of the center, m. */
  y_m: number;
};

/** A rectangle on the floor that blocks, slows down or speeds up robots. */
export type Obstacle = {
  /** Extent in y, m. */
  height_m: number;
  /** The penetrability: [0, 0.1] is solid, (0.1, 1) slows a robot by that factor, 1 is neutral, above 1 speeds it up (thesis §3.2.2.1). */
  penetrability: number;
  /** Extent in x, m. */
  width_m: number;
  /** The x coordinate of the lower left corner, m. */
  x_m: number;
  /** The y coordinate of the lower left corner, m. */
  y_m: number;
};

/** A fault with its trigger and its duration. Without a trigger it takes effect at once. */
export type Order = {
  /** The simulated time at which the fault takes effect, s. A past time means now. */
  at_s: number | null;
  /** The interval of a repeated fault, s. The first time is `at_s`, or now. */
  every_s: number | null;
  /** The fault to apply when triggered. */
  fault: Fault;
  /** The duration, s; absent lasts until the fault is cleared. Instantaneous faults, such as a restart, have none. */
  for_s: number | null;
  /** The id that clears the fault; absent lets the world choose one. */
  id: string | null;
  /** The event whose next occurrence triggers the fault. */
  when: EventTrigger | null;
};

export type Outcome = "complete" | "time-limit" | "interrupted" | "no-robot-left" | "expired";

export type Partition = {
  /** The groups of robots. A robot is in one group at most. */
  groups: ((string)[])[];
  /** True if later groups still receive messages of earlier ones. */
  one_way: boolean;
};

export type Phase = "armed" | "in-force" | "over";

export type Pose = {
  /** The heading in (-π, π], rad counter-clockwise from x. */
  heading_rad: number;
  /** The position of the centre, m. */
  position: [number, number];
};

/** The collision-avoidance sensor (thesis Fig. 4.5 and 4.6). It detects solid objects ahead and beside the robot, including the border. `None` is a free beam. */
export type Proximity = {
  /** The beams ahead: left, center, right. The outer beams run parallel to the heading at the sides of the body. The center beam is as wide as the body: it is free exactly if the robot can move ahead by its length. */
  ahead: [Hit | null, Hit | null, Hit | null];
  /** The beams at right angles to the heading, from the front, center and rear of the body. */
  left: [Hit | null, Hit | null, Hit | null];
  right: [Hit | null, Hit | null, Hit | null];
};

/** The quality of the radio on all links. The values are round numbers of this project for the default rate of one heartbeat in 2 s. A good radio hardly affects a team, a poor one impairs it, and a severe one separates it at times. */
export type RadioQuality = "good-radio" | "poor-radio" | "severe-radio";

/** A limit of the radio range. */
export type RangeFault = {
  /** The maximum distance, center to center, m. */
  range_m: number;
};

/** The sensor values of one step. A device is `None` if the robot lacks it or if it is dead. */
export type Readings = {
  /** The remaining energy, J; `None` if energy is not simulated. */
  energy_j: number | null;
  /** The distance from the robot's edge to the border straight ahead, m; `Some(None)` beyond the sensor's range. */
  front_border: number | null;
  ground: Ground | null;
  /** The readings of the mission's own devices. */
  mission: unknown;
  pose: Pose | null;
  proximity: Proximity | null;
  /** The distance to the border on the left side. Only robots with a side sensor have it. */
  side_border: number | null;
};

/** A row of messages.csv: a broadcast at one receiver. */
export type Reception = {
  /** The time at which it was received, or would have been. */
  at: SimTime;
  /** The logged contents; `None` if the broadcast did not arrive. */
  content: BroadcastSummary | null;
  delivery: Delivery;
  incarnation: number;
  sender: RobotId;
  sent: SimTime;
};

/** A robot's rank: its index in the scenario's list of robots, from 0. */
export type RobotId = number;

export type RobotView = {
  active: BehaviorId | null;
  carrying: ItemId | null;
  /** The remaining energy, J; `None` if energy is not simulated. */
  energy_j: number | null;
  /** The incarnation of the agent, if it is alive. */
  incarnation: number | null;
  /** The unit of the levels of the robot's behavior sets. */
  measure: LevelUnit;
  /** The process id of the agent; `None` in views from a log. */
  pid: number | null;
  pose: Pose;
  /** The latest sensor readings, including faulty ones. */
  readings: Readings;
  /** The positions that devices of the mission detected, in the robot's frame, m. */
  sensed: ([number, number])[];
  /** The behavior sets as last reported, in the order of the catalog. */
  sets: (BehaviorView)[];
  /** The speed in the last step, m/s. */
  speed_m_s: number;
  state: AgentState;
};

/** The size of an error: the standard deviation of noise, or the amount of a bias. Distances and both coordinates have an error in meters, the heading in degrees. */
export type SensorError = {
  /** The error of the heading, position sensor only, degrees. */
  deg: number;
  m: number;
};

export type SensorFault = {
  /** The name of the sensing device. */
  device: Device;
  mode: SensorMode;
  robot: string;
};

export type SensorMode = "dead" | "stuck" | {
  noise: SensorError;
} | {
  bias: SensorError;
} | {
  dropout: number;
};

export type Side = "left" | "right";

/** The simulated time since the mission's start, or a span of it, in milliseconds. */
export type SimTime = number;

/** A decline of a robot's skill. */
export type SkillFault = {
  robot: string;
  /** The remaining share of the skill, 0 to 1. */
  share: number;
  /** The mission's name of the skill. */
  skill: string;
};

/** A task of the mission: its index in [`crate::Catalog::tasks`]. */
export type TaskId = number;

/** The state of a robot with respect to a task, as in its heartbeats. */
export type TaskState = "Executing" | "Waiting" | "Idle" | "Released";

export type View = {
  /** The step clock; `None` for a run that is shown from its log. */
  clock: ClockStatus | null;
  /** The corners of the motivation curves since the previous view, by time for each robot. The first view contains none. */
  corners: (Corner)[];
  faults: (FaultStatus)[];
  /** The items that robots can carry, by id. */
  items: (ItemView)[];
  /** Other visible objects of the mission, at most [`MARKS_MAX`]. */
  marks: (Mark)[];
  /** The deliveries since the previous view, at most the newest [`MESSAGES_MAX`]. */
  messages: (MessageView)[];
  messages_left_out: number;
  /** The current values of mission.csv, in the order of its columns. */
  mission: (number | null)[];
  now: SimTime;
  /** The rectangles on the floor, solid or not, in the order in which they were added. */
  obstacles: (Obstacle)[];
  /** The outcome of the run in the last view; `None` before. */
  outcome: Outcome | null;
  robots: (RobotView)[];
  tick: number;
};

/** The work at a place. */
export type Work = {
  /** The whole amount, above 0. */
  all: number;
  /** The amount that is left, from 0 to `all`. */
  left: number;
  /** The unit of both amounts, such as `items` or `s`; empty for work that is either left or done. */
  unit: string;
};

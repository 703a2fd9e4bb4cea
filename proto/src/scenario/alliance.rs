//! ALLIANCE parameters and switches: how a scenario states them, and the resolved values in force (ALLIANCE.md §1 and §3).

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Which bundle of switches a scenario starts from (ALLIANCE.md §3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// What the thesis' simulator does.
    Thesis,
    /// What was observed in Parker's experiments of 1998.
    Par98,
    /// Made for a team of real processes.
    #[default]
    Team,
}

impl Preset {
    /// As scenario files have it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Thesis => "thesis",
            Self::Par98 => "par98",
            Self::Team => "team",
        }
    }
}

/// The origin that `0` stands for in comm_received(…, 0, …).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HistoryOrigin {
    /// Literally 0: patience is a once-only thing.
    MissionStart,
    /// The last progress that the teammate reported on the task, the mission's start if none.
    Progress,
}

/// When robots step and hear each other (thesis §4.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StepOrder {
    /// All at once; a broadcast is heard in the next step.
    Simultaneous,
    /// One after the other in rank order; later ones hear earlier ones in the same step.
    InOrder,
}

impl StepOrder {
    /// As written in scenario files and on the command line.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Simultaneous => "simultaneous",
            Self::InOrder => "in-order",
        }
    }
}

/// The answers to what the formulas leave open (ALLIANCE.md §3, one field per row of its table), each with the source that
/// asks the question. Par98: what was observed in Parker's experiments. "Here": decided in this project.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switches {
    /// At θ while a teammate executes an exclusive task: wait and broadcast the wish, else activate at once. Thesis §3.3.1;
    /// Par98 knows no such state.
    pub waiting: bool,
    /// A *waiting* message counts as comm_received in impatience and reset (it always counts in acquiescence). Thesis
    /// §4.3.1: one robot's wish knocked another off, and then it did something else.
    pub waiting_counts: bool,
    /// A set may broadcast its wish in the step in which another set of the robot activates. Thesis §4.3.1, the same place.
    pub wish_when_suppressed: bool,
    /// impatience_reset may switch off an active set, as eq. 2.7 is printed. Thesis §4.4: not seen in Parker's results.
    pub reset_stops_active: bool,
    /// Origin of the comm history, in impatience and reset alike. Eq. 2.4 and 2.5 print 0, the mission's start; progress is
    /// from here, for tasks that recur.
    pub history_origin: HistoryOrigin,
    /// Two robots claim an exclusive task in the same step: the earlier `since` wins, a tie goes to the lower rank, and the
    /// loser becomes waiting; else both run until ψ. Thesis ch. 5 names the problem; the answer is from here.
    pub arbitration: bool,
    /// Say so when a set hibernates; else τ has to find out. From here: the thesis' robots share one broadcast unit
    /// (§4.2.3) and see it without a message.
    pub release_message: bool,
    /// A robot without an active set says that it is idle. From here: idle is not dead.
    pub idle_heartbeat: bool,
}

impl Preset {
    /// The switches of the preset.
    #[must_use]
    pub fn switches(self) -> Switches {
        match self {
            Self::Thesis => Switches {
                waiting: true,
                waiting_counts: true,
                wish_when_suppressed: true,
                reset_stops_active: true,
                history_origin: HistoryOrigin::MissionStart,
                arbitration: false,
                release_message: true,
                idle_heartbeat: false,
            },
            Self::Par98 => Switches {
                waiting: false,
                waiting_counts: false,
                wish_when_suppressed: false,
                reset_stops_active: false,
                history_origin: HistoryOrigin::MissionStart,
                arbitration: false,
                release_message: false,
                idle_heartbeat: false,
            },
            Self::Team => Switches {
                waiting: true,
                waiting_counts: false,
                wish_when_suppressed: false,
                reset_stops_active: false,
                history_origin: HistoryOrigin::Progress,
                arbitration: true,
                release_message: true,
                idle_heartbeat: true,
            },
        }
    }
}

impl Preset {
    /// The step order that a scenario of this preset has if it states none: the thesis' simulator steps in order.
    #[must_use]
    pub fn step_order(self) -> StepOrder {
        match self {
            Self::Thesis => StepOrder::InOrder,
            Self::Par98 | Self::Team => StepOrder::Simultaneous,
        }
    }
}

/// `[alliance]` of a scenario file. Precedence, weakest first: built-in values of the behavior set, `defaults`, `sets`,
/// `robots.NAME.defaults`, `robots.NAME.sets`, a parameter file. A value for a named teammate beats the plain value of its own
/// and of every weaker layer; the plain value of a stronger layer beats it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AllianceSection {
    /// Bundle of switches.
    pub preset: Preset,
    /// θ, one for the whole team.
    pub threshold: f64,
    /// Switches that differ from the preset.
    pub switches: SwitchSection,
    /// Values for every robot and set.
    pub defaults: BehaviorSection,
    /// Values by behavior set.
    pub sets: BTreeMap<String, BehaviorSection>,
    /// Values by robot.
    pub robots: BTreeMap<String, RobotSection>,
}

impl Default for AllianceSection {
    fn default() -> Self {
        Self {
            preset: Preset::default(),
            threshold: 100.0,
            switches: SwitchSection::default(),
            defaults: BehaviorSection::default(),
            sets: BTreeMap::new(),
            robots: BTreeMap::new(),
        }
    }
}

/// `[alliance.robots.NAME]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotSection {
    /// Values for all sets of the robot.
    pub defaults: BehaviorSection,
    /// Values by behavior set.
    pub sets: BTreeMap<String, BehaviorSection>,
}

/// Switches that differ from the preset; each as in [`Switches`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[allow(missing_docs)] // Each field is documented at `Switches`.
pub struct SwitchSection {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waiting: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waiting_counts: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wish_when_suppressed: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reset_stops_active: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub history_origin: Option<HistoryOrigin>,
    /// The run's, where scenario files used to state it: see [`Scenario::step_order`](super::Scenario::step_order).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step_order: Option<StepOrder>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arbitration: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release_message: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub idle_heartbeat: Option<bool>,
}

impl SwitchSection {
    /// A section that states all of them.
    #[must_use]
    pub fn stating(switches: Switches, step_order: StepOrder) -> Self {
        Self {
            waiting: Some(switches.waiting),
            waiting_counts: Some(switches.waiting_counts),
            wish_when_suppressed: Some(switches.wish_when_suppressed),
            reset_stops_active: Some(switches.reset_stops_active),
            history_origin: Some(switches.history_origin),
            step_order: Some(step_order),
            arbitration: Some(switches.arbitration),
            release_message: Some(switches.release_message),
            idle_heartbeat: Some(switches.idle_heartbeat),
        }
    }

    /// The preset's switches with these in their place.
    pub(super) fn over(&self, preset: Switches) -> Switches {
        Switches {
            waiting: self.waiting.unwrap_or(preset.waiting),
            waiting_counts: self.waiting_counts.unwrap_or(preset.waiting_counts),
            wish_when_suppressed: self
                .wish_when_suppressed
                .unwrap_or(preset.wish_when_suppressed),
            reset_stops_active: self.reset_stops_active.unwrap_or(preset.reset_stops_active),
            history_origin: self.history_origin.unwrap_or(preset.history_origin),
            arbitration: self.arbitration.unwrap_or(preset.arbitration),
            release_message: self.release_message.unwrap_or(preset.release_message),
            idle_heartbeat: self.idle_heartbeat.unwrap_or(preset.idle_heartbeat),
        }
    }
}

/// Parameters of a behavior set, as far as one layer of a scenario states them; each as in [`BehaviorParams`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BehaviorSection {
    /// ρ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub broadcast_rate_hz: Option<f64>,
    /// τ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ceased_after_s: Option<f64>,
    /// δ_fast.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fast_impatience: Option<f64>,
    /// δ_slow toward every teammate that is not named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_impatience: Option<f64>,
    /// δ_slow by teammate.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub slow_impatience_toward: BTreeMap<String, f64>,
    /// φ toward every teammate that is not named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub willing_to_affect_s: Option<f64>,
    /// φ by teammate.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub willing_to_affect_toward_s: BTreeMap<String, f64>,
    /// ψ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before_yielding_s: Option<f64>,
    /// λ.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before_giving_up_s: Option<f64>,
}

/// Every ALLIANCE value in force (DESIGN §8, `alliance` of run.json).
#[derive(Clone, Debug, PartialEq)]
pub struct Alliance {
    /// θ.
    pub threshold: f64,
    /// Length of a step, ms.
    pub step_ms: u64,
    /// All switches.
    pub switches: Switches,
    /// By robot name.
    pub robots: BTreeMap<String, RobotParams>,
}

/// One robot's values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotParams {
    /// Its rank.
    pub rank: u16,
    /// By behavior set name.
    pub sets: BTreeMap<String, BehaviorParams>,
}

/// Parameters of one behavior set of one robot (ALLIANCE.md §1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BehaviorParams {
    /// Name of the task.
    pub task: String,
    /// ρ, heartbeats per second.
    pub broadcast_rate_hz: f64,
    /// τ, silence after which a teammate is taken to have ceased, s.
    pub ceased_after_s: f64,
    /// δ_fast, motivation/s.
    pub fast_impatience: f64,
    /// δ_slow by teammate, motivation/s; of a teammate that a large team does not list, that of [`BehaviorParams::OTHERS`].
    pub slow_impatience: BTreeMap<String, f64>,
    /// φ by teammate, s, in the same way.
    pub willing_to_affect_s: BTreeMap<String, f64>,
    /// ψ, s.
    pub before_yielding_s: f64,
    /// λ, s.
    pub before_giving_up_s: f64,
}

impl BehaviorParams {
    /// All teammates that are not listed by name: no robot has this name.
    pub const OTHERS: &str = "*";

    /// δ_slow toward a teammate, motivation/s.
    ///
    /// # Panics
    /// If there is no value for it: resolving a scenario gives one for each teammate.
    #[must_use]
    pub fn slow_toward(&self, teammate: &str) -> f64 {
        Self::toward(&self.slow_impatience, teammate)
    }

    /// φ toward a teammate, s.
    ///
    /// # Panics
    /// If there is no value for it: resolving a scenario gives one for each teammate.
    #[must_use]
    pub fn phi_toward(&self, teammate: &str) -> f64 {
        Self::toward(&self.willing_to_affect_s, teammate)
    }

    fn toward(values: &BTreeMap<String, f64>, teammate: &str) -> f64 {
        let named = values.get(teammate);
        *named.unwrap_or_else(|| &values[Self::OTHERS])
    }
}

//! ALLIANCE parameters and switches: their form in a scenario, and the values in force (ALLIANCE.md §1 and §3).

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// The set of switches that a scenario starts from (ALLIANCE.md §3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// The behavior of the thesis' simulator.
    Thesis,
    /// The behavior observed in Parker's experiments of 1998.
    Par98,
    /// Switches for a team of real processes.
    #[default]
    Team,
}

impl Preset {
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
    /// The literal 0: each teammate can use up a robot's patience only once.
    MissionStart,
    /// The last progress that the teammate reported on the task, or the mission's start.
    Progress,
}

/// The order in which robots step and receive broadcasts (thesis §4.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum StepOrder {
    /// Steps at the same time: a broadcast is received in the next step.
    Simultaneous,
    /// Steps in rank order: later robots receive broadcasts of earlier ones in the same step.
    InOrder,
}

impl StepOrder {
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Simultaneous => "simultaneous",
            Self::InOrder => "in-order",
        }
    }
}

/// The decisions that the formulas leave open, one field per row of the table in ALLIANCE.md §3. Each states its
/// source. "Par98" means Parker's experiments, "own" a decision of this project.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switches {
    /// True: at θ, while a teammate executes an exclusive task, a set waits and broadcasts its wish. False: it
    /// activates at once. Thesis §3.3.1; Par98 has no such state.
    pub waiting: bool,
    /// True if a *waiting* message counts as comm_received in impatience and reset. It always counts in acquiescence.
    /// Thesis §4.3.1: a robot could stop another one and then take a different task.
    pub waiting_counts: bool,
    /// True if a set may broadcast its wish in the step in which another set of the robot activates. Thesis §4.3.1.
    pub wish_when_suppressed: bool,
    /// True if impatience_reset may switch off an active set, as in eq. 2.7. Thesis §4.4: not seen in Parker's results.
    pub reset_stops_active: bool,
    /// The origin of the comm history in impatience and reset. Eq. 2.4 and 2.5 state 0, the mission's start. Own:
    /// progress, for recurring tasks.
    pub history_origin: HistoryOrigin,
    /// True: of two robots that claim an exclusive task in the same step, the earlier `since` wins, then the lower
    /// rank. The other robot waits. False: both run until ψ. Thesis ch. 5 names the problem; the solution is our own.
    pub arbitration: bool,
    /// True: a set that hibernates broadcasts a message. False: teammates detect it after τ. Own: the thesis' robots
    /// share one broadcast unit (§4.2.3) and need no message.
    pub release_message: bool,
    /// True if a robot without an active set broadcasts that it is idle. Own: this distinguishes idle from dead.
    pub idle_heartbeat: bool,
}

impl Preset {
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
    /// Returns the step order of a scenario that states none. The thesis' simulator steps in order.
    #[must_use]
    pub fn step_order(self) -> StepOrder {
        match self {
            Self::Thesis => StepOrder::InOrder,
            Self::Par98 | Self::Team => StepOrder::Simultaneous,
        }
    }
}

/// The section `[alliance]` of a scenario file. Precedence, weakest first: built-in values of the behavior set,
/// `defaults`, `sets`, `robots.NAME.defaults`, `robots.NAME.sets`, a parameter file. A value for a named teammate
/// overrides the plain values of its own layer and of every weaker one. The plain value of a stronger layer overrides
/// it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AllianceSection {
    /// The set of switches to start from.
    pub preset: Preset,
    /// θ, the same for the whole team.
    pub threshold: f64,
    /// Switches that differ from the preset.
    pub switches: SwitchSection,
    /// Values for every robot and set.
    pub defaults: BehaviorSection,
    /// Values by behavior set.
    pub sets: BTreeMap<String, BehaviorSection>,
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

/// The section `[alliance.robots.NAME]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotSection {
    /// Values for all sets of the robot.
    pub defaults: BehaviorSection,
    /// Values by behavior set.
    pub sets: BTreeMap<String, BehaviorSection>,
}

/// Switches that differ from the preset; see [`Switches`].
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
    /// An alternative to [`Scenario::step_order`](super::Scenario::step_order).
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
    #[must_use]
    pub fn from_switches(switches: Switches, step_order: StepOrder) -> Self {
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

    /// Returns the preset's switches, replaced by those that the section states.
    pub(super) fn applied_to(&self, preset: Switches) -> Switches {
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

/// The parameters of a behavior set that one layer of a scenario states; see [`BehaviorParams`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BehaviorSection {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub broadcast_rate_hz: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ceased_after_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fast_impatience: Option<f64>,
    /// δ_slow toward every teammate that is not named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_impatience: Option<f64>,
    /// δ_slow toward a named teammate.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub slow_impatience_toward: BTreeMap<String, f64>,
    /// φ toward every teammate that is not named.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub willing_to_affect_s: Option<f64>,
    /// φ toward a named teammate.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub willing_to_affect_toward_s: BTreeMap<String, f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before_yielding_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub before_giving_up_s: Option<f64>,
}

/// Every ALLIANCE value in force (`alliance` of run.json).
#[derive(Clone, Debug, PartialEq)]
pub struct Alliance {
    pub threshold: f64,
    /// The length of a step, ms.
    pub step_ms: u64,
    pub switches: Switches,
    /// The parameters by robot name. The copies of a setup share them, because a large team has many.
    pub robots: Arc<BTreeMap<String, RobotParams>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobotParams {
    pub rank: u32,
    /// The parameters by behavior set name.
    pub sets: BTreeMap<String, BehaviorParams>,
}

/// Values by the name of a teammate, shared by sets with equal values.
pub type ByTeammate = Arc<BTreeMap<String, f64>>;

/// The file form of [`ByTeammate`]: a map for each set.
mod by_teammate {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use super::{Arc, BTreeMap, ByTeammate};

    pub fn serialize<S: Serializer>(values: &ByTeammate, to: S) -> Result<S::Ok, S::Error> {
        BTreeMap::serialize(values, to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<ByTeammate, D::Error> {
        BTreeMap::deserialize(from).map(Arc::new)
    }
}

/// The parameters of one behavior set of one robot (ALLIANCE.md §1). Meanings and units are those of
/// [`DefaultAllianceParams`](crate::mission::data::DefaultAllianceParams).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BehaviorParams {
    /// The name of the set's task.
    pub task: String,
    pub broadcast_rate_hz: f64,
    pub ceased_after_s: f64,
    pub fast_impatience: f64,
    /// δ_slow by teammate, motivation/s. [`BehaviorParams::OTHERS`] stands for teammates that a large team does not
    /// list.
    #[serde(with = "by_teammate")]
    pub slow_impatience: ByTeammate,
    /// φ by teammate, in the same way, s.
    #[serde(with = "by_teammate")]
    pub willing_to_affect_s: ByTeammate,
    pub before_yielding_s: f64,
    pub before_giving_up_s: f64,
}

impl BehaviorParams {
    /// The entry of all teammates that are not listed. No robot has this name.
    pub const OTHERS: &str = "*";

    /// Returns δ_slow toward a teammate, motivation/s.
    ///
    /// # Panics
    /// Panics if there is no value. A resolved scenario has one for each teammate.
    #[must_use]
    pub fn slow_impatience_toward(&self, teammate: &str) -> f64 {
        Self::toward(&self.slow_impatience, teammate)
    }

    /// Returns φ toward a teammate, s.
    ///
    /// # Panics
    /// Panics if there is no value. A resolved scenario has one for each teammate.
    #[must_use]
    pub fn willing_to_affect_toward_s(&self, teammate: &str) -> f64 {
        Self::toward(&self.willing_to_affect_s, teammate)
    }

    fn toward(values: &BTreeMap<String, f64>, teammate: &str) -> f64 {
        let named = values.get(teammate);
        *named.unwrap_or_else(|| &values[Self::OTHERS])
    }
}

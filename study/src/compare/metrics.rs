//! What is compared of runs.

use alliance_proto::mission::Value;
use alliance_proto::tick::Outcome;

use crate::sweep::measures::Measures;
use crate::sweep::run::Figures;

/// A figure of a run. Less is better, but for completion and targets observed.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Metric {
    /// 1 where the mission was completed, else 0.
    Completion,
    /// Simulated time of a run that completed it.
    Makespan,
    /// The same, and twice the limit for a run that did not.
    Par2,
    /// PAR2 less that of the reference with the same seed.
    Regret,
    /// Broadcasts.
    Messages,
    /// Their payloads.
    Bytes,
    /// Broadcasts of a kind.
    MessagesOf(String),
    /// Their payloads.
    BytesOf(String),
    /// Ways of all robots.
    Distance,
    /// How unevenly they share it.
    DistanceGini,
    /// Energy of all robots.
    Energy,
    /// How unevenly they draw it.
    EnergyGini,
    /// Two or more at an exclusive task.
    Duplicate,
    /// Nobody productive at a task that was applicable.
    Orphan,
    /// Nobody at a task that was applicable.
    Unattended,
    /// From a loss to the first teammate that noticed.
    Detection,
    /// From a loss to the one who took over.
    Takeover,
    /// Of what recurs in the mission.
    Lateness,
    /// Targets in sight, of a mission that goes on until its time is up.
    Observed,
}

impl Metric {
    /// All but those of single kinds of broadcast.
    pub const ALL: [Self; 17] = [
        Self::Completion,
        Self::Makespan,
        Self::Par2,
        Self::Regret,
        Self::Messages,
        Self::Bytes,
        Self::Distance,
        Self::DistanceGini,
        Self::Energy,
        Self::EnergyGini,
        Self::Duplicate,
        Self::Orphan,
        Self::Unattended,
        Self::Detection,
        Self::Takeover,
        Self::Lateness,
        Self::Observed,
    ];

    /// As tables and hypotheses call it, with its unit.
    #[must_use]
    pub fn name(&self) -> String {
        let name = match self {
            Self::Completion => "completion",
            Self::Makespan => "makespan_s",
            Self::Par2 => "par2_s",
            Self::Regret => "regret_s",
            Self::Messages => "messages",
            Self::Bytes => "bytes",
            Self::MessagesOf(kind) => return format!("{kind}_messages"),
            Self::BytesOf(kind) => return format!("{kind}_bytes"),
            Self::Distance => "distance_m",
            Self::DistanceGini => "distance_gini",
            Self::Energy => "energy_j",
            Self::EnergyGini => "energy_gini",
            Self::Duplicate => "duplicate_s",
            Self::Orphan => "orphan_s",
            Self::Unattended => "unattended_s",
            Self::Detection => "detection_s",
            Self::Takeover => "takeover_s",
            Self::Lateness => "lateness_s",
            Self::Observed => "observed",
        };
        name.to_owned()
    }

    /// What it counts, in a sentence.
    #[must_use]
    pub fn meaning(&self) -> &'static str {
        match self {
            Self::Completion => {
                "Share of the runs in which the mission was completed, with Wilson's interval."
            }
            Self::Makespan => {
                "Simulated time to the end of a mission that was completed; other runs have none."
            }
            Self::Par2 => {
                "Makespan, or twice the limit for a run that did not complete the mission: it does not drop the worst runs."
            }
            Self::Regret => {
                "PAR2 less that of the oracle with the same seed and the same faults; the oracle is myopic, so it may be negative."
            }
            Self::Messages => "Broadcasts, each once however many hear it.",
            Self::Bytes => "Their payloads, encoded and sealed.",
            Self::MessagesOf(_) => "Broadcasts of that kind.",
            Self::BytesOf(_) => "Payloads of that kind.",
            Self::Distance => "Ways of all robots together.",
            Self::DistanceGini => "Gini's index of the robots' ways, from 0 (all alike) to 1.",
            Self::Energy => {
                "Energy that all robots draw; nothing where the scenario has no [energy]."
            }
            Self::EnergyGini => "Gini's index of the robots' energy.",
            Self::Duplicate => {
                "Time with two or more robots at an exclusive task, all tasks together."
            }
            Self::Orphan => {
                "Time in which a task was applicable and nobody productive on it, all tasks together."
            }
            Self::Unattended => {
                "Time in which a task was applicable and nobody at it, all tasks together."
            }
            Self::Detection => {
                "From the death or stop of a robot at a task to the first teammate that no longer reckons with it, mean over the run."
            }
            Self::Takeover => {
                "From the death or stop of a robot at an exclusive task to its activation by another, mean over the run."
            }
            Self::Lateness => "The greatest lateness of what recurs in the mission.",
            Self::Observed => {
                "Share of the targets that somebody has in sight, over the whole run (A/n); of missions of observe alone, which always take the same time."
            }
        }
    }

    /// Whether more of it is better.
    #[must_use]
    pub fn more_is_better(&self) -> bool {
        matches!(self, Self::Completion | Self::Observed)
    }

    /// Of a run, if it has any; [`Metric::Regret`] needs another one, too.
    #[must_use]
    pub fn of(&self, figures: &Figures, measures: &Measures) -> Option<f64> {
        let is_complete = figures.outcome == Outcome::Complete;
        let seconds = figures.sim_time_ms as f64 / 1000.0;
        let sent = |kind: &String| measures.sent.get(kind).copied().unwrap_or_default();
        match self {
            Self::Completion => Some(f64::from(u8::from(is_complete))),
            Self::Makespan => is_complete.then_some(seconds),
            Self::Par2 if is_complete => Some(seconds),
            Self::Par2 => Some(2.0 * measures.limit_s),
            Self::Regret => None,
            Self::Messages => Some(figures.messages_sent as f64),
            Self::Bytes => Some(figures.bytes_sent as f64),
            Self::MessagesOf(kind) => Some(sent(kind).messages as f64),
            Self::BytesOf(kind) => Some(sent(kind).bytes as f64),
            Self::Distance => Some(measures.distance_m),
            Self::DistanceGini => Some(measures.distance_gini),
            Self::Energy => measures.energy_j,
            Self::EnergyGini => measures.energy_gini,
            Self::Duplicate => Some(measures.duplicate_s),
            Self::Orphan => Some(measures.orphan_s),
            Self::Unattended => Some(measures.unattended_s),
            Self::Detection => measures.detection_s,
            Self::Takeover => measures.takeover_s,
            Self::Lateness => figures.lateness_ms().map(|ms| ms as f64 / 1000.0),
            Self::Observed => match figures.mission.get("a") {
                Value::Real(share) => Some(share),
                _ => None,
            },
        }
    }
}

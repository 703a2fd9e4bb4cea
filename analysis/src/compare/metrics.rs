//! The compared metrics.

use proto::tick::Outcome;

use crate::sweep::comparison::OwnFigure;
use crate::sweep::measures::ComparisonMeasures;
use crate::sweep::run::Figures;

/// A figure of a run ([`Metric::meaning`]). Less is better, except for completion, finished work and the own
/// figures of some scenarios.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Metric {
    Completion,
    Makespan,
    Par2,
    Done,
    Expired,
    Regret,
    Messages,
    Bytes,
    /// The number of broadcasts of one kind.
    MessagesOf(String),
    /// The payload of the broadcasts of one kind.
    BytesOf(String),
    Distance,
    DistanceGini,
    Energy,
    EnergyGini,
    Duplicate,
    Orphan,
    Unattended,
    Detection,
    Takeover,
    Lateness,
    /// The relative difference to the best known value that the plan states.
    Gap,
    /// The figure by which a scenario ranks its runs.
    Own(OwnFigure),
}

impl Metric {
    /// All metrics except those of single kinds of broadcast, of single missions and of best known values.
    pub const ALL: [Self; 18] = [
        Self::Completion,
        Self::Makespan,
        Self::Par2,
        Self::Done,
        Self::Expired,
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
    ];

    /// Returns the name in tables and hypotheses, with the unit.
    #[must_use]
    pub fn name(&self) -> String {
        let name = match self {
            Self::Completion => "completion",
            Self::Makespan => "makespan_s",
            Self::Par2 => "par2_s",
            Self::Done => "done",
            Self::Expired => "expired",
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
            Self::Gap => "gap",
            Self::Own(own) => own.name.as_str(),
        };
        name.to_owned()
    }

    /// Returns the name in headings, with the unit.
    #[must_use]
    pub fn heading(&self) -> String {
        match self {
            Self::Par2 => "PAR2 in s".to_owned(),
            other => other.name(),
        }
    }

    /// Formats a value with its unit.
    #[must_use]
    pub fn show(&self, value: f64) -> String {
        match self {
            _ if self.name().ends_with("_s") => format!("{value:.0} s"),
            Self::Completion => format!("{:.0} %", 100.0 * value),
            _ if value.abs() < 10.0 => format!("{value:.2}"),
            _ => format!("{value:.1}"),
        }
    }

    /// Returns the number of steps per unit of the grid on which values are compared and ranked. Times are whole
    /// milliseconds, so that equal differences are ties in spite of rounding errors of seconds.
    #[must_use]
    pub fn steps_per_unit(&self) -> f64 {
        match self {
            Self::Makespan | Self::Par2 | Self::Regret | Self::Lateness => 1e3,
            Self::Completion
            | Self::Done
            | Self::Expired
            | Self::Messages
            | Self::Bytes
            | Self::MessagesOf(_)
            | Self::BytesOf(_) => 1.0,
            _ => 1e9,
        }
    }

    /// Returns a value in whole steps of the grid.
    #[must_use]
    pub fn steps(&self, value: f64) -> f64 {
        (value * self.steps_per_unit()).round()
    }

    /// Returns the differences of paired values in steps of the grid, `values` less `base`.
    #[must_use]
    pub fn differences(&self, values: &[f64], base: &[f64]) -> Vec<f64> {
        let pairs = values.iter().zip(base);
        pairs
            .map(|(value, base)| self.steps(*value) - self.steps(*base))
            .collect()
    }

    /// Returns the definition in one sentence.
    #[must_use]
    pub fn meaning(&self) -> &str {
        match self {
            Self::Completion => {
                "Share of the runs in which the mission was completed, with Wilson's interval."
            }
            Self::Makespan => {
                "Simulated time to the end of a mission that was completed; other runs have none."
            }
            Self::Par2 => {
                "Makespan, or twice the limit for a run that did not complete the mission, so the worst runs count."
            }
            Self::Done => "Amount of finished work, such as points served or items delivered.",
            Self::Expired => {
                "Amount of work that expired before it was done; empty in missions in which nothing can expire."
            }
            Self::Regret => {
                "PAR2 minus that of the oracle with the same seed and faults. The oracle is myopic, so regret may be negative."
            }
            Self::Messages => "Broadcasts, each counted once for all receivers.",
            Self::Bytes => "Payload of all broadcasts, encoded and sealed.",
            Self::MessagesOf(_) => "Broadcasts of this kind.",
            Self::BytesOf(_) => "Payload of the broadcasts of this kind.",
            Self::Distance => "Distance that all robots travelled.",
            Self::DistanceGini => "Gini's index of the robots' distances, from 0 (all equal) to 1.",
            Self::Energy => "Energy that all robots drew; empty if the scenario has no [energy].",
            Self::EnergyGini => "Gini's index of the robots' energy.",
            Self::Duplicate => {
                "Time with two or more robots at an exclusive task, summed over all tasks."
            }
            Self::Orphan => {
                "Time in which a task was applicable without a productive robot, summed over all tasks."
            }
            Self::Unattended => {
                "Time in which a task was applicable without a robot at it, summed over all tasks."
            }
            Self::Detection => {
                "Time from the crash or stop of a robot at a task until a teammate first considers it lost; mean over the run."
            }
            Self::Takeover => {
                "Time from the crash or stop of a robot at an exclusive task until another robot activates the task; mean over the run."
            }
            Self::Lateness => "Greatest lateness of a recurring task.",
            Self::Gap => {
                "Relative difference to the best known value of the plan: 0.05 is worse by 5 %, and below 0 is better."
            }
            Self::Own(own) => &own.meaning,
        }
    }

    /// Checks whether a larger value is better.
    #[must_use]
    pub fn more_is_better(&self) -> bool {
        match self {
            Self::Completion | Self::Done => true,
            Self::Own(own) => own.more_is_better,
            _ => false,
        }
    }

    /// Returns the factor with which a smaller value is better: -1 or 1.
    #[must_use]
    pub fn sign(&self) -> f64 {
        if self.more_is_better() { -1.0 } else { 1.0 }
    }

    /// Returns the value for a run, or `None` without one. [`Metric::Regret`] needs a second run and [`Metric::Gap`] a best
    /// known value, so that both are always `None`.
    #[must_use]
    pub fn of(&self, figures: &Figures, measures: &ComparisonMeasures) -> Option<f64> {
        let is_complete = figures.outcome == Outcome::Complete;
        let seconds = figures.sim_time_ms as f64 / 1000.0;
        let sent = |kind: &String| measures.sent.get(kind).copied().unwrap_or_default();
        match self {
            Self::Completion => Some(f64::from(u8::from(is_complete))),
            Self::Makespan => is_complete.then_some(seconds),
            Self::Par2 if is_complete => Some(seconds),
            Self::Par2 => Some(2.0 * measures.limit_s),
            Self::Done => figures.done.map(|count| count as f64),
            Self::Expired => figures.expired.map(|count| count as f64),
            Self::Regret | Self::Gap => None,
            Self::Messages => Some(figures.messages_sent as f64),
            Self::Bytes => Some(figures.bytes_sent as f64),
            Self::MessagesOf(kind) => Some(sent(kind).messages as f64),
            Self::BytesOf(kind) => Some(sent(kind).bytes as f64),
            Self::Lateness => figures.lateness_ms().map(|ms| ms as f64 / 1000.0),
            Self::Own(own) => figures.mission.get(&own.figure).number(),
            measured => {
                let name = measured.name();
                let mut all = measures.figures().into_iter();
                all.find(|(known, _)| *known == name)?.1
            }
        }
    }
}

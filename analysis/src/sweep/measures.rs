//! The measures of a run that only comparisons need, computed as in `alliance report`.

use std::collections::BTreeMap;

use run_log::RunLog;
use scenario::time::SimTime;
use serde::{Deserialize, Serialize};

use super::statistics::mean;
use crate::report::history::{History, HistoryError};
use crate::report::metrics::{Metrics, TaskMetrics};
use crate::report::robot_history::RobotHistory;
use crate::report::spans::Spans;
use in_process::BroadcastCounts;

/// The measures of one run, for the whole team.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ComparisonMeasures {
    /// The run's limit, s of simulated time.
    pub limit_s: f64,
    /// The distance that all robots travelled, m.
    pub distance_m: f64,
    /// Gini's index of the distances over the robots, 0 to 1.
    pub distance_gini: f64,
    /// Energy drawn by all robots, J; `None` if energy is not simulated.
    pub energy_j: Option<f64>,
    /// Gini's index of the energy over the robots, 0 to 1.
    pub energy_gini: Option<f64>,
    /// Time with two or more robots at an exclusive task, over all tasks, s.
    pub duplicate_s: f64,
    /// Time in which a task was applicable without a productive robot, over all tasks, s.
    pub orphan_s: f64,
    /// Time in which a task was applicable without a robot at it, over all tasks, s.
    pub unattended_s: f64,
    /// Mean time from the loss of a robot at a task to the first teammate that considers it lost, s.
    pub detection_s: Option<f64>,
    /// Mean time from the loss of a robot at an exclusive task to the task's activation by another robot, s.
    pub takeover_s: Option<f64>,
    /// Traffic by kind of broadcast; unused kinds are absent.
    pub sent: BTreeMap<String, BroadcastTraffic>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BroadcastTraffic {
    /// The number of broadcasts, each counted once for all receivers.
    pub messages: u64,
    pub bytes: u64,
}

impl ComparisonMeasures {
    /// Returns all measures except the limit and the traffic, with their names in tables.
    #[must_use]
    pub fn figures(&self) -> [(&'static str, Option<f64>); 9] {
        [
            ("distance_m", Some(self.distance_m)),
            ("distance_gini", Some(self.distance_gini)),
            ("energy_j", self.energy_j),
            ("energy_gini", self.energy_gini),
            ("duplicate_s", Some(self.duplicate_s)),
            ("orphan_s", Some(self.orphan_s)),
            ("unattended_s", Some(self.unattended_s)),
            ("detection_s", self.detection_s),
            ("takeover_s", self.takeover_s),
        ]
    }

    /// Computes the measures from a log with every tick.
    pub fn from_log(log: &RunLog, traffic: &BroadcastCounts) -> Result<Self, HistoryError> {
        let history = History::read(log)?;
        let metrics = Metrics::compute(&history, &log.run);
        let ways: Vec<f64> = history.robots.iter().map(way).collect();
        let drawn = drawn(&history);
        let over_tasks = |spans: fn(&TaskMetrics) -> Option<&Spans>| {
            let times = metrics.tasks.iter().filter_map(spans).map(Spans::total);
            let total = times.fold(SimTime::ZERO, |sum, time| sum + time);
            total.as_secs_f64()
        };
        let detections = metrics.failures.iter().filter_map(|failure| {
            let detection = failure.orphan.as_ref()?.detection?;
            Some(detection.at.since(failure.at).as_secs_f64())
        });
        let takeovers = metrics.takeovers.iter();
        let takeovers = takeovers.filter(|takeover| takeover.cause.is_loss());
        let takeovers = takeovers.map(|takeover| takeover.latency().as_secs_f64());
        let bulletins = history.catalog.mission.vocabulary().bulletins;
        let sent = traffic
            .by_kind()
            .filter(|(_, traffic)| traffic.messages > 0);
        let sent = sent.map(|(kind, traffic)| {
            let (messages, bytes) = (traffic.messages, traffic.bytes);
            let traffic = BroadcastTraffic { messages, bytes };
            (kind.name(bulletins).to_owned(), traffic)
        });
        Ok(Self {
            limit_s: log.run.setup.scenario.limit_s,
            distance_m: ways.iter().sum(),
            distance_gini: gini(&ways),
            energy_j: drawn.as_ref().map(|drawn| drawn.iter().sum()),
            energy_gini: drawn.as_deref().map(gini),
            duplicate_s: over_tasks(|task| task.duplicate.as_ref()),
            orphan_s: over_tasks(|task| Some(&task.orphan)),
            unattended_s: over_tasks(|task| Some(&task.unattended)),
            detection_s: mean(&detections.collect::<Vec<_>>()),
            takeover_s: mean(&takeovers.collect::<Vec<_>>()),
            sent: sent.collect(),
        })
    }
}

/// Returns the distance that a robot travelled, m.
fn way(robot: &RobotHistory) -> f64 {
    let steps = robot.track.windows(2).map(|pair| {
        let ((x, y), (to_x, to_y)) = (pair[0].position(), pair[1].position());
        libm::hypot(to_x - x, to_y - y)
    });
    steps.sum()
}

/// Returns the energy that each robot drew, J. Returns `None` if energy is not simulated.
fn drawn(history: &History) -> Option<Vec<f64>> {
    let energy = history.setup.scenario.energy?;
    let left = history.robots.iter().map(|robot| {
        let left = robot.track.last().and_then(|place| place.energy_j);
        f64::from(energy.capacity_j) - f64::from(left.unwrap_or(energy.capacity_j))
    });
    Some(left.collect())
}

/// Returns Gini's index of non-negative amounts: half their mean difference divided by their mean; 0 if all are 0.
fn gini(amounts: &[f64]) -> f64 {
    let sum: f64 = amounts.iter().sum();
    if sum <= 0.0 {
        return 0.0;
    }
    let pairs = amounts
        .iter()
        .flat_map(|a| amounts.iter().map(move |b| (a - b).abs()));
    let differences: f64 = pairs.sum();
    differences / (2.0 * amounts.len() as f64 * sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gini_matches_hand_calculation() {
        assert_eq!(gini(&[]), 0.0);
        assert_eq!(gini(&[0.0, 0.0]), 0.0);
        assert_eq!(gini(&[5.0, 5.0, 5.0]), 0.0);
        // Two of three amounts are 0: 1 - 1/3.
        assert!((gini(&[0.0, 0.0, 9.0]) - 2.0 / 3.0).abs() < 1e-12);
        // Amounts 1, 2, 3: differences 2·(1 + 2 + 1) = 8, divided by 2·3·6.
        assert!((gini(&[1.0, 2.0, 3.0]) - 8.0 / 36.0).abs() < 1e-12);
    }
}

//! run.json: what the run was and what came of it.

use std::collections::BTreeMap;

use alliance_proto::control::FaultStatus;
use alliance_proto::ids::RobotId;
use alliance_proto::scenario::Setup;
use alliance_proto::telemetry::BehaviorState;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use alliance_proto::view::ItemCounts;
use serde::{Deserialize, Serialize};

use super::answers::Answer;
use super::level::LogLevel;
use super::record::{EventKind, TickRecord};
use crate::input::Input;
use crate::world::start_poses;

/// Contents of run.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunFile {
    /// Version of the program that made the run.
    pub version: String,
    /// What the tables hold.
    pub log: LogLevel,
    /// Hash of the whole run, 16 hexadecimal digits; `None` while it is running.
    pub hash: Option<String>,
    /// How it ended.
    pub outcome: RunOutcome,
    /// Whether a stall or loss that the scenario did not ask for changed it.
    pub unscripted: bool,
    /// The run's faults at its end, with how often each has hit, in the order in which they were armed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultStatus>,
    /// Figures.
    pub result: Figures,
    /// `seed`, `scenario` as resolved, and `alliance`: every value that was in force.
    #[serde(flatten)]
    pub setup: Setup,
}

impl RunFile {
    /// Reads run.json and checks it: whoever touched it may have broken anything, and what it holds is run again.
    ///
    /// # Errors
    /// One line: what is wrong, where, and what would be right.
    pub(super) fn parse(text: &[u8]) -> Result<Self, String> {
        let run: Self = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        run.setup.check().map_err(|error| error.to_string())?;
        let scenario = &run.setup.scenario;
        start_poses(scenario).map_err(|error| format!("scenario.{}", error.of(scenario)))?;
        let limit_ms = SimTime::from_secs_f64(scenario.limit_s).0;
        let most = limit_ms.div_ceil(scenario.step_ms);
        let ticks = run.result.ticks;
        if ticks > most {
            return Err(format!(
                "result.ticks: {ticks} is out of range; it must be at most {most}, for the run ends at limit_s"
            ));
        }
        Ok(run)
    }
}

/// How a run ended, if it did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunOutcome {
    /// Not yet, or the world was killed.
    Running,
    /// So.
    #[serde(untagged)]
    Ended(Outcome),
}

/// Result figures of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Number of ticks.
    pub ticks: u64,
    /// Simulated time at the end of the last tick, ms.
    pub sim_time_ms: SimTime,
    /// Where the items were at the end.
    pub items: ItemCounts,
    /// Progress reports made.
    pub reports_made: u32,
    /// How much later than the wanted period after the report before it, or after the start, a report came: the mean over
    /// all reports, ms; `None` without reports. Early ones count as 0.
    pub report_lateness_mean_ms: Option<f64>,
    /// The same of the latest one.
    pub report_lateness_max_ms: Option<u64>,
    /// By robot name.
    pub robots: BTreeMap<String, RobotFigures>,
}

/// One robot's result figures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotFigures {
    /// Lives of its agent.
    pub lives: u32,
    /// Ticks in which a report of it counted.
    pub ticks_counted: u64,
    /// Times that a behavior set became active.
    pub activations: u32,
    /// Items brought to the deposit.
    pub items_delivered: u32,
    /// Progress reports made.
    pub reports_made: u32,
    /// Broadcasts sent.
    pub messages_sent: u64,
    /// Their payloads together, each once: encoded and sealed, without what zenoh and TCP add.
    pub bytes_sent: u64,
    /// Broadcasts of teammates heard.
    pub messages_heard: u64,
    /// Broadcasts of teammates that were not heard: really lost, or dropped or cut off by a fault.
    pub messages_lost: u64,
    /// Those of the heard ones that came late, for a fault delayed them; absent: none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub messages_delayed: u64,
    /// Second copies, ignored; absent: none.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub messages_duplicate: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Adds up the figures of a run.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    figures: Figures,
    /// By rank.
    robots: Vec<RobotFigures>,
    names: Vec<String>,
    step: SimTime,
    report_period: SimTime,
    last_report: SimTime,
    lateness_total_ms: u64,
}

impl Tally {
    pub fn new(setup: &Setup) -> Self {
        let scenario = &setup.scenario;
        Self {
            figures: Figures::default(),
            robots: vec![RobotFigures::default(); scenario.robots.len()],
            names: scenario
                .robots
                .iter()
                .map(|robot| robot.name.clone())
                .collect(),
            step: SimTime(scenario.step_ms),
            report_period: SimTime::from_secs_f64(scenario.waste.report_period_s),
            last_report: SimTime::ZERO,
            lateness_total_ms: 0,
        }
    }

    pub fn add(&mut self, record: &TickRecord<'_>) {
        self.figures.ticks += 1;
        self.figures.sim_time_ms = record.now + self.step;
        self.figures.items = record.items;
        for input in record.inputs {
            if let Input::Join { robot, .. } = input
                && let Some(rank) = self.names.iter().position(|name| name == robot)
            {
                self.robots[rank].lives += 1;
            }
        }
        for (figures, answer) in self.robots.iter_mut().zip(record.answers) {
            if answer.counts {
                figures.add(answer);
            }
        }
        for event in record.events {
            match event.kind {
                EventKind::Delivered => {
                    if let Some(figures) = self.robot(event.robot) {
                        figures.items_delivered += 1;
                    }
                }
                EventKind::Reported => {
                    if let Some(figures) = self.robot(event.robot) {
                        figures.reports_made += 1;
                    }
                    self.add_report(record.now);
                }
                _ => {}
            }
        }
    }

    fn robot(&mut self, robot: Option<RobotId>) -> Option<&mut RobotFigures> {
        self.robots.get_mut(robot?.index())
    }

    fn add_report(&mut self, now: SimTime) {
        let late_ms = now.since(self.last_report + self.report_period).0;
        self.last_report = now;
        self.lateness_total_ms += late_ms;
        let figures = &mut self.figures;
        figures.reports_made += 1;
        figures.report_lateness_max_ms = figures.report_lateness_max_ms.max(Some(late_ms));
        figures.report_lateness_mean_ms =
            Some(self.lateness_total_ms as f64 / f64::from(figures.reports_made));
    }

    /// The figures so far.
    pub fn figures(&self) -> Figures {
        let mut figures = self.figures.clone();
        let robots = self.names.iter().cloned().zip(self.robots.iter().copied());
        figures.robots = robots.collect();
        figures
    }
}

impl RobotFigures {
    fn add(&mut self, answer: &Answer) {
        let (report, deliveries) = (&answer.report, answer.deliveries);
        self.ticks_counted += 1;
        self.messages_sent += u64::from(report.broadcasts);
        self.bytes_sent += u64::from(report.broadcast_bytes);
        self.messages_heard += u64::from(deliveries.heard + deliveries.delayed);
        self.messages_delayed += u64::from(deliveries.delayed);
        self.messages_lost += u64::from(deliveries.lost);
        self.messages_duplicate += u64::from(deliveries.duplicate);
        let activated = report
            .changes
            .iter()
            .filter(|change| change.to == BehaviorState::Active);
        self.activations += activated.count() as u32;
    }
}

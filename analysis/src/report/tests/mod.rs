//! Metrics of hand-made logs. Steps take 0.5 s; times are in seconds.

mod histories;
mod losses;
mod tasks;

use std::path::Path;
use std::sync::Arc;

use missions::Registry;
use missions::waste::data::default_scenario;
use proto::tick::Outcome;
use proto::view::LevelUnit;
use run_log::{
    AllocationRow, EventRow, Figures, LogLevel, MemoryLog, MessageRow, MotivationRow, PoseRow,
    RobotFigures, RunFile, RunLog, RunOutcome, Table,
};
use scenario::ids::TaskId;
use scenario::time::SimTime;
use scenario::{Robot, Scenario, Setup, TaskSection};

use super::failures::{
    Detection, DetectionSign, Failure, Loss, OrphanOutcome, OrphanedTask, Takeover, TakeoverCause,
};
use super::figures::{FigureSelection, figures};
use super::history::History;
use super::made::RunOrigin as MadeHow;
use super::metrics::{Metrics, Occurrence, SentTotals};
use super::page::{RunSection, page};
use super::spans::{Span, Spans};
use super::stints::StintEnd;
use crate::visit;
use in_process::Team;

const BLUE: usize = 0;
const GOLD: usize = 1;
const GREEN: usize = 2;

const TOP: &str = "move-spill(top)";
const BOTTOM: &str = "move-spill(bottom)";
const REPORT: &str = "report-progress";

const STEP_MS: u64 = 500;

fn at(seconds: f64) -> SimTime {
    SimTime::from_secs_f64(seconds)
}

fn spans<const N: usize>(spans: [(f64, f64); N]) -> Spans {
    let span = |(from, to)| Span {
        from: at(from),
        to: at(to),
    };
    spans.into_iter().map(span).collect()
}

/// A log under construction.
struct Made {
    history: History,
    figures: Figures,
    outcome: RunOutcome,
}

impl Made {
    /// Creates a log of the default team with τ = 5 s and no rows.
    fn run(seconds: f64) -> Self {
        Self::with(seconds, |_| {})
    }

    fn with(seconds: f64, change: impl FnOnce(&mut Scenario)) -> Self {
        let mut scenario = Scenario {
            step_ms: STEP_MS,
            ..default_scenario()
        };
        change(&mut scenario);
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        Self {
            history: History::new(setup, at(seconds)),
            figures: Figures::default(),
            outcome: RunOutcome::Ended(Outcome::Complete),
        }
    }

    /// Adds rows for a robot in all ticks of an interval. Both spills' tasks are applicable, the set `active` is
    /// active, and all impatience is fast.
    fn during(&mut self, robot: &str, from: f64, to: f64, active: Option<&str>) {
        self.rows(robot, from, to, |row| {
            if Some(row.behavior_set.as_str()) == active {
                row.state = "active".to_owned();
            }
        });
    }

    fn rows(&mut self, robot: &str, from: f64, to: f64, change: impl Fn(&mut MotivationRow)) {
        let rank = self.history.rank(robot).unwrap();
        let sets: Vec<(String, f64)> = self.history.robots[rank]
            .sets
            .iter()
            .map(|set| (set.name.clone(), set.params.fast_impatience))
            .collect();
        for t_ms in (at(from).0..at(to).0).step_by(STEP_MS as usize) {
            for (set, fast) in &sets {
                let mut row = MotivationRow {
                    t_ms: SimTime(t_ms),
                    robot: robot.to_owned(),
                    behavior_set: set.clone(),
                    task: String::new(),
                    motivation: 1.0,
                    impatience: *fast,
                    sensory_feedback: set.starts_with("move-spill"),
                    activity_suppression: true,
                    impatience_reset: true,
                    acquiescence: true,
                    state: "hibernating".to_owned(),
                };
                change(&mut row);
                self.history.add_motivation(&row).unwrap();
            }
        }
    }

    fn event(&mut self, seconds: f64, kind: &str, robot: &str, rest: [&str; 3]) {
        let [subject, reason, detail] = rest.map(str::to_owned);
        self.history.events.push(EventRow {
            t_ms: at(seconds),
            kind: kind.to_owned(),
            robot: robot.to_owned(),
            subject,
            reason,
            detail,
        });
    }

    /// Adds a receipt: the receiver learns that the sender executes the task.
    fn claim(&mut self, seconds: f64, receiver: &str, sender: &str, task: &str) {
        self.message(seconds, receiver, sender, task, "executing", "received");
    }

    fn message(
        &mut self,
        seconds: f64,
        receiver: &str,
        sender: &str,
        task: &str,
        state: &str,
        delivery: &str,
    ) {
        let row = MessageRow {
            t_ms: at(seconds),
            receiver: receiver.to_owned(),
            sender: sender.to_owned(),
            incarnation: 1,
            seq: Some(0),
            kind: "heartbeat".to_owned(),
            state: state.to_owned(),
            since_ms: None,
            behavior_set: task.to_owned(),
            task: task.to_owned(),
            progress: None,
            sent_ms: at(seconds - 0.5),
            delivery: delivery.to_owned(),
        };
        self.history.add_message(&row).unwrap();
    }

    fn run_file(&self) -> RunFile {
        RunFile {
            version: String::new(),
            log: LogLevel::Full,
            hash: None,
            outcome: self.outcome,
            unscripted: false,
            faults: Vec::new(),
            build: String::new(),
            agent_builds: std::collections::BTreeMap::new(),
            controllers: std::collections::BTreeMap::new(),
            result: self.figures.clone(),
            setup: self.history.setup.clone(),
        }
    }

    fn metrics(&self) -> Metrics {
        Metrics::compute(&self.history, &self.run_file())
    }

    /// Returns the page without figures.
    fn page(&self) -> String {
        let (page, _) = page(&RunSection {
            run: &self.run_file(),
            history: &self.history,
            metrics: &self.metrics(),
            figures: Vec::new(),
            made: MadeHow::default(),
        });
        page
    }

    fn task(&self, name: &str) -> TaskId {
        self.history.task_named(name).unwrap()
    }
}

/// Gold executes the upper spill's task from 10 s, delivers in the step before 20 s and dies at 30 s. Blue takes over
/// at 45 s, delivers before 55 s and continues to 60 s.
fn death() -> Made {
    let mut made = Made::run(60.0);
    made.during("gold", 0.0, 10.0, None);
    made.during("gold", 10.0, 30.0, Some(TOP));
    made.during("blue", 0.0, 45.0, None);
    made.during("blue", 45.0, 60.0, Some(TOP));
    made.during("green", 0.0, 60.0, None);
    for second in 10..30 {
        let received = f64::from(second) + 0.5;
        made.claim(received, "blue", "gold", TOP);
        // Green does not receive gold's last message.
        let delivery = if second == 29 { "lost" } else { "received" };
        made.message(received, "green", "gold", TOP, "executing", delivery);
        // Claims of another task do not matter.
        made.claim(received + 0.5, "green", "blue", BOTTOM);
    }
    made.event(10.0, "activated", "gold", [TOP, "threshold", TOP]);
    made.event(19.5, "delivered", "gold", ["item-1", "", ""]);
    made.event(20.0, "progress", "gold", ["", "", TOP]);
    made.event(30.0, "gone", "gold", ["", "", ""]);
    made.event(45.0, "activated", "blue", [TOP, "threshold", TOP]);
    made.event(54.5, "delivered", "blue", ["item-2", "", ""]);
    made
}

/// Runs a setup in this process and returns its history and run.json.
pub fn run_of(setup: Setup) -> (History, RunFile) {
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    let log =
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
    (History::read(&log).unwrap(), log.run)
}

/// Runs a setup in this process and returns its history.
pub fn history_of(setup: Setup) -> History {
    run_of(setup).0
}

/// Runs a shipped scenario up to `limit_s` and returns its metrics.
fn shipped(scenario: &str, limit_s: f64) -> Metrics {
    let vocabulary = Registry::built_in().vocabulary();
    let text = vocabulary.builtin(scenario).unwrap().text;
    let mut scenario = Scenario::parse(scenario, text, &vocabulary).unwrap();
    scenario.limit_s = limit_s;
    scenario.faults.timeline.clear();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
    let (_, recorder) = team.run().unwrap();
    let log = RunLog::from_memory(&recorder.into_sink(), &vocabulary).unwrap();
    Metrics::compute(&History::read(&log).unwrap(), &log.run)
}

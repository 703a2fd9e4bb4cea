//! Metrics of hand-made logs. Steps take 0.5 s; times are in seconds.

mod histories;
mod losses;
mod takeovers;
mod tasks;

use std::path::Path;
use std::sync::Arc;

use missions::waste::data::default_scenario;
use proto::event::EventLine;
use proto::tick::Outcome;
use proto::view::LevelUnit;
use run_log::{
    AllocationRow, EventRow, Figures, LogLevel, MemoryLog, MessageRow, MotivationRow, PoseRow,
    RobotFigures, RunFile, RunLog, RunOutcome, Table,
};
use scenario::ids::TaskId;
use scenario::time::SimTime;
use scenario::{Robot, Scenario, Setup, TaskSection};

use super::figures::{FigureSelection, figures};
use super::history::History;
use super::made::RunOrigin as MadeHow;
use super::metrics::{Metrics, Occurrence, SentTotals};
use super::page::{RunSection, page};
use super::spans::Spans;
use super::takeovers::event_line;
use crate::replay_views::retrace_into;
use crate::{testkit, visit};
use observation::detections::DetectionWatch;
use observation::stints::{Loss, Span, StintEnd};
use observation::takeovers::{
    LossTakeover, TakeoverCause, TakeoverDetector, find_all, loss_takeovers,
};

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

pub fn motivation(t_ms: u64, robot: &str, set: &str) -> MotivationRow {
    MotivationRow {
        t_ms: SimTime(t_ms),
        robot: robot.to_owned(),
        behavior_set: set.to_owned(),
        task: String::new(),
        motivation: 0.0,
        impatience: 1.0,
        sensory_feedback: true,
        activity_suppression: true,
        impatience_reset: true,
        acquiescence: true,
        state: "hibernating".to_owned(),
    }
}

fn utility(t_ms: u64, set: &str, utility: f64) -> AllocationRow {
    AllocationRow {
        t_ms: SimTime(t_ms),
        robot: "blue".to_owned(),
        task: TOP.to_owned(),
        behavior_set: set.to_owned(),
        utility,
        holder: String::new(),
        state: "hibernating".to_owned(),
    }
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

    /// Creates a log with the rows and events of a text.
    fn of(seconds: f64, text: &str) -> Self {
        let mut made = Self::run(seconds);
        made.add(text);
        made
    }

    fn with(seconds: f64, change: impl FnOnce(&mut Scenario)) -> Self {
        let mut scenario = Scenario {
            step_ms: STEP_MS,
            ..default_scenario()
        };
        change(&mut scenario);
        Self {
            history: History::new(testkit::setup(scenario), at(seconds)),
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
                    motivation: 1.0,
                    impatience: *fast,
                    sensory_feedback: set.starts_with("move-spill"),
                    ..motivation(t_ms, robot, set)
                };
                change(&mut row);
                self.history.add_motivation(&row).unwrap();
            }
        }
    }

    /// Adds the rows and events of a text. A line with a robot, two times and a task, or `-`, is as [`Self::during`]. A
    /// line with a time, a kind of event, a robot and a reason is as [`Self::event`].
    fn add(&mut self, text: &str) {
        for line in text.lines().filter(|line| !line.trim().is_empty()) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let seconds = |word: &str| word.parse::<f64>().unwrap();
            match words[0].parse() {
                Ok(at) => self.event(at, words[1], words[2], &words[3..].join(" ")),
                Err(_) => {
                    let active = (words[3] == "top").then_some(TOP);
                    self.during(words[0], seconds(words[1]), seconds(words[2]), active);
                }
            }
        }
    }

    /// Adds an event. Changes of behavior sets and progress are about the upper spill.
    fn event(&mut self, seconds: f64, kind: &str, robot: &str, reason: &str) {
        let (subject, detail) = match kind {
            "activated" | "hibernated" | "waiting" => (TOP, TOP),
            "progress" => ("", TOP),
            _ => ("", ""),
        };
        self.history.events.push(EventRow {
            t_ms: at(seconds),
            kind: kind.to_owned(),
            robot: robot.to_owned(),
            subject: subject.to_owned(),
            reason: reason.to_owned(),
            detail: detail.to_owned(),
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
            log: LogLevel::Full,
            outcome: self.outcome,
            result: self.figures.clone(),
            setup: self.history.setup.clone(),
            ..visit::run_file()
        }
    }

    fn metrics(&self) -> Metrics {
        let mut history = self.history.clone();
        history.events.extend(self.activations());
        history.events.sort_by_key(|event| event.t_ms);
        Metrics::compute(&history, &self.run_file())
    }

    /// Returns the rows of activations in the rows of motivations, unless the log has a row for the start.
    fn activations(&self) -> Vec<EventRow> {
        let has_row = |robot: &str, at: SimTime| {
            self.history.events.iter().any(|event| {
                let begins = ["activated", "back"].contains(&event.kind.as_str());
                begins && event.robot == robot && event.t_ms == at
            })
        };
        let mut rows = Vec::new();
        for robot in &self.history.robots {
            for set in &robot.sets {
                let starts = set.active.iter().map(|span| span.from);
                rows.extend(
                    starts
                        .filter(|at| !has_row(&robot.name, *at))
                        .map(|at| EventRow {
                            t_ms: at,
                            kind: "activated".to_owned(),
                            robot: robot.name.clone(),
                            subject: set.name.clone(),
                            reason: String::new(),
                            detail: String::new(),
                        }),
                );
            }
        }
        rows
    }

    /// Returns the page without figures.
    fn page(&self) -> String {
        let (page, _) = page(&RunSection {
            run: &self.run_file(),
            history: &self.history,
            metrics: &self.metrics(),
            figures: Vec::new(),
            undrawn: Vec::new(),
            made: MadeHow::default(),
        });
        page
    }

    fn task(&self, name: &str) -> TaskId {
        self.history.task_named(name).unwrap()
    }

    /// Describes all losses, and then all takeovers, one per line.
    fn facts(&self) -> Vec<String> {
        let metrics = self.metrics();
        let name = |rank: usize| &*self.history.robots[rank].name;
        let losses = metrics.failures.iter().map(|failure| {
            let mut text = format!("{} {} {:?}", failure.at, name(failure.robot), failure.loss);
            if let Some(at) = failure.returned_at {
                text += &format!(", back {at}");
            }
            if let Some(orphan) = &failure.orphan {
                if let Some(found) = orphan.detection {
                    let by = name(found.robot);
                    text += &format!(", {:?} of {by} {}", found.sign, found.at);
                }
                text += &format!(", {:?}", orphan.aftermath);
            }
            text
        });
        let takeovers = metrics.takeovers.iter().map(|takeover| {
            let (from, to) = (name(takeover.from), name(takeover.robot));
            let (at, since) = (takeover.at, takeover.idle_since);
            format!("{at} {from} to {to}, {since}, {:?}", takeover.cause)
        });
        losses.chain(takeovers).collect()
    }
}

/// Creates an empty log in which up to `max_robots` robots share the upper spill's task.
fn shared(seconds: f64, max_robots: u32) -> Made {
    Made::with(seconds, |scenario| {
        let section = TaskSection {
            max_robots: Some(max_robots),
            ..TaskSection::default()
        };
        scenario.tasks.insert(TOP.to_owned(), section);
    })
}

/// Gold executes the upper spill's task from 10 s, delivers in the step before 20 s and dies at 30 s. Blue takes over
/// at 45 s, delivers before 55 s and continues to 60 s.
fn death() -> Made {
    let mut made = Made::of(
        60.0,
        "
        gold 0 10 -
        gold 10 30 top
        blue 0 45 -
        blue 45 60 top
        green 0 60 -
        10 activated gold threshold
        19.5 delivered gold
        20 progress gold
        30 gone gold
        45 activated blue threshold
        54.5 delivered blue
        ",
    );
    for second in 10..30 {
        let received = f64::from(second) + 0.5;
        made.claim(received, "blue", "gold", TOP);
        // Green does not receive gold's last message.
        let delivery = if second == 29 { "lost" } else { "received" };
        made.message(received, "green", "gold", TOP, "executing", delivery);
        // Claims of another task do not matter.
        made.claim(received + 0.5, "green", "blue", BOTTOM);
    }
    made
}

/// Runs a setup in this process and returns its history and run.json.
pub fn run_of(setup: Setup) -> (History, RunFile) {
    let log = testkit::run(setup);
    (History::read(&log).unwrap(), log.run)
}

/// Runs a shipped scenario up to `limit_s` and returns its metrics.
fn shipped(scenario: &str, limit_s: f64) -> Metrics {
    let mut scenario = testkit::shipped(scenario);
    scenario.limit_s = limit_s;
    scenario.faults.timeline.clear();
    let (history, run) = run_of(testkit::setup(scenario));
    Metrics::compute(&history, &run)
}

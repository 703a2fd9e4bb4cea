//! The events of a mission from its log: robot, order and reason. The tests of scenarios assert orders and causes,
//! not times.

use alliance_tests::runs::{self, builtin, log_of, run};
use missions::waste::data::WasteSection;
use run_log::{EventRow, LogLevel, MessageRow, MotivationRow, PoseRow, RunFile, RunLog};
use scenario::time::SimTime;
use scenario::{BehaviorParams, Setup};

pub const METHODICAL: &str = "find-locations-methodical";
pub const WANDER: &str = "find-locations-wander";
pub const TOP: &str = "move-spill(top)";
pub const BOTTOM: &str = "move-spill(bottom)";
pub const REPORT: &str = "report-progress";

pub struct Story {
    pub events: Vec<EventRow>,
    pub poses: Vec<PoseRow>,
    motivations: Vec<MotivationRow>,
    messages: Vec<MessageRow>,
    run: RunFile,
}

/// A state change: robot, behavior set, event, reason.
pub type Change<'a> = (&'a str, &'a str, &'a str, &'a str);

#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    pub by: &'a str,
    pub due: SimTime,
    pub made: SimTime,
}

pub fn setup(name: &str, seed: u64) -> Setup {
    runs::setup(builtin(name), seed)
}

impl Story {
    /// Runs a mission in this process and reads its log.
    pub fn play(setup: Setup) -> Self {
        Self::read(log_of(run(setup, LogLevel::Full).1))
    }

    pub fn read(log: RunLog) -> Self {
        Self {
            events: log.rows().unwrap(),
            poses: log.rows().unwrap(),
            motivations: log.rows().unwrap(),
            messages: log.rows().unwrap(),
            run: log.run,
        }
    }

    pub fn step(&self) -> SimTime {
        SimTime(self.run.setup.scenario.step_ms)
    }

    pub fn threshold(&self) -> f64 {
        self.run.setup.alliance.threshold
    }

    /// Returns the parameters of a behavior set after all defaults.
    pub fn params(&self, robot: &str, set: &str) -> &BehaviorParams {
        &self.run.setup.alliance.robots[robot].sets[set]
    }

    pub fn report_period(&self) -> SimTime {
        SimTime::from_secs_f64(WasteSection::of(&self.run.setup.scenario).report_period_s)
    }

    pub fn all(&self, kind: &str) -> impl Iterator<Item = &EventRow> {
        self.events.iter().filter(move |row| row.kind == kind)
    }

    pub fn count(&self, kind: &str, robot: &str) -> usize {
        self.all(kind).filter(|row| row.robot == robot).count()
    }

    /// Returns the only event of a kind.
    #[track_caller]
    pub fn only(&self, kind: &str) -> &EventRow {
        let rows: Vec<_> = self.all(kind).collect();
        assert_eq!(rows.len(), 1, "{rows:?}");
        rows[0]
    }

    /// Returns the time at which a robot's behavior set first became active.
    #[track_caller]
    pub fn first_activation(&self, robot: &str, set: &str) -> SimTime {
        let mut rows = self.all("activated");
        let first = rows.find(|row| row.robot == robot && row.subject == set);
        first.unwrap().t_ms
    }

    /// Returns the state changes of the behavior sets of a task, of all robots.
    pub fn changes(&self, task: &str) -> Vec<&EventRow> {
        let rows = self.events.iter();
        rows.filter(|row| is_change(row) && row.detail == task)
            .collect()
    }

    /// Returns the active behavior set of a robot at the end of a step.
    pub fn active(&self, robot: &str, at: SimTime) -> Option<&str> {
        let mut active = None;
        for row in &self.events {
            if row.robot != robot || row.t_ms > at || !is_change(row) {
                continue;
            }
            match row.kind.as_str() {
                "activated" => active = Some(row.subject.as_str()),
                _ => active = active.filter(|set| *set != row.subject),
            }
        }
        active
    }

    /// Returns the motivation rows of a behavior set, step by step.
    pub fn motivations(&self, robot: &str, set: &str) -> Vec<&MotivationRow> {
        let rows = self.motivations.iter();
        rows.filter(|row| row.robot == robot && row.behavior_set == set)
            .collect()
    }

    /// Returns the motivation of a behavior set in a step.
    #[track_caller]
    pub fn motivation(&self, robot: &str, set: &str, at: SimTime) -> f64 {
        let mut rows = self.motivations.iter();
        let row = rows.find(|row| row.t_ms == at && row.robot == robot && row.behavior_set == set);
        row.unwrap().motivation
    }

    /// Returns the time at which a robot first received a message of another robot about a task.
    #[track_caller]
    pub fn first_received(&self, receiver: &str, sender: &str, task: &str) -> SimTime {
        let mut rows = self.messages.iter();
        let received = |row: &&MessageRow| row.receiver == receiver && row.delivery == "received";
        let row = rows.find(|row| received(row) && row.sender == sender && row.task == task);
        row.unwrap().t_ms
    }

    pub fn reports(&self) -> Vec<Report<'_>> {
        let mut last = SimTime::ZERO;
        self.all("reported")
            .map(|row| Report {
                by: &row.robot,
                due: std::mem::replace(&mut last, row.t_ms) + self.report_period(),
                made: row.t_ms,
            })
            .collect()
    }
}

impl Report<'_> {
    pub fn lateness(&self) -> SimTime {
        self.made.since(self.due)
    }
}

/// Returns the state change of an event row, without its time.
pub fn change(row: &EventRow) -> Change<'_> {
    (&row.robot, &row.subject, &row.kind, &row.reason)
}

fn is_change(row: &EventRow) -> bool {
    matches!(row.kind.as_str(), "activated" | "waiting" | "hibernated")
}

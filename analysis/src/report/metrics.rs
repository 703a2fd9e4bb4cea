//! The metrics of a report. `page` contains their definitions.

use std::collections::HashMap;

use proto::tick::Outcome;
use run_log::{RobotFigures, RunFile, RunOutcome};
use scenario::ids::TaskId;
use scenario::mission::columns::ColumnKind;
use scenario::time::SimTime;

use super::failures::{Failure, failures};
use super::history::History;
use super::robot_history::{RobotHistory, SetHistory};
use super::spans::Spans;
use super::takeovers::event_line;
use observation::stints::Stint;
use observation::takeovers::{Found, Takeover, find_all};

#[derive(Clone, Debug)]
pub struct Metrics {
    /// The simulated time to the end of the last tick; `None` if the mission was not complete.
    pub makespan: Option<SimTime>,
    pub robots: Vec<RobotMetrics>,
    /// Metrics by catalog index.
    pub tasks: Vec<TaskMetrics>,
    /// Recurring events, one entry for each time column.
    pub recurring: Vec<Recurring>,
    pub failures: Vec<Failure>,
    pub takeovers: Vec<Takeover>,
    pub stints: Vec<Stint>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotMetrics {
    /// The time in which the robot was neither dead nor stopped.
    pub present: SimTime,
    /// The part of `present` without an active behavior set.
    pub idle: SimTime,
    pub activations: u32,
    /// The sent messages; `None` until run.json has a result, because the log lists broadcasts only by receiver.
    pub sent: Option<SentTotals>,
}

/// The broadcasts of a robot. Each broadcast counts once, independent of its receivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SentTotals {
    pub messages: u64,
    /// The published payload bytes: encoded and sealed, without the overhead of zenoh and TCP.
    pub bytes: u64,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskMetrics {
    /// The time in which a behavior set for the task was applicable in a present robot.
    pub applicable: Spans,
    /// The part of `applicable` without a productive robot: no stint has a later effect.
    pub orphan: Spans,
    /// The part of `applicable` in which no robot executed the task.
    pub unattended: Spans,
    /// The time in which two or more robots executed the task; `None` if it is not exclusive.
    pub duplicate: Option<Spans>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recurring {
    pub event: &'static str,
    /// The wanted period; `None` if the mission has none.
    pub period: Option<SimTime>,
    pub moments: Vec<Occurrence>,
    /// The excess over the period at the end of the log, counted from the latest event or the start.
    pub overdue: SimTime,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Occurrence {
    pub at: SimTime,
    /// Rank of the robot; `None` if run.json has no such name.
    pub by: Option<usize>,
    /// The time since the previous event, or since the start.
    pub interval: SimTime,
    /// The excess of the interval over the wanted period.
    pub late: SimTime,
}

impl RobotMetrics {
    /// Returns the share of the time present without an active behavior set, 0 to 1; 0 if the robot never took part.
    #[must_use]
    pub fn idle_share(&self) -> f64 {
        rate(self.idle.as_secs_f64(), self.present)
    }

    /// Returns the number of activations per minute present.
    #[must_use]
    pub fn activations_per_min(&self) -> f64 {
        60.0 * rate(f64::from(self.activations), self.present)
    }
}

impl SentTotals {
    /// Returns broadcasts and bytes per second of `time`.
    #[must_use]
    pub fn per_s(&self, time: SimTime) -> (f64, f64) {
        (
            rate(self.messages as f64, time),
            rate(self.bytes as f64, time),
        )
    }
}

fn rate(amount: f64, time: SimTime) -> f64 {
    match time {
        SimTime::ZERO => 0.0,
        time => amount / time.as_secs_f64(),
    }
}

impl Metrics {
    /// Computes all metrics. `run` provides the outcome and the sent messages.
    #[must_use]
    pub fn compute(history: &History, run: &RunFile) -> Self {
        let events = history.events.iter().cloned().map(event_line);
        let Found { stints, takeovers } = find_all(&history.setup, events, history.end);
        let failures = failures(history, &stints, &takeovers);
        let ended = matches!(run.outcome, RunOutcome::Ended(_));
        // By name and by task, because a search for each robot and task would be quadratic.
        let mut activations: HashMap<&str, u32> = HashMap::new();
        for event in history.events_of("activated") {
            *activations.entry(&event.robot).or_default() += 1;
        }
        let robots = history.robots.iter().map(|robot| {
            let figures = run.result.robots.get(&robot.name).filter(|_| ended);
            let activations = activations.get(&*robot.name).copied();
            robot_metrics(robot, activations.unwrap_or_default(), figures)
        });
        let robots = robots.collect();
        let mut work = vec![TaskWork::default(); history.catalog.tasks.len()];
        for set in history.robots.iter().flat_map(|robot| &robot.sets) {
            work[set.task.index()].sets.push(set);
        }
        for stint in &stints {
            work[stint.task.index()].stints.push(stint);
        }
        Self {
            makespan: (run.outcome == RunOutcome::Ended(Outcome::Complete)).then_some(history.end),
            robots,
            tasks: history
                .tasks()
                .map(|id| task_metrics(history, id, &work[id.index()]))
                .collect(),
            recurring: recurring(history),
            failures,
            takeovers,
            stints,
        }
    }
}

/// The behavior sets of all robots for a task, and the stints at it.
#[derive(Clone, Default)]
struct TaskWork<'a> {
    sets: Vec<&'a SetHistory>,
    stints: Vec<&'a Stint>,
}

fn robot_metrics(
    robot: &RobotHistory,
    activations: u32,
    figures: Option<&RobotFigures>,
) -> RobotMetrics {
    RobotMetrics {
        present: robot.present.total(),
        idle: robot.present.without(&robot.active()).total(),
        activations,
        sent: figures.map(|figures| SentTotals {
            messages: figures.messages_sent,
            bytes: figures.bytes_sent,
        }),
    }
}

fn task_metrics(history: &History, task: TaskId, work: &TaskWork<'_>) -> TaskMetrics {
    let sets = || work.sets.iter();
    let stints = work.stints.iter();
    let mut productive: Vec<_> = stints.map(|stint| stint.productive()).collect();
    productive.sort_by_key(|span| span.from);
    let applicable = Spans::in_at_least(1, sets().map(|set| &set.applicable));
    let executed = Spans::in_at_least(1, sets().map(|set| &set.active));
    let exclusive = history.catalog.tasks[task.index()].max_robots == 1;
    TaskMetrics {
        orphan: applicable.without(&productive.into_iter().collect()),
        unattended: applicable.without(&executed),
        duplicate: exclusive.then(|| Spans::in_at_least(2, sets().map(|set| &set.active))),
        applicable,
    }
}

fn recurring(history: &History) -> Vec<Recurring> {
    let (mission, scenario) = (history.catalog.mission, &history.setup.scenario);
    let times = history.columns().iter();
    let times = times.filter(|column| column.kind == ColumnKind::Time);
    let events = times.filter_map(|column| Some((column.event?, column.name)));
    events
        .map(|(event, name)| {
            let period = mission.max_event_interval_s(scenario, name);
            let period = period.map(SimTime::from_secs_f64);
            let late =
                |interval: SimTime| period.map_or(SimTime::ZERO, |wanted| interval.since(wanted));
            let mut before = SimTime::ZERO;
            let moments = history
                .events_of(event)
                .map(|row| {
                    let interval = row.t_ms.since(before);
                    before = row.t_ms;
                    Occurrence {
                        at: row.t_ms,
                        by: history.rank(&row.robot),
                        interval,
                        late: late(interval),
                    }
                })
                .collect();
            Recurring {
                event,
                period,
                moments,
                overdue: late(history.end.since(before)),
            }
        })
        .collect()
}

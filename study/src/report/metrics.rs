//! The figures of a report. Each says in its documentation what exactly is counted; the page repeats it.

use alliance_proto::ids::TaskId;
use alliance_proto::log::{RobotFigures, RunFile, RunOutcome};
use alliance_proto::mission::columns::ColumnKind;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;

use super::failures::{Failure, Takeover, failures, takeovers};
use super::history::History;
use super::spans::Spans;
use super::stints::{Stint, stints};

/// What a report tells in numbers.
#[derive(Clone, Debug)]
pub struct Metrics {
    /// Simulated time from the start to the end of the last tick, if the mission was complete then.
    pub makespan: Option<SimTime>,
    /// By rank.
    pub robots: Vec<RobotMetrics>,
    /// By place in the catalog.
    pub tasks: Vec<TaskMetrics>,
    /// What happens again and again: one for each column with a time.
    pub recurring: Vec<Recurring>,
    /// Deaths and stops.
    pub failures: Vec<Failure>,
    /// Tasks that went from one robot to another.
    pub takeovers: Vec<Takeover>,
    /// All stints.
    pub stints: Vec<Stint>,
}

/// One robot's figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RobotMetrics {
    /// The time in which it took part: neither dead nor stopped.
    pub present: SimTime,
    /// The part of it in which none of its behavior sets was active.
    pub idle: SimTime,
    /// How often one became active.
    pub activations: u32,
    /// What it sent; `None` while run.json has no result, for the log lists broadcasts by receiver.
    pub sent: Option<Sent>,
}

/// What a robot sent: each broadcast once, however many teammates heard it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// Broadcasts.
    pub messages: u64,
    /// Their payloads as published: encoded and sealed, without what zenoh and TCP add.
    pub bytes: u64,
}

/// One task's figures.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskMetrics {
    /// The time in which a behavior set for it was applicable in a robot that took part.
    pub applicable: Spans,
    /// The part of it in which nobody was productive on it: none was in a stint that has still an effect to come.
    pub orphan: Spans,
    /// The part of it in which nobody even executed it.
    pub unattended: Spans,
    /// The time in which two or more robots executed it; `None` where more than one may.
    pub duplicate: Option<Spans>,
}

/// An event that recurs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recurring {
    /// Kind of the events.
    pub event: &'static str,
    /// Wanted time from one to the next, if the mission wants one.
    pub period: Option<SimTime>,
    /// The events, in order.
    pub moments: Vec<Moment>,
    /// How much longer than the period the latest one, or the start, lay back when the log ended.
    pub overdue: SimTime,
}

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// When.
    pub at: SimTime,
    /// Rank of the robot; `None` for a name that run.json does not know.
    pub by: Option<usize>,
    /// Time since the one before, or since the start.
    pub interval: SimTime,
    /// How much of that was more than the wanted period.
    pub late: SimTime,
}

impl RobotMetrics {
    /// Share of its time in which no behavior set was active, 0 to 1; 0 if it never took part.
    #[must_use]
    pub fn idle_share(&self) -> f64 {
        rate(self.idle.as_secs_f64(), self.present)
    }

    /// Activations per minute in which it took part.
    #[must_use]
    pub fn activations_per_min(&self) -> f64 {
        60.0 * rate(f64::from(self.activations), self.present)
    }
}

impl Sent {
    /// Broadcasts and bytes per second of that time.
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
    /// Computes all of them; `run` gives the outcome and what each robot sent.
    #[must_use]
    pub fn of(history: &History, run: &RunFile) -> Self {
        let stints = stints(history);
        let failures = failures(history, &stints);
        let takeovers = takeovers(history, &stints, &failures);
        let ended = matches!(run.outcome, RunOutcome::Ended(_));
        let robots = (0..history.robots.len())
            .map(|rank| {
                let figures = run.result.robots.get(&history.robots[rank].name);
                robot(history, rank, figures.filter(|_| ended))
            })
            .collect();
        Self {
            makespan: (run.outcome == RunOutcome::Ended(Outcome::Complete)).then_some(history.end),
            robots,
            tasks: history
                .tasks()
                .map(|id| task(history, id, &stints))
                .collect(),
            recurring: recurring(history),
            failures,
            takeovers,
            stints,
        }
    }
}

fn robot(history: &History, rank: usize, figures: Option<&RobotFigures>) -> RobotMetrics {
    let robot = &history.robots[rank];
    let activated = history
        .events_of("activated")
        .filter(|event| event.robot == robot.name);
    RobotMetrics {
        present: robot.present.total(),
        idle: robot.present.without(&robot.active()).total(),
        activations: activated.count() as u32,
        sent: figures.map(|figures| Sent {
            messages: figures.messages_sent,
            bytes: figures.bytes_sent,
        }),
    }
}

fn task(history: &History, task: TaskId, stints: &[Stint]) -> TaskMetrics {
    let sets = || history.behaviors_for(task).map(|(_, set)| set);
    let mut productive: Vec<_> = stints
        .iter()
        .filter(|stint| stint.task == task)
        .map(Stint::productive)
        .collect();
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
            let period = mission.period_s(scenario, name);
            let period = period.map(SimTime::from_secs_f64);
            let late = |interval: SimTime| period.map_or(SimTime::ZERO, |it| interval.since(it));
            let mut before = SimTime::ZERO;
            let moments = history
                .events_of(event)
                .map(|row| {
                    let interval = row.t_ms.since(before);
                    before = row.t_ms;
                    Moment {
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

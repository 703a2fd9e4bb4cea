//! Who worked on what, from when to when, to what effect, and why no longer.

use alliance_proto::ids::TaskId;
use alliance_proto::time::SimTime;

use super::history::History;
use super::spans::Span;

/// A robot's uninterrupted time on a task: one of its behavior sets for it is active.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stint {
    /// Rank of the robot.
    pub robot: usize,
    /// What it worked on.
    pub task: TaskId,
    /// From activation to the end.
    pub span: Span,
    /// Its effects on the world, in order: each end of a step with an event that changed a column of mission.csv, each moment at
    /// which the robot noted progress on the task, and each of an event that the mission calls an effect.
    pub effects: Vec<SimTime>,
    /// Whether all of it is an effect ([`Terms::continuous`](alliance_proto::mission::Terms)).
    pub continuous: bool,
    /// Why it ended.
    pub end: StintEnd,
}

/// Why a stint ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StintEnd {
    /// The log ends first.
    Ongoing,
    /// The set left the state active for this reason, as events.csv has it.
    Left(String),
    /// The robot died or was stopped.
    Absent,
}

impl Stint {
    /// The part that came to something: from activation to the latest effect.
    #[must_use]
    pub fn productive(&self) -> Span {
        Span {
            from: self.span.from,
            to: self.idle_since(self.span.to),
        }
    }

    /// The latest effect up to that moment; the activation, if there was none.
    #[must_use]
    pub fn idle_since(&self, at: SimTime) -> SimTime {
        if self.continuous {
            return at.min(self.span.to);
        }
        let before = self.effects.iter().rev().find(|effect| **effect <= at);
        before.copied().unwrap_or(self.span.from)
    }
}

/// All stints, by beginning and then rank.
#[must_use]
pub fn stints(history: &History) -> Vec<Stint> {
    let continuous = history.catalog.mission.terms().continuous;
    let mut stints: Vec<Stint> = history
        .robots
        .iter()
        .enumerate()
        .flat_map(|(rank, robot)| {
            robot.sets.iter().flat_map(move |set| {
                set.active.iter().map(move |span| Stint {
                    robot: rank,
                    task: set.task,
                    span,
                    effects: effects(history, rank, set.task, span),
                    continuous,
                    end: end(history, rank, &set.name, span.to),
                })
            })
        })
        .collect();
    stints.sort_by_key(|stint| (stint.span.from, stint.robot));
    stints
}

fn effects(history: &History, rank: usize, task: TaskId, span: Span) -> Vec<SimTime> {
    let name = &history.robots[rank].name;
    let task = history.catalog.task_name(task);
    let terms = history.catalog.mission.terms();
    let is_effect = |kind: &str| {
        terms
            .columns
            .iter()
            .any(|column| column.event == Some(kind))
    };
    let effects = history.events.iter().filter_map(|event| {
        if event.robot != *name {
            return None;
        }
        let at = match event.kind.as_str() {
            "progress" if event.detail == task => event.t_ms,
            // Its end is the effect, and the robot finds that out in the same step.
            kind if terms.effects.contains(&kind) => event.t_ms,
            // The robot itself finds out one step later, and after the mission's last one never.
            kind if is_effect(kind) => event.t_ms + history.step,
            _ => return None,
        };
        (span.from < at && at <= span.to).then_some(at)
    });
    let mut effects: Vec<SimTime> = effects.collect();
    effects.sort_unstable();
    effects.dedup();
    effects
}

fn end(history: &History, rank: usize, set: &str, at: SimTime) -> StintEnd {
    let name = &history.robots[rank].name;
    let change = history.events.iter().find(|event| {
        event.t_ms == at
            && event.robot == *name
            && event.subject == set
            && matches!(event.kind.as_str(), "hibernated" | "waiting")
    });
    match change {
        Some(change) => StintEnd::Left(change.reason.clone()),
        None if at >= history.end => StintEnd::Ongoing,
        None => StintEnd::Absent,
    }
}

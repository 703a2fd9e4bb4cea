//! Stints: the time that a robot works on a task, with its effects and the reason for its end.

use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::history::History;
use super::spans::Span;

/// An unbroken time in which one of a robot's behavior sets for a task is active.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stint {
    pub robot: usize,
    pub task: TaskId,
    /// The time from activation to the end.
    pub span: Span,
    /// The effects on the world, in order: ends of steps with an event that changed a column of mission.csv, notes of
    /// progress on the task, and events that the mission declares as effects.
    pub effects: Vec<SimTime>,
    /// `true` if the whole stint is an effect ([`MissionVocabulary::continuous`](scenario::mission::MissionVocabulary)).
    pub continuous: bool,
    pub end: StintEnd,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StintEnd {
    /// The log ended before the stint.
    Ongoing,
    /// The set left the active state for this reason, as in events.csv.
    Left(String),
    Absent,
}

impl Stint {
    /// Returns the productive part: from activation to the latest effect.
    #[must_use]
    pub fn productive(&self) -> Span {
        Span {
            from: self.span.from,
            to: self.idle_since(self.span.to),
        }
    }

    /// Returns the time of the latest effect up to `at`, or the activation if there is none.
    #[must_use]
    pub fn idle_since(&self, at: SimTime) -> SimTime {
        if self.continuous {
            return at.min(self.span.to);
        }
        let before = self.effects.iter().rev().find(|effect| **effect <= at);
        before.copied().unwrap_or(self.span.from)
    }
}

/// Returns all stints, sorted by start and then rank.
#[must_use]
pub fn stints(history: &History) -> Vec<Stint> {
    let continuous = history.catalog.mission.vocabulary().continuous;
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
    let terms = history.catalog.mission.vocabulary();
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
            // The end of the set is the effect, and the robot notices it in the same step.
            kind if terms.effects.contains(&kind) => event.t_ms,
            // The robot notices it one step later, and never after the mission's last step.
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

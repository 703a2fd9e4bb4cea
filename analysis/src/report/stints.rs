//! The stints of a logged run, with their effects and the reasons for their ends.

use observation::stints::{Span, Stint, StintEnd};
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::history::History;

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

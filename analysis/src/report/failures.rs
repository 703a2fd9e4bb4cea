//! Losses of robots: their detection by teammates, and the outcome for their tasks.

use observation::stints::{Loss, Span, Stint, StintEnd};
use observation::takeovers::Takeover;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::history::History;
use super::robot_history::SetHistory;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    pub at: SimTime,
    pub robot: usize,
    pub loss: Loss,
    /// The time when the robot took part again.
    pub returned_at: Option<SimTime>,
    /// The task that the robot was executing, and its outcome.
    pub orphan: Option<OrphanedTask>,
}

/// A task whose robot was lost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OrphanedTask {
    pub task: TaskId,
    /// The first teammate that stopped counting on the robot, before its return.
    pub detection: Option<Detection>,
    /// The continuation of the task.
    pub aftermath: OrphanOutcome,
}

/// The detection of a loss by a teammate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detection {
    pub at: SimTime,
    pub robot: usize,
    pub sign: DetectionSign,
}

/// The sign by which the log shows that a teammate no longer counts on a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DetectionSign {
    /// The teammate's τ has passed since it last received the robot's claim of the task.
    Silence,
    /// The teammate's impatience rate for the task rose to δ_fast.
    Impatience,
    /// The teammate activated a behavior set for the task.
    Activation,
}

/// The outcome for a task whose robot was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrphanOutcome {
    /// A teammate was already executing the task at the loss.
    Covered { by: usize },
    /// A [`Takeover`] by a teammate.
    TakenOver { at: SimTime, by: usize },
    /// A teammate executed the task next, without a takeover: the task is not exclusive, the teammate returned to it, or
    /// the claim of the lost robot was a bid.
    Continued { at: SimTime, by: usize },
    /// The robot itself returned before any teammate activated the task.
    Resumed { at: SimTime },
    /// No robot has executed the task since.
    Abandoned,
}

/// Returns all losses of robots in order of time. `stints` and `takeovers` are those of the run.
#[must_use]
pub fn failures(history: &History, stints: &[Stint], takeovers: &[Takeover]) -> Vec<Failure> {
    let mut failures = losses(history, stints);
    for failure in &mut failures {
        let (at, robot) = (failure.at, failure.robot);
        if let Some(orphan) = &mut failure.orphan {
            orphan.aftermath = aftermath(stints, takeovers, (at, robot), orphan.task);
        }
    }
    failures
}

/// Returns all losses, without the outcome for their tasks.
fn losses(history: &History, stints: &[Stint]) -> Vec<Failure> {
    let losses = history.events.iter().filter_map(|event| {
        let loss = Loss::of_kind(&event.kind)?;
        Some((event.t_ms, history.rank(&event.robot)?, loss))
    });
    losses
        .map(|(at, robot, loss)| {
            // A successor can take part in the very next tick.
            let next = at + history.step;
            let mut present = history.robots[robot].present.iter();
            let mut failure = Failure {
                at,
                robot,
                loss,
                returned_at: present
                    .find(|span| span.to > next)
                    .map(|span| span.from.max(next)),
                orphan: None,
            };
            let mut stints = stints.iter();
            let end = StintEnd::Lost(loss, at);
            let stint = stints.find(|stint| stint.robot == robot && stint.end == end);
            failure.orphan = stint.map(|stint| OrphanedTask {
                task: stint.task,
                detection: detection(history, &failure, stint.task),
                aftermath: OrphanOutcome::Abandoned,
            });
            failure
        })
        .collect()
}

/// Returns the first sign of a detection; `None` also for a summary, which has no claims and motivations.
fn detection(history: &History, failure: &Failure, task: TaskId) -> Option<Detection> {
    if history.is_summary {
        return None;
    }
    let until = failure.returned_at.unwrap_or(history.end);
    history
        .behaviors_for(task)
        .filter(|(by, _)| *by != failure.robot)
        .flat_map(|(by, set)| {
            let later = |moment: &SimTime| *moment > failure.at;
            let hurried = set.impatience_rises.iter().copied().find(later);
            let activated = set.active.iter().map(|span| span.from).find(later);
            let signs = [
                (silence(history, by, set, failure), DetectionSign::Silence),
                (hurried, DetectionSign::Impatience),
                (activated, DetectionSign::Activation),
            ];
            signs.into_iter().filter_map(move |(at, sign)| {
                Some(Detection {
                    at: at?,
                    robot: by,
                    sign,
                })
            })
        })
        .filter(|detection| detection.at < until)
        .min_by_key(|detection| (detection.at, detection.sign, detection.robot))
}

/// Returns the tick in which the τ of `by` passes after the last received claim of the lost robot. Returns `None` if τ
/// passed before the loss, or if `by` was absent.
fn silence(history: &History, by: usize, set: &SetHistory, failure: &Failure) -> Option<SimTime> {
    let teammate = &history.robots[by];
    // The broadcast of the last step arrives in the next step.
    let last = teammate.received_claims.iter().rev().find(|claim| {
        claim.sender == failure.robot
            && claim.task == set.task
            && claim.at <= failure.at + history.step
    })?;
    let ends = last.at + SimTime::from_secs_f64(set.params.ceased_after_s);
    let tick = SimTime(ends.0.div_ceil(history.step.0) * history.step.0);
    (tick > failure.at && teammate.present.contains(tick)).then_some(tick)
}

fn aftermath(
    stints: &[Stint],
    takeovers: &[Takeover],
    (lost_at, robot): (SimTime, usize),
    task: TaskId,
) -> OrphanOutcome {
    let counts = |stint: &&Stint| stint.task == task && stint.counts == Some(true);
    let on_task = || stints.iter().filter(counts);
    let covers = |stint: &&Stint| {
        let Span { from, to } = stint.span;
        stint.robot != robot && from <= lost_at && lost_at < to
    };
    if let Some(stint) = on_task().find(covers) {
        return OrphanOutcome::Covered { by: stint.robot };
    }
    let Some(next) = on_task().find(|stint| stint.span.from > lost_at) else {
        return OrphanOutcome::Abandoned;
    };
    let (at, by) = (next.span.from, next.robot);
    let is_takeover = |takeover: &Takeover| {
        (takeover.at, takeover.robot, takeover.task, takeover.from) == (at, by, task, robot)
    };
    if by == robot {
        OrphanOutcome::Resumed { at }
    } else if takeovers.iter().any(is_takeover) {
        OrphanOutcome::TakenOver { at, by }
    } else {
        OrphanOutcome::Continued { at, by }
    }
}

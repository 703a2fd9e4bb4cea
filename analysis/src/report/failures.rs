//! Losses of robots: detection by teammates, takeovers, and the outcome for their tasks.

use observation::stints::{Loss, Span, Stint, StintEnd, kept, predecessor};
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
    /// A teammate executed the task next, without a takeover: the task is not exclusive, or the teammate returned to it.
    Continued { at: SimTime, by: usize },
    /// The robot itself returned before any teammate activated the task.
    Resumed { at: SimTime },
    /// No robot has executed the task since.
    Abandoned,
}

/// The activation of an exclusive task that another robot had not finished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Takeover {
    pub at: SimTime,
    pub task: TaskId,
    /// Rank of the robot that executed the task last.
    pub from: usize,
    pub robot: usize,
    /// The time of the last progress: the loss of the previous robot; otherwise the latest effect of its stint, or its
    /// activation.
    pub idle_since: SimTime,
    /// The state of the previous robot.
    pub cause: TakeoverCause,
}

/// The reason why a takeover was possible.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TakeoverCause {
    Lost(Loss),
    /// The previous robot left the task for this reason, as in events.csv.
    Left(String),
    StillActive,
}

impl TakeoverCause {
    #[must_use]
    pub fn is_loss(&self) -> bool {
        matches!(self, Self::Lost(_))
    }
}

impl Failure {
    /// Returns whether this loss ended the stint. The last step of the stint may or may not count in the tick of the
    /// loss.
    fn ended(&self, stint: &Stint, step: SimTime) -> bool {
        stint.robot == self.robot
            && matches!(stint.end, StintEnd::Absent | StintEnd::Ongoing)
            && (self.at..=self.at + step).contains(&stint.span.to)
    }
}

impl Takeover {
    /// Returns the time without progress before the takeover.
    #[must_use]
    pub fn latency(&self) -> SimTime {
        self.at.since(self.idle_since)
    }
}

/// Returns all losses of robots and all takeovers, each in order of time. Everything that shows a takeover uses this
/// function.
///
/// A takeover is the activation of an exclusive task by another robot than the one that executed it last (the
/// predecessor). Claims that last one step (bids) and claims that yield to another claim do not count, and they make no
/// robot a predecessor. Of simultaneous activations only the first one counts. A return of an absent robot is no
/// takeover, and neither is the activation of a task that was left as not applicable.
#[must_use]
pub fn losses_and_takeovers(history: &History, stints: &[Stint]) -> (Vec<Failure>, Vec<Takeover>) {
    let kept = kept(stints, history.step);
    let mut failures = losses(history, stints);
    let mut takeovers: Vec<Takeover> = kept
        .iter()
        .filter(|stint| history.catalog.tasks[stint.task.index()].max_robots == 1)
        .filter_map(|stint| takeover(history, stint, &kept, &failures))
        .collect();
    takeovers.sort_by_key(|takeover| takeover.at);
    for failure in &mut failures {
        let (at, robot) = (failure.at, failure.robot);
        if let Some(orphan) = &mut failure.orphan {
            orphan.aftermath = aftermath(&kept, &takeovers, (at, robot), orphan.task);
        }
    }
    (failures, takeovers)
}

/// Returns all losses, without the outcome for their tasks.
fn losses(history: &History, stints: &[Stint]) -> Vec<Failure> {
    let losses = history.events.iter().filter_map(|event| {
        let loss = match event.kind.as_str() {
            "gone" => Loss::Died,
            "stalled" => Loss::Stopped,
            _ => return None,
        };
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
            let stint = stints.find(|stint| failure.ended(stint, history.step));
            failure.orphan = stint.map(|stint| OrphanedTask {
                task: stint.task,
                detection: detection(history, &failure, stint.task),
                aftermath: OrphanOutcome::Abandoned,
            });
            failure
        })
        .collect()
}

fn detection(history: &History, failure: &Failure, task: TaskId) -> Option<Detection> {
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
    kept: &[&Stint],
    takeovers: &[Takeover],
    (lost_at, robot): (SimTime, usize),
    task: TaskId,
) -> OrphanOutcome {
    let on_task = || kept.iter().filter(|stint| stint.task == task);
    let covers = |stint: &&&Stint| {
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

/// Returns the takeover that a stint begins, if any.
fn takeover(
    history: &History,
    after: &Stint,
    kept: &[&Stint],
    failures: &[Failure],
) -> Option<Takeover> {
    let at = after.span.from;
    // A robot that returns and continues has not activated anything.
    let returns = !history.robots[after.robot]
        .present
        .contains(at - history.step);
    if returns {
        return None;
    }
    let before = predecessor(after, kept)?;
    let idle_since = before.idle_since(at);
    let (stood_since, cause) = match &before.end {
        _ if before.span.to > at => (idle_since, TakeoverCause::StillActive),
        StintEnd::Left(reason) if reason == "not-applicable" => return None,
        StintEnd::Left(reason) => (idle_since, TakeoverCause::Left(reason.clone())),
        StintEnd::Absent | StintEnd::Ongoing => {
            let mut failures = failures.iter();
            let failure = failures.find(|failure| failure.ended(before, history.step))?;
            (failure.at, TakeoverCause::Lost(failure.loss))
        }
    };
    Some(Takeover {
        at,
        task: after.task,
        from: before.robot,
        robot: after.robot,
        idle_since: stood_since,
        cause,
    })
}

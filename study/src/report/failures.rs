//! How the team met the deaths and stops of its robots, and who took over from whom.

use alliance_proto::ids::TaskId;
use alliance_proto::time::SimTime;

use super::history::{History, SetHistory};
use super::spans::Span;
use super::stints::{Stint, StintEnd};

/// How a robot was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// Its process died.
    Died,
    /// Its process was stopped, or fell silent otherwise.
    Stopped,
}

/// A robot was lost to the team.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// When.
    pub at: SimTime,
    /// Rank of the robot.
    pub robot: usize,
    /// How.
    pub loss: Loss,
    /// When it took part again.
    pub back: Option<SimTime>,
    /// The task that it was executing, and what became of it.
    pub orphan: Option<Orphan>,
}

/// A task whose robot was lost.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Orphan {
    /// The task.
    pub task: TaskId,
    /// The first teammate that no longer reckoned with the robot, before that was back.
    pub detection: Option<Detection>,
    /// Who went on with it.
    pub aftermath: Aftermath,
}

/// A teammate no longer reckons with a robot on its task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detection {
    /// When.
    pub at: SimTime,
    /// Rank of the teammate.
    pub by: usize,
    /// By what.
    pub sign: Sign,
}

/// What tells that a teammate no longer reckons with a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sign {
    /// Its τ has passed since it last heard the robot claim the task.
    Silence,
    /// Its rate of impatience for the task rose to δ_fast.
    Impatience,
    /// It activated a behavior set for the task.
    Activation,
}

/// What became of a task whose robot was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aftermath {
    /// This teammate was executing it all along.
    Covered {
        /// Its rank.
        by: usize,
    },
    /// This teammate was the next to activate it.
    TakenOver {
        /// When.
        at: SimTime,
        /// Its rank.
        by: usize,
    },
    /// The robot itself came back before anybody else had activated it.
    Resumed {
        /// When.
        at: SimTime,
    },
    /// Nobody has executed it since.
    Nobody,
}

/// A robot activated an exclusive task that another one had not finished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Takeover {
    /// When.
    pub at: SimTime,
    /// The task.
    pub task: TaskId,
    /// Rank of the robot that was the last to activate it before.
    pub from: usize,
    /// Rank of the robot that took over.
    pub by: usize,
    /// Since when the task had not progressed: the death or stop of the robot before; otherwise the latest effect of that
    /// one's stint, or its activation if there was none.
    pub stood_since: SimTime,
    /// What had become of the robot before.
    pub cause: Cause,
}

/// Why a robot could take over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The one before was lost.
    Lost(Loss),
    /// The one before had left the task for this reason, as events.csv has it.
    Left(String),
    /// The one before was still at it.
    StillActive,
}

impl Failure {
    /// Whether it ended the stint, whose last step counts in the tick of the loss or not any more.
    fn ended(&self, stint: &Stint, step: SimTime) -> bool {
        stint.robot == self.robot
            && matches!(stint.end, StintEnd::Absent | StintEnd::Ongoing)
            && (self.at..=self.at + step).contains(&stint.span.to)
    }
}

impl Takeover {
    /// How long the task had stood still.
    #[must_use]
    pub fn latency(&self) -> SimTime {
        self.at.since(self.stood_since)
    }
}

/// All losses of robots, in order.
#[must_use]
pub fn failures(history: &History, stints: &[Stint]) -> Vec<Failure> {
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
            let mut present = history.robots[robot].present.iter();
            let mut failure = Failure {
                at,
                robot,
                loss,
                back: present.find(|span| span.from > at).map(|span| span.from),
                orphan: None,
            };
            let stint = stints
                .iter()
                .find(|stint| failure.ended(stint, history.step));
            failure.orphan = stint.map(|stint| Orphan {
                task: stint.task,
                detection: detection(history, &failure, stint.task),
                aftermath: aftermath(stints, &failure, stint.task),
            });
            failure
        })
        .collect()
}

fn detection(history: &History, failure: &Failure, task: TaskId) -> Option<Detection> {
    let until = failure.back.unwrap_or(history.end);
    history
        .behaviors_for(task)
        .filter(|(by, _)| *by != failure.robot)
        .flat_map(|(by, set)| {
            let later = |moment: &SimTime| *moment > failure.at;
            let hurried = set.hurries.iter().copied().find(later);
            let activated = set.active.iter().map(|span| span.from).find(later);
            let signs = [
                (silence(history, by, set, failure), Sign::Silence),
                (hurried, Sign::Impatience),
                (activated, Sign::Activation),
            ];
            signs
                .into_iter()
                .filter_map(move |(at, sign)| Some(Detection { at: at?, by, sign }))
        })
        .filter(|detection| detection.at < until)
        .min_by_key(|detection| (detection.at, detection.sign, detection.by))
}

/// The tick in which the τ of `by` has passed since it last heard the lost robot claim the set's task; `None` if that was so
/// before the loss already, or if it did not take part then.
fn silence(history: &History, by: usize, set: &SetHistory, failure: &Failure) -> Option<SimTime> {
    let teammate = &history.robots[by];
    // What the robot said in its last step is heard in the next one.
    let last = teammate.heard.iter().rev().find(|claim| {
        claim.sender == failure.robot
            && claim.task == set.task
            && claim.at <= failure.at + history.step
    })?;
    let ends = last.at + SimTime::from_secs_f64(set.params.ceased_after_s);
    let tick = SimTime(ends.0.div_ceil(history.step.0) * history.step.0);
    (tick > failure.at && teammate.present.contains(tick)).then_some(tick)
}

fn aftermath(stints: &[Stint], failure: &Failure, task: TaskId) -> Aftermath {
    let on_task = || stints.iter().filter(|stint| stint.task == task);
    let covers = |stint: &&Stint| {
        let Span { from, to } = stint.span;
        stint.robot != failure.robot && from <= failure.at && failure.at < to
    };
    if let Some(stint) = on_task().find(covers) {
        return Aftermath::Covered { by: stint.robot };
    }
    match on_task().find(|stint| stint.span.from > failure.at) {
        Some(next) if next.robot == failure.robot => Aftermath::Resumed { at: next.span.from },
        Some(next) => Aftermath::TakenOver {
            at: next.span.from,
            by: next.robot,
        },
        None => Aftermath::Nobody,
    }
}

/// All takeovers, in order. Who activates a task at the same time as another, or gives in to another's claim, takes nothing
/// over; nor does who takes up what the one before had left as not applicable.
#[must_use]
pub fn takeovers(history: &History, stints: &[Stint], failures: &[Failure]) -> Vec<Takeover> {
    let mut takeovers: Vec<Takeover> = history
        .tasks()
        .filter(|task| history.catalog.tasks[task.index()].max_robots == 1)
        .flat_map(|task| {
            let on_task: Vec<&Stint> = stints
                .iter()
                .filter(|stint| stint.task == task && !gave_in(stint, stints))
                .collect();
            on_task
                .windows(2)
                .filter_map(|pair| takeover(history, pair[0], pair[1], failures))
                .collect::<Vec<_>>()
        })
        .collect();
    takeovers.sort_by_key(|takeover| takeover.at);
    takeovers
}

/// Whether the robot claimed the task at the same time as another, or unheard, and left it to that one.
fn gave_in(stint: &Stint, stints: &[Stint]) -> bool {
    let at = stint.span.from;
    let claimed = |other: &Stint| {
        other.robot != stint.robot
            && other.task == stint.task
            && other.span.from <= at
            && at < other.span.to
    };
    stint.end == StintEnd::Left("arbitration".to_owned()) && stints.iter().any(claimed)
}

fn takeover(
    history: &History,
    before: &Stint,
    after: &Stint,
    failures: &[Failure],
) -> Option<Takeover> {
    let at = after.span.from;
    // Who comes back and goes on has not activated anything.
    let returns = !history.robots[after.robot]
        .present
        .contains(at - history.step);
    if before.robot == after.robot || before.span.from == at || returns {
        return None;
    }
    let idle_since = before.idle_since(at);
    let (stood_since, cause) = match &before.end {
        _ if before.span.to > at => (idle_since, Cause::StillActive),
        StintEnd::Left(reason) if reason == "not-applicable" => return None,
        StintEnd::Left(reason) => (idle_since, Cause::Left(reason.clone())),
        StintEnd::Absent | StintEnd::Ongoing => {
            let failure = failures
                .iter()
                .find(|failure| failure.ended(before, history.step))?;
            (failure.at, Cause::Lost(failure.loss))
        }
    };
    Some(Takeover {
        at,
        task: after.task,
        from: before.robot,
        by: after.robot,
        stood_since,
        cause,
    })
}

//! Stints: the time that a robot works on a task, with its effects and the reason for its end. They decide which
//! activation of a task is a takeover.

use scenario::ids::TaskId;
use scenario::time::SimTime;

/// The half-open interval from `from` up to, but not including, `to`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    pub from: SimTime,
    pub to: SimTime,
}

impl Span {
    #[must_use]
    pub fn length(self) -> SimTime {
        self.to.since(self.from)
    }
}

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

/// The loss of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    Died,
    /// The process was stopped or did not respond.
    Stopped,
}

/// Returns the stints that count for takeovers: all but bids and claims that yielded to another claim.
#[must_use]
pub fn kept(stints: &[Stint], step: SimTime) -> Vec<&Stint> {
    stints
        .iter()
        .filter(|stint| !is_bid(stint, step) && !gave_in(stint, stints))
        .collect()
}

/// Returns the latest stint for the same task, of another robot, before a stint that can be a takeover. `kept` are the
/// stints that count.
#[must_use]
pub fn predecessor<'a>(after: &Stint, kept: &[&'a Stint]) -> Option<&'a Stint> {
    let at = after.span.from;
    let on_task = || kept.iter().filter(|stint| stint.task == after.task);
    let is_second = on_task().any(|stint| stint.span.from == at && stint.robot < after.robot);
    if is_second {
        return None;
    }
    // Of robots that are still active, the one that began last is the predecessor.
    let before = on_task()
        .filter(|stint| stint.span.from < at)
        .max_by_key(|stint| (stint.span.to.min(at), stint.span.from))?;
    (before.robot != after.robot).then_some(before)
}

/// Returns whether the claim lasted one step: a bid that the robot withdrew or that the log does not show further.
fn is_bid(stint: &Stint, step: SimTime) -> bool {
    stint.end != StintEnd::Absent && stint.span.length() <= step
}

/// Returns whether the robot activated the task while another robot had it, and then left it to that robot.
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

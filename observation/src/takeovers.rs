//! The definition of a takeover (docs/book/results.md, section "Takeovers"), applied to the rows of events.csv: tick by tick while a
//! run is live, or to the whole log. Both give the same takeovers.

use std::borrow::Borrow;
use std::fmt;

use proto::event::EventLine;
use proto::telemetry::Reason;
use scenario::Setup;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::stints::{Loss, Span, Stint, StintEnd, StintTracker};

/// The reasons with which a robot leaves a task for a teammate's claim or for another task. The other reasons state that
/// the robot gives the task up, or that it is over.
const CHANGES_OF_PLAN: [Reason; 6] = [
    Reason::Arbitration,
    Reason::Outbid,
    Reason::Claimed,
    Reason::Awarded,
    Reason::Reassigned,
    Reason::Drawn,
];

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

impl Takeover {
    /// Returns the time without progress before the takeover.
    #[must_use]
    pub fn latency(&self) -> SimTime {
        self.at.since(self.idle_since)
    }
}

/// A task that a robot took over from a lost one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LossTakeover {
    pub at: SimTime,
    pub robot: String,
    pub task: String,
    /// The lost robot that executed the task before.
    pub from: String,
    /// The time since its loss.
    pub after: SimTime,
    pub loss: Loss,
}

impl LossTakeover {
    /// Returns the time since the loss in words: `14.00 s after its death`.
    #[must_use]
    pub fn delay(&self) -> String {
        let loss = match self.loss {
            Loss::Died => "its death",
            Loss::Stopped => "its last report",
        };
        format!("{:.2} s after {loss}", self.after.as_secs_f64())
    }

    /// Returns the takeover as an event of the page. Its reason is the lost robot.
    #[must_use]
    pub fn into_event(self) -> EventLine {
        EventLine {
            t_ms: self.at,
            detail: self.delay(),
            kind: "took-over".to_owned(),
            robot: self.robot,
            subject: self.task,
            reason: self.from,
        }
    }
}

impl fmt::Display for LossTakeover {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            at,
            robot,
            task,
            from,
            ..
        } = self;
        let delay = self.delay();
        write!(f, "{at}: {robot} took over {task} from {from}, {delay}")
    }
}

/// Finds stints and takeovers in the rows of events.csv, which arrive in order. A claim counts when it has lasted two
/// steps and its robot has worked, so a takeover is found that much later. Of contested claims, it is found when the
/// contest is over.
pub struct TakeoverDetector {
    step: SimTime,
    tracker: StintTracker,
}

/// The stints and takeovers of a run that do not change any more.
#[derive(Debug, Default)]
pub struct Found {
    pub stints: Vec<Stint>,
    pub takeovers: Vec<Takeover>,
}

impl TakeoverDetector {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            step: SimTime(setup.scenario.step_ms),
            tracker: StintTracker::new(setup),
        }
    }

    /// Adds the next event. Events of unknown robots and behavior sets are ignored.
    pub fn add(&mut self, event: &EventLine) {
        self.tracker.add(event);
    }

    /// Returns the names of the tasks that a robot executes after the added events.
    #[must_use]
    pub fn tasks_of(&self, robot: &str) -> Vec<&str> {
        let Some(robot) = self.tracker.roster.find(robot) else {
            return Vec::new();
        };
        let tasks = self.tracker.tasks_of(robot.index());
        tasks
            .map(|task| self.tracker.catalog.task_name(task))
            .collect()
    }

    /// Returns whether a robot executes the task after the added events, and later events decide whether it took it over.
    #[must_use]
    pub fn has_undecided_takeover(&self, task: &str) -> bool {
        let task = self.tracker.catalog.find_task(task);
        task.is_some_and(|task| self.tracker.has_undecided_takeover(task))
    }

    /// Returns the takeovers from lost robots that the events before `now` decide, in order of time.
    pub fn take(&mut self, now: SimTime) -> Vec<LossTakeover> {
        let mut found = Found::default();
        self.find(now, &mut found);
        self.after_losses(found)
    }

    /// Returns the other takeovers from lost robots of a run that ended at `end`, in order of time.
    pub fn finish(&mut self, end: SimTime) -> Vec<LossTakeover> {
        let mut found = Found::default();
        self.find_last(end, &mut found);
        self.after_losses(found)
    }

    /// Adds all that the events before `now` decide.
    fn find(&mut self, now: SimTime, found: &mut Found) {
        let StintTracker {
            changed, stints, ..
        } = &mut self.tracker;
        changed.retain(|task| !decide(&mut stints[*task], self.step, now, found));
    }

    /// Adds all that has not been found before the end of the run.
    fn find_last(&mut self, end: SimTime, found: &mut Found) {
        self.tracker.finish(end);
        self.find(end, found);
        found.stints.extend(self.tracker.take_rest());
    }

    fn after_losses(&self, found: Found) -> Vec<LossTakeover> {
        let name = |rank: usize| {
            let roster = &self.tracker.roster;
            roster.name(RobotId(rank as u32)).to_owned()
        };
        let takeovers = found.sorted().takeovers.into_iter();
        let lost = takeovers.filter_map(|takeover| match takeover.cause {
            TakeoverCause::Lost(loss) => Some(LossTakeover {
                at: takeover.at,
                robot: name(takeover.robot),
                task: self.tracker.catalog.task_name(takeover.task).to_owned(),
                from: name(takeover.from),
                after: takeover.latency(),
                loss,
            }),
            TakeoverCause::Left(_) | TakeoverCause::StillActive => None,
        });
        lost.collect()
    }
}

impl Found {
    fn sorted(mut self) -> Self {
        self.stints
            .sort_by_key(|stint| (stint.span.from, stint.robot, stint.set));
        self.takeovers
            .sort_by_key(|takeover| (takeover.at, takeover.robot, takeover.task));
        self
    }
}

/// Decides which stints of a task count and which of them begin takeovers. Moves the stints that later ones do not need.
/// Returns whether all possible takeovers are decided.
fn decide(stints: &mut Vec<Stint>, step: SimTime, now: SimTime, found: &mut Found) -> bool {
    for index in 0..stints.len() {
        if stints[index].counts.is_none() {
            stints[index].counts = counts(&stints[index], stints, step, now);
        }
    }
    for index in 0..stints.len() {
        let stint = &stints[index];
        if stint.may_take_over
            && let Some(takeover) = takeover(stint, stints, now)
        {
            found.takeovers.extend(takeover);
            stints[index].may_take_over = false;
        }
    }
    let are_decided = !stints.iter().any(|stint| stint.may_take_over);
    if are_decided && stints.iter().all(|stint| stint.counts.is_some()) {
        let ended = stints.iter().filter(|stint| stint.span.to <= now);
        let counted = ended.filter(|stint| stint.counts == Some(true));
        let last = counted.map(|stint| order(stint, now)).max();
        let is_past = |stint: &mut Stint| stint.span.to <= now && Some(order(stint, now)) != last;
        found.stints.extend(stints.extract_if(.., is_past));
    }
    are_decided
}

/// Returns whether a stint counts: unless it is a bid or yields. Returns `None` while the rows before `now` do not decide
/// it.
fn counts(stint: &Stint, stints: &[Stint], step: SimTime, now: SimTime) -> Option<bool> {
    let Span { from, to } = stint.span;
    let is_open = to > now;
    if is_open && from + step + step > now {
        return None;
    }
    // Another claim that existed at the start of the stint, and still exists.
    let is_contested = stints.iter().any(|other| {
        let held = other.span.from <= from && from < other.span.to;
        other.robot != stint.robot && held && other.span.to >= to.min(now)
    });
    let may_yield = is_contested || !stint.has_worked(now);
    if is_open {
        return (!may_yield).then_some(true);
    }
    let is_bid = stint.span.length() <= step;
    let is_change = |reason: &String| CHANGES_OF_PLAN.iter().any(|it| it.as_str() == reason);
    let changes_plan = || matches!(&stint.end, StintEnd::Left(reason) if is_change(reason));
    Some(!(is_bid || may_yield && changes_plan()))
}

/// Returns the order by which the last one of several stints is the predecessor of a stint that begins at `at`: by the
/// end, and of stints that are still active by the start.
fn order(stint: &Stint, at: SimTime) -> (SimTime, SimTime, usize) {
    (stint.span.to.min(at), stint.span.from, stint.robot)
}

/// Returns the takeover that a stint begins, if any. Returns `None` while the rows before `now` do not decide it.
fn takeover(after: &Stint, stints: &[Stint], now: SimTime) -> Option<Option<Takeover>> {
    let at = after.span.from;
    let is_earlier = |stint: &Stint| stint.span.from < at && stint.counts != Some(false);
    if !stints.iter().any(is_earlier) || !after.counts? {
        return Some(None);
    }
    let others = || stints.iter().filter(|stint| stint.counts != Some(false));
    let mut simultaneous =
        others().filter(|other| other.span.from == at && other.robot < after.robot);
    if let Some(first) = simultaneous.next() {
        return first.counts.map(|_| None);
    }
    let earlier = others().filter(|other| other.span.from < at);
    let Some(before) = earlier.max_by_key(|other| order(other, at)) else {
        return Some(None);
    };
    before.counts?;
    if before.robot == after.robot {
        return Some(None);
    }
    let (idle_since, cause) = match &before.end {
        _ if before.works_after(at) => return Some(None),
        _ if before.span.to > now => return None,
        _ if before.span.to > at => (before.idle_since(at), TakeoverCause::StillActive),
        StintEnd::Left(reason) if reason == "not-applicable" => return Some(None),
        StintEnd::Left(reason) => (before.idle_since(at), TakeoverCause::Left(reason.clone())),
        StintEnd::Lost(loss, lost_at) => (*lost_at, TakeoverCause::Lost(*loss)),
        StintEnd::Ongoing => return Some(None),
    };
    Some(Some(Takeover {
        at,
        task: after.task,
        from: before.robot,
        robot: after.robot,
        idle_since,
        cause,
    }))
}

/// Returns all stints and takeovers in the events of a run that ended at `end`, in order of time.
pub fn find_all(
    setup: &Setup,
    events: impl IntoIterator<Item: Borrow<EventLine>>,
    end: SimTime,
) -> Found {
    let mut detector = TakeoverDetector::new(setup);
    let mut found = Found::default();
    let mut now = SimTime::ZERO;
    for event in events {
        let event = event.borrow();
        if event.t_ms > now {
            now = event.t_ms;
            // Later stints are not compared with those that are found here.
            detector.find(now, &mut found);
        }
        detector.add(event);
    }
    detector.find_last(end, &mut found);
    found.sorted()
}

/// Returns all takeovers from lost robots in the events of a run that ended at `end`, in order of time.
pub fn loss_takeovers<'a>(
    setup: &Setup,
    events: impl IntoIterator<Item = &'a EventLine>,
    end: SimTime,
) -> Vec<LossTakeover> {
    TakeoverDetector::new(setup).after_losses(find_all(setup, events, end))
}

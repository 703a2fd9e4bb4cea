//! Stints: the time that a robot works on a task, with its effects and the reason for its end. They are found from the
//! rows of events.csv, while these arrive.

use std::collections::{BTreeSet, HashMap};
use std::mem;
use std::sync::Arc;

use proto::event::EventLine;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::mission::data::MissionVocabulary;
use scenario::time::SimTime;
use scenario::{Catalog, Roster, Setup};

/// The end of a stint that has not ended.
const OPEN: SimTime = SimTime(u64::MAX);

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
    pub set: BehaviorId,
    pub task: TaskId,
    /// The time from activation to the end.
    pub span: Span,
    /// The effects on the world, in order: ends of steps with an event that changed a column of mission.csv, notes of
    /// progress on the task, and events that the mission declares as effects.
    pub effects: Vec<SimTime>,
    /// The times of the robot's events that verbs of the mission name, such as `picked` and `begun`, in order.
    pub acts: Vec<SimTime>,
    /// `true` if the whole stint is an effect ([`MissionVocabulary::continuous`]).
    pub continuous: bool,
    pub end: StintEnd,
    /// Whether the stint counts for takeovers; `None` while the rows up to now do not decide it.
    pub counts: Option<bool>,
    /// `true` for an activation of an exclusive task, until it is decided whether it is a takeover.
    pub(crate) may_take_over: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StintEnd {
    /// The log ended before the stint.
    Ongoing,
    /// The set left the active state for this reason, as in events.csv.
    Left(String),
    /// The robot was lost at this time.
    Lost(Loss, SimTime),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    Died,
    /// The process was stopped or did not respond.
    Stopped,
}

impl Loss {
    /// Returns the loss that a kind of event states.
    #[must_use]
    pub fn of_kind(kind: &str) -> Option<Self> {
        match kind {
            "gone" => Some(Self::Died),
            "stalled" => Some(Self::Stopped),
            _ => None,
        }
    }
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

    /// Returns whether the robot has acted or had an effect up to `now`.
    pub(crate) fn has_worked(&self, now: SimTime) -> bool {
        let has_effect = self.effects.first().is_some_and(|effect| *effect <= now);
        self.continuous || has_effect || !self.acts.is_empty()
    }

    /// Returns whether the robot acts or has an effect after `at`.
    pub(crate) fn works_after(&self, at: SimTime) -> bool {
        let acts = self.acts.last().is_some_and(|act| *act >= at);
        let has_effect = self.effects.last().is_some_and(|effect| *effect > at);
        acts || has_effect || self.continuous && self.span.to > at
    }

    /// Ends the stint. Later acts and effects are not its own.
    fn end(&mut self, to: SimTime, end: StintEnd) {
        self.span.to = to;
        self.end = end;
        self.acts.retain(|act| *act < to);
        self.effects.retain(|effect| *effect <= to);
    }
}

/// Finds the stints of each task in the rows of events.csv, which come in order.
pub(crate) struct StintTracker {
    step: SimTime,
    pub roster: Arc<Roster>,
    pub catalog: Arc<Catalog>,
    sets: HashMap<String, (BehaviorId, TaskId)>,
    terms: MissionVocabulary,
    robots: Vec<RobotState>,
    /// The stints of each task, in order of their start.
    pub stints: Vec<Vec<Stint>>,
    /// The tasks with new or ended stints.
    pub changed: BTreeSet<usize>,
}

#[derive(Clone, Default)]
struct RobotState {
    /// The effects that lie after the current row, with their task; `None` for effects on any task.
    effects: Vec<(SimTime, Option<TaskId>)>,
    /// The behavior sets that were active when the robot stopped.
    held: Vec<(BehaviorId, TaskId)>,
    /// The latest loss, and the end of the stints that it ended.
    lost: Option<(Loss, SimTime, SimTime)>,
}

impl StintTracker {
    pub fn new(setup: &Setup) -> Self {
        let catalog = &setup.catalog;
        let sets = (0..).map(BehaviorId).zip(&catalog.sets);
        Self {
            step: SimTime(setup.scenario.step_ms),
            roster: Arc::clone(&setup.roster),
            catalog: Arc::clone(catalog),
            sets: sets
                .map(|(id, set)| (set.name.clone(), (id, set.task)))
                .collect(),
            terms: catalog.mission.vocabulary(),
            robots: vec![RobotState::default(); setup.scenario.robots.len()],
            stints: vec![Vec::new(); catalog.tasks.len()],
            changed: BTreeSet::new(),
        }
    }

    /// Adds the next row. Rows about unknown robots and behavior sets are ignored.
    pub fn add(&mut self, event: &EventLine) {
        let Some(robot) = self.roster.find(&event.robot).map(RobotId::index) else {
            return;
        };
        let at = event.t_ms;
        let set = self.sets.get(&event.subject).copied();
        let mut verbs = self.terms.verbs.iter();
        if verbs.any(|(_, kind)| *kind == event.kind) {
            self.add_act(robot, at);
        }
        match (event.kind.as_str(), set) {
            ("activated", Some(set)) => {
                // A robot that is back can activate a set that it had before.
                self.leave(robot, set, at, "");
                self.begin(robot, set, at, true);
            }
            ("hibernated" | "waiting", Some(set)) => self.leave(robot, set, at, &event.reason),
            ("gone", _) => {
                // The report of the tick of a death can count. Then the robot worked to the end of this tick.
                let counted = end_of_last_counted(&event.detail, self.step);
                let to = counted.unwrap_or(at).clamp(at, at + self.step);
                self.lose(robot, Loss::Died, at, to);
                self.robots[robot].held.clear();
            }
            ("stalled", _) => self.lose(robot, Loss::Stopped, at, at),
            ("joined", _) => self.robots[robot] = RobotState::default(),
            ("back", _) => self.resume(robot, at),
            ("progress", _) => {
                if let Some(task) = self.catalog.find_task(&event.detail) {
                    self.note(robot, at, at, Some(task));
                }
            }
            // The end of the set is the effect, and the robot notices it in the same step.
            (kind, _) if self.terms.effects.contains(&kind) => self.note(robot, at, at, None),
            // The robot notices it one step later, and never after the mission's last step.
            (kind, _) if self.changes_column(kind) => {
                self.note(robot, at, at + self.step, None);
            }
            _ => {}
        }
    }

    /// Ends the open stints at the end of the log.
    pub fn finish(&mut self, end: SimTime) {
        for stint in self.stints.iter_mut().flatten() {
            if stint.span.to == OPEN {
                stint.end(end, StintEnd::Ongoing);
                self.changed.insert(stint.task.index());
            }
        }
    }

    /// Returns the tasks that a robot works on.
    pub fn tasks_of(&self, robot: usize) -> impl Iterator<Item = TaskId> {
        let stints = self.stints.iter().flatten();
        let open = stints.filter(move |stint| stint.robot == robot && stint.span.to == OPEN);
        open.map(|stint| stint.task)
    }

    /// Returns whether a robot works on the task, and it is not decided whether its activation is a takeover.
    pub fn has_undecided_takeover(&self, task: TaskId) -> bool {
        let mut stints = self.stints[task.index()].iter();
        stints.any(|stint| stint.may_take_over && stint.span.to == OPEN)
    }

    /// Returns the remaining stints.
    pub fn take_rest(&mut self) -> impl Iterator<Item = Stint> {
        self.stints.iter_mut().flat_map(mem::take)
    }

    fn changes_column(&self, kind: &str) -> bool {
        let mut columns = self.terms.columns.iter();
        columns.any(|column| column.event == Some(kind))
    }

    fn begin(
        &mut self,
        robot: usize,
        (set, task): (BehaviorId, TaskId),
        at: SimTime,
        is_activation: bool,
    ) {
        let state = &self.robots[robot];
        // The row of a death comes before the other rows of its tick.
        let (to, end) = match state.lost {
            Some((loss, lost_at, to)) if lost_at == at && to > at => {
                (to, StintEnd::Lost(loss, lost_at))
            }
            _ => (OPEN, StintEnd::Ongoing),
        };
        let is_exclusive = self.catalog.tasks[task.index()].max_robots == 1;
        let effects = state.effects.iter().filter(|(time, of_task)| {
            at < *time && *time <= to && of_task.is_none_or(|of_task| of_task == task)
        });
        self.stints[task.index()].push(Stint {
            robot,
            set,
            task,
            span: Span { from: at, to },
            effects: effects.map(|(time, _)| *time).collect(),
            acts: Vec::new(),
            continuous: self.terms.continuous,
            end,
            counts: None,
            may_take_over: is_activation && is_exclusive,
        });
        self.changed.insert(task.index());
    }

    /// Ends the stint of a set, if there is one. A stint without a tick is none.
    fn leave(
        &mut self,
        robot: usize,
        (set, task): (BehaviorId, TaskId),
        at: SimTime,
        reason: &str,
    ) {
        let stints = &mut self.stints[task.index()];
        let is_meant =
            |stint: &Stint| stint.robot == robot && stint.set == set && stint.span.to > at;
        if let Some(index) = stints.iter().position(is_meant) {
            stints[index].end(at, StintEnd::Left(reason.to_owned()));
            if stints[index].span.from == at {
                stints.remove(index);
            }
            self.changed.insert(task.index());
        }
    }

    fn lose(&mut self, robot: usize, loss: Loss, at: SimTime, to: SimTime) {
        let state = &mut self.robots[robot];
        state.lost = Some((loss, at, to));
        for stints in &mut self.stints {
            stints.retain_mut(|stint| {
                let is_open = stint.robot == robot && stint.span.to == OPEN;
                if is_open {
                    stint.end(to, StintEnd::Lost(loss, at));
                    state.held.push((stint.set, stint.task));
                    self.changed.insert(stint.task.index());
                }
                !is_open || stint.span.from < to
            });
        }
    }

    /// Continues the stints of a robot that was stopped. If it missed no tick, they have not ended.
    fn resume(&mut self, robot: usize, at: SimTime) {
        let end = StintEnd::Lost(Loss::Stopped, at);
        for (set, task) in mem::take(&mut self.robots[robot].held) {
            let mut stints = self.stints[task.index()].iter_mut();
            let is_same =
                |stint: &&mut Stint| stint.robot == robot && stint.set == set && stint.end == end;
            match stints.find(is_same) {
                Some(stint) => stint.end(OPEN, StintEnd::Ongoing),
                None => self.begin(robot, (set, task), at, false),
            }
        }
    }

    /// Adds an act to the stints of a robot.
    fn add_act(&mut self, robot: usize, at: SimTime) {
        for stint in self.stints.iter_mut().flatten() {
            let Span { from, to } = stint.span;
            if stint.robot == robot && from <= at && at < to {
                stint.acts.push(at);
            }
        }
    }

    /// Adds an effect at `time` from a row at `row_at` to the stints of a robot.
    fn note(&mut self, robot: usize, row_at: SimTime, time: SimTime, task: Option<TaskId>) {
        let later = &mut self.robots[robot].effects;
        later.retain(|(time, _)| *time > row_at);
        if time > row_at {
            later.push((time, task));
        }
        let stints = match task {
            Some(task) => &mut self.stints[task.index()..=task.index()],
            None => &mut self.stints[..],
        };
        for stint in stints.iter_mut().flatten() {
            let Span { from, to } = stint.span;
            if stint.robot == robot && from < time && time <= to {
                let index = stint.effects.partition_point(|effect| *effect < time);
                if stint.effects.get(index) != Some(&time) {
                    stint.effects.insert(index, time);
                }
            }
        }
    }
}

/// Returns the end of the last tick in which a report of a lost robot counted, from the detail of its loss.
#[must_use]
pub fn end_of_last_counted(detail: &str, step: SimTime) -> Option<SimTime> {
    let (_, tick) = detail.split_once("last counted in tick ")?;
    let tick: u64 = tick.split(';').next()?.parse().ok()?;
    Some(SimTime((tick + 1) * step.0))
}

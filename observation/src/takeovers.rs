//! The takeovers after the loss of a robot, found from the events of a run alone: while it is live, and at its end.

use std::collections::HashMap;
use std::fmt;

use proto::event::EventLine;
use scenario::Setup;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::stints::{Loss, Span, Stint, StintEnd, kept, predecessor};

/// The end of a stint that has not ended.
const OPEN: SimTime = SimTime(u64::MAX);

/// The number of stints per task above which old ones are dropped.
const STINTS_MAX: usize = 64;

/// The number of steps after which older stints no longer decide about another stint.
const OLD_STEPS: u64 = 100;

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

/// Finds takeovers while the events of a run arrive, with the definition of the reports. A claim counts when it has
/// lasted two steps, so a takeover is found that much later. Until a claim ends, it counts as one that does not yield.
pub struct TakeoverDetector {
    step: SimTime,
    robots: Vec<String>,
    tasks: Vec<TaskState>,
    /// The task of each behavior set.
    sets: HashMap<String, TaskId>,
    /// Activations that have not lasted long enough: time, robot and task.
    new: Vec<(SimTime, usize, TaskId)>,
    /// The losses of each robot, in order of time.
    losses: Vec<Vec<(SimTime, Loss)>>,
}

struct TaskState {
    name: String,
    is_exclusive: bool,
    stints: Vec<Stint>,
}

impl TakeoverDetector {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        let robots = setup.scenario.robots.iter();
        let robots: Vec<String> = robots.map(|robot| robot.name.clone()).collect();
        let tasks = setup.catalog.tasks.iter().map(|task| TaskState {
            name: task.name.clone(),
            is_exclusive: task.max_robots == 1,
            stints: Vec::new(),
        });
        let sets = setup.catalog.sets.iter();
        Self {
            step: SimTime(setup.scenario.step_ms),
            losses: vec![Vec::new(); robots.len()],
            robots,
            tasks: tasks.collect(),
            sets: sets.map(|set| (set.name.clone(), set.task)).collect(),
            new: Vec::new(),
        }
    }

    /// Adds the next event. Events of unknown robots and behavior sets are ignored.
    pub fn add(&mut self, event: &EventLine) {
        let Some(robot) = self.robots.iter().position(|name| *name == event.robot) else {
            return;
        };
        let at = event.t_ms;
        let task = self.sets.get(&event.subject).copied();
        match (event.kind.as_str(), task) {
            ("activated", Some(task)) => {
                self.begin(robot, task, at);
                if self.tasks[task.index()].is_exclusive {
                    self.new.push((at, robot, task));
                }
            }
            ("hibernated" | "waiting", Some(task)) => {
                let end = StintEnd::Left(event.reason.clone());
                self.end(robot, Some(task), at, &end);
            }
            ("gone", _) => self.lose(robot, at, Loss::Died),
            ("stalled", _) => self.lose(robot, at, Loss::Stopped),
            ("back", _) => self.resume(robot, at),
            _ => {}
        }
    }

    /// Returns the names of the tasks that a robot executes after the added events.
    #[must_use]
    pub fn tasks_of(&self, robot: &str) -> Vec<&str> {
        let is_open = |stint: &Stint| stint.span.to == OPEN && self.robots[stint.robot] == robot;
        let tasks = self.tasks.iter();
        let executed = tasks.filter(|task| task.stints.iter().any(is_open));
        executed.map(|task| task.name.as_str()).collect()
    }

    /// Returns the takeovers that are certain at `now`, in order of time.
    pub fn take(&mut self, now: SimTime) -> Vec<LossTakeover> {
        let certain = |(at, ..): &(SimTime, usize, TaskId)| *at + self.step + self.step <= now;
        let (mut due, new) = self.new.iter().copied().partition::<Vec<_>, _>(certain);
        self.new = new;
        due.sort_unstable_by_key(|(at, robot, _)| (*at, *robot));
        due.into_iter()
            .filter_map(|(at, robot, task)| self.takeover(at, robot, task))
            .collect()
    }

    fn begin(&mut self, robot: usize, task: TaskId, at: SimTime) {
        let step = self.step;
        let stints = &mut self.tasks[task.index()].stints;
        if stints.len() >= STINTS_MAX {
            let ended = |stint: &&&Stint| stint.span.to != OPEN;
            let latest = kept(stints, step)
                .iter()
                .filter(ended)
                .map(|stint| stint.span.to)
                .max();
            let recent = SimTime(at.0.saturating_sub(OLD_STEPS * step.0));
            stints.retain(|stint| Some(stint.span.to) == latest || stint.span.to >= recent);
        }
        stints.push(Stint {
            robot,
            task,
            span: Span { from: at, to: OPEN },
            effects: Vec::new(),
            continuous: false,
            end: StintEnd::Ongoing,
        });
    }

    /// Ends the stint of a robot for a task, or all of them.
    fn end(&mut self, robot: usize, task: Option<TaskId>, at: SimTime, end: &StintEnd) {
        let stints = self.tasks.iter_mut().flat_map(|task| &mut task.stints);
        let is_meant = |stint: &&mut Stint| {
            stint.robot == robot
                && stint.span.to == OPEN
                && task.is_none_or(|task| task == stint.task)
        };
        for stint in stints.filter(is_meant) {
            stint.span.to = at;
            stint.end = end.clone();
        }
    }

    fn lose(&mut self, robot: usize, at: SimTime, loss: Loss) {
        self.losses[robot].push((at, loss));
        self.end(robot, None, at, &StintEnd::Absent);
    }

    /// Continues the stints of a robot that was silent.
    fn resume(&mut self, robot: usize, at: SimTime) {
        let Some(&(lost_at, Loss::Stopped)) = self.losses[robot].last() else {
            return;
        };
        let stints = self.tasks.iter().flat_map(|task| &task.stints);
        let held = stints.filter(|stint| stint.robot == robot && stint.span.to == lost_at);
        let held: Vec<TaskId> = held.map(|stint| stint.task).collect();
        for task in held {
            self.begin(robot, task, at);
        }
    }

    fn takeover(&self, at: SimTime, robot: usize, task: TaskId) -> Option<LossTakeover> {
        let state = &self.tasks[task.index()];
        let kept = kept(&state.stints, self.step);
        let mut stints = kept.iter();
        let after = stints.find(|stint| stint.robot == robot && stint.span.from == at)?;
        let before = predecessor(after, &kept)?;
        if before.span.to > at || before.end != StintEnd::Absent {
            return None;
        }
        let mut losses = self.losses[before.robot].iter();
        let (lost_at, loss) = losses.find(|(lost_at, _)| *lost_at == before.span.to)?;
        Some(LossTakeover {
            at,
            robot: self.robots[robot].clone(),
            task: state.name.clone(),
            from: self.robots[before.robot].clone(),
            after: at.since(*lost_at),
            loss: *loss,
        })
    }
}

/// Returns all takeovers from lost robots in the events of a run that has ended, in order of time.
pub fn loss_takeovers<'a>(
    setup: &Setup,
    events: impl IntoIterator<Item = &'a EventLine>,
) -> Vec<LossTakeover> {
    let mut detector = TakeoverDetector::new(setup);
    for event in events {
        detector.add(event);
    }
    detector.take(OPEN)
}

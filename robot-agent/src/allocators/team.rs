//! A small team for allocator tests. All controllers step together. Tests control message loss, crashes and restarts. A
//! message sent in one step is received in the next.

use std::sync::Arc;

use proptest::prelude::*;
use proto::allocation::AllocationMessage;
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat};
use proto::tick::TaskOffer;
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{
    Allocator, AllocatorRunner, Choice, Input, OwnBehavior, RandomDraws, RunningAllocator,
    SelfState, StepOutcome, TaskBrief,
};

pub const STEP: SimTime = SimTime(50);

/// The interval 1/ρ between two heartbeats, ms.
pub const PERIOD: SimTime = SimTime(1000);
pub const TAU: SimTime = SimTime(5000);

#[derive(Clone, Debug)]
pub struct Situation {
    pub tasks: Vec<Task>,
    /// The time for a unit, s, by robot and task; `None` if the robot lacks the behavior.
    pub cost_s: Vec<Vec<Option<f64>>>,
}

#[derive(Clone, Copy, Debug)]
pub struct Task {
    pub max_robots: usize,
    pub priority: i32,
    pub reward: f64,
    pub round: SimTime,
    /// The remaining units of work; `None` for a task without an end.
    pub units: Option<u32>,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            max_robots: 1,
            priority: 0,
            reward: 1.0,
            round: SimTime::ZERO,
            units: None,
        }
    }
}

impl Situation {
    /// Creates exclusive tasks without an end.
    pub fn from_costs(cost_s: &[&[f64]]) -> Self {
        Self {
            tasks: vec![Task::default(); cost_s[0].len()],
            cost_s: cost_s
                .iter()
                .map(|row| row.iter().copied().map(Some).collect())
                .collect(),
        }
    }

    /// Generates up to `robots` robots and `tasks` tasks that never end.
    pub fn arbitrary(robots: usize, tasks: usize) -> impl Strategy<Value = Self> {
        (1..=robots, 1..=tasks).prop_flat_map(|(robots, tasks)| {
            let task = (1..3_usize, 0..2, 1..4).prop_map(|(max_robots, priority, reward)| Task {
                max_robots,
                priority,
                reward: f64::from(reward),
                ..Task::default()
            });
            let cost_s = prop::option::weighted(
                0.8,
                (0..400_u32).prop_map(|quarters| f64::from(quarters) / 4.0),
            );
            let cost_s = prop::collection::vec(prop::collection::vec(cost_s, tasks), robots);
            let tasks = prop::collection::vec(task, tasks);
            (tasks, cost_s).prop_map(|(tasks, cost_s)| Self { tasks, cost_s })
        })
    }
}

/// A team of robots. Tests may change the situation between steps.
pub struct Team<A: Allocator> {
    pub situation: Situation,
    pub robots: Vec<Robot<A>>,
    config: A::Config,
    tick: u64,
    pub in_flight: Vec<Arc<Broadcast>>,
}

pub struct Robot<A> {
    /// The controller; `None` while the robot is crashed.
    controller: Option<AllocatorRunner<A>>,
    pub incarnation: Incarnation,
    seq: u64,
    /// The task that the robot executes; `None` while it is crashed.
    pub active: Option<TaskId>,
    /// True if the robot makes progress. A robot that does not still reports its task.
    pub makes_progress: bool,
    worked_s: f64,
    progressed: Vec<TaskId>,
    pub outcome: StepOutcome,
}

impl<A: Allocator> Team<A> {
    pub fn new(situation: Situation, config: A::Config) -> Self {
        let robots = situation.cost_s.len();
        let mut team = Self {
            situation,
            robots: Vec::new(),
            config,
            tick: 0,
            in_flight: Vec::new(),
        };
        for rank in 0..robots {
            let controller = AllocatorRunner::new(team.me(rank, 1), &team.config);
            team.robots.push(Robot {
                controller: Some(controller),
                incarnation: 1,
                seq: 0,
                active: None,
                makes_progress: true,
                worked_s: 0.0,
                progressed: Vec::new(),
                outcome: StepOutcome::default(),
            });
        }
        team
    }

    fn me(&self, rank: usize, incarnation: Incarnation) -> SelfState {
        let tasks = || self.situation.tasks.iter().zip(0..);
        let able = tasks().filter(|&(_, task)| self.cost_s(rank, TaskId(task)).is_some());
        SelfState {
            robot: RobotId(rank as u16),
            incarnation,
            team: self.situation.cost_s.len(),
            tasks: self.situation.tasks.len(),
            briefs: self.briefs(),
            behaviors: able
                .map(|(spec, task)| OwnBehavior {
                    id: BehaviorId(task),
                    task: TaskId(task),
                    max_robots: spec.max_robots,
                    priority: spec.priority,
                })
                .collect(),
            step_s: STEP.as_secs_f64(),
            heartbeat_period: PERIOD,
            ceased_after: TAU,
            assigned: [].into(),
        }
    }

    pub fn briefs(&self) -> Arc<[TaskBrief]> {
        let brief = |(task, id): (&Task, u16)| {
            let ranks = 0..self.situation.cost_s.len();
            let able = ranks.filter(|&rank| self.cost_s(rank, TaskId(id)).is_some());
            let costs = able
                .clone()
                .filter_map(|rank| self.cost_s(rank, TaskId(id)));
            TaskBrief {
                max_robots: task.max_robots,
                priority: task.priority,
                unit_s: costs.fold(0.0, f64::max),
                robots: able.map(|rank| RobotId(rank as u16)).collect(),
            }
        };
        self.situation.tasks.iter().zip(0..).map(brief).collect()
    }

    pub fn allocator(&self, rank: usize) -> &A {
        let controller = self.robots[rank].controller.as_ref();
        controller.expect("the robot is running").allocator()
    }

    fn cost_s(&self, rank: usize, task: TaskId) -> Option<f64> {
        self.situation.cost_s[rank][task.index()]
    }

    pub fn now(&self) -> SimTime {
        SimTime(self.tick * STEP.0)
    }

    /// Makes one step in which each broadcast reaches all robots.
    pub fn step(&mut self) {
        self.step_with(|_, _| true);
    }

    pub fn run(&mut self, steps: u64) {
        for _ in 0..steps {
            self.step();
        }
    }

    /// Makes one step; `passes` returns whether a robot receives a broadcast.
    pub fn step_with(&mut self, mut passes: impl FnMut(&Broadcast, RobotId) -> bool) {
        let (now, tick) = (self.now(), self.tick);
        let ground_truth = self.ground_truth();
        let mut outgoing = Vec::new();
        for rank in 0..self.robots.len() {
            let me = RobotId(rank as u16);
            let mut received = self.in_flight.clone();
            received.retain(|broadcast| broadcast.sender != me && passes(broadcast, me));
            let choices = self.choices(rank);
            let applicable: Vec<bool> = choices.iter().map(|choice| choice.applicable).collect();
            let robot = &mut self.robots[rank];
            let Some(controller) = &mut robot.controller else {
                continue;
            };
            let input = Input {
                now,
                step_s: STEP.as_secs_f64(),
                position: None,
                is_laden: false,
                applicable: &applicable,
                choices: &choices,
                progressed: &std::mem::take(&mut robot.progressed),
                received: &received,
                // The cost does not depend on the previous task.
                seconds: &|_, task| choices.iter().find(|choice| choice.task == task)?.cost_s,
                ground_truth: &ground_truth,
                draws: RandomDraws::new(7, me, tick),
            };
            controller.step(&input, &mut robot.outcome);
            let active = robot.outcome.active.map(|behavior| TaskId(behavior.0));
            if active != robot.active {
                (robot.active, robot.worked_s) = (active, 0.0);
            }
            outgoing.extend(robot.broadcasts(me, tick).map(Arc::new));
        }
        self.in_flight = outgoing;
        self.tick += 1;
        self.work();
    }

    /// Returns the offers that working robots made in the previous step.
    fn ground_truth(&self) -> Vec<TaskOffer> {
        let robots = self.robots.iter().zip(0..);
        let able = robots.filter(|(robot, _)| robot.controller.is_some() && robot.makes_progress);
        let offers = able.flat_map(|(robot, rank)| {
            let rows = robot.outcome.rows.iter();
            rows.map(move |row| TaskOffer {
                robot: RobotId(rank),
                behavior: row.behavior,
                task: row.task,
                utility: row.utility,
            })
        });
        offers.filter(|offer| offer.utility > 0.0).collect()
    }

    fn choices(&self, rank: usize) -> Vec<Choice> {
        let tasks = self.situation.tasks.iter().zip(0..);
        tasks
            .filter_map(|(task, id)| {
                let cost_s = self.cost_s(rank, TaskId(id))?;
                Some(Choice {
                    behavior: BehaviorId(id),
                    task: TaskId(id),
                    round: task.round,
                    applicable: task.units != Some(0),
                    cost_s: Some(cost_s),
                    reward: task.reward,
                    priority: task.priority,
                    max_robots: task.max_robots,
                })
            })
            .collect()
    }

    /// Adds one step of work to each active task. A unit is done after its cost in time.
    fn work(&mut self) {
        for rank in 0..self.robots.len() {
            let robot = &self.robots[rank];
            let (Some(task), true) = (robot.active, robot.makes_progress) else {
                continue;
            };
            let cost_s = self.cost_s(rank, task);
            let (robot, task_at) = (
                &mut self.robots[rank],
                &mut self.situation.tasks[task.index()],
            );
            robot.worked_s += STEP.as_secs_f64();
            if cost_s.is_some_and(|cost_s| robot.worked_s >= cost_s) && task_at.units != Some(0) {
                robot.worked_s = 0.0;
                robot.progressed.push(task);
                task_at.units = task_at.units.map(|left| left - 1);
            }
        }
    }

    /// Sends a message in a robot's name, for delivery in the next step.
    pub fn inject(&mut self, rank: usize, message: AllocationMessage) {
        let robot = &mut self.robots[rank];
        let seq = robot.seq;
        robot.seq += 1;
        self.in_flight.push(Arc::new(Broadcast {
            sender: RobotId(rank as u16),
            incarnation: robot.incarnation,
            tick: self.tick,
            index: 0,
            seq,
            sent: self.now(),
            body: BroadcastContent::Allocation(message),
        }));
    }

    /// Crashes a robot. Its broadcasts of the latest step are still delivered.
    pub fn kill(&mut self, rank: usize) {
        let robot = &mut self.robots[rank];
        robot.controller = None;
        robot.active = None;
        robot.progressed.clear();
    }

    pub fn restart(&mut self, rank: usize) {
        self.kill(rank);
        let incarnation = self.robots[rank].incarnation + 1;
        let controller = AllocatorRunner::new(self.me(rank, incarnation), &self.config);
        let robot = &mut self.robots[rank];
        (robot.controller, robot.incarnation, robot.seq) = (Some(controller), incarnation, 0);
        robot.outcome = StepOutcome::default();
    }

    pub fn executors(&self, task: usize) -> Vec<usize> {
        let task = Some(TaskId(task as u16));
        let ranks = 0..self.robots.len();
        ranks
            .filter(|&rank| self.robots[rank].active == task)
            .collect()
    }

    pub fn is_done(&self) -> bool {
        self.situation
            .tasks
            .iter()
            .all(|task| task.units == Some(0))
    }
}

impl<A> Robot<A> {
    fn broadcasts(&mut self, sender: RobotId, tick: u64) -> impl Iterator<Item = Broadcast> {
        let sent = SimTime(tick * STEP.0);
        let heartbeats = self.outcome.announcements.iter().map(|announcement| {
            BroadcastContent::Heartbeat(Heartbeat {
                state: announcement.state,
                since: announcement.since,
                set: announcement.behavior,
                task: announcement.task,
                progress: announcement.progress,
                position: None,
                carrying: false,
                shared_knowledge: SharedKnowledge::default(),
            })
        });
        let messages = self.outcome.say.drain(..).map(BroadcastContent::Allocation);
        let (incarnation, first) = (self.incarnation, self.seq);
        let bodies: Vec<BroadcastContent> = heartbeats.chain(messages).collect();
        self.seq += bodies.len() as u64;
        bodies
            .into_iter()
            .zip(0..)
            .map(move |(body, index)| Broadcast {
                sender,
                incarnation,
                tick,
                index,
                seq: first + u64::from(index),
                sent,
                body,
            })
    }
}

/// Returns the allocator messages among the broadcasts, with their senders.
pub fn allocator_messages(
    broadcasts: &[Arc<Broadcast>],
) -> impl Iterator<Item = (RobotId, &AllocationMessage)> {
    broadcasts
        .iter()
        .filter_map(|broadcast| match &broadcast.body {
            BroadcastContent::Allocation(message) => Some((broadcast.sender, message)),
            _ => None,
        })
}

//! A small team for allocator tests. All controllers step together. Tests control message loss, crashes and restarts. A
//! message sent in one step is received in the next.

use std::sync::Arc;

use proptest::prelude::*;
use proto::allocation::AllocationMessage;
use proto::team::{Broadcast, BroadcastContent};
use proto::tick::TaskOffer;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use super::links;
use crate::allocator::{
    Allocator, AllocatorRunner, Choice, Input, RunningAllocator, SelfState, StepOutcome, TaskBrief,
};
use crate::fixtures;

pub use crate::fixtures::{PERIOD, STEP, TAU};

#[derive(Clone, Debug)]
pub struct Situation {
    pub tasks: Vec<Task>,
    /// The time for a unit, s, by robot and task; `None` if the robot lacks the behavior.
    pub cost_s: Vec<Vec<Option<f64>>>,
    /// The time for a unit of the second task after one of the first, s; `None` if it does not depend on the first.
    pub after_s: Option<Vec<Vec<f64>>>,
}

#[derive(Clone, Copy, Debug)]
pub struct Task {
    pub max_robots: usize,
    pub priority: i32,
    pub reward: f64,
    pub round: SimTime,
    /// The remaining units of work; `None` for a task without an end.
    pub units: Option<u32>,
    /// The first task of its coalition, if robots must execute several tasks at the same time.
    pub coalition: Option<TaskId>,
}

impl Default for Task {
    fn default() -> Self {
        Self {
            max_robots: 1,
            priority: 0,
            reward: 1.0,
            round: SimTime::ZERO,
            units: None,
            coalition: None,
        }
    }
}

impl Situation {
    /// Creates exclusive tasks without an end.
    pub fn from_costs(cost_s: &[&[f64]]) -> Self {
        let row = |row: &&[f64]| row.iter().copied().map(Some).collect();
        Self {
            tasks: vec![Task::default(); cost_s[0].len()],
            cost_s: cost_s.iter().map(row).collect(),
            after_s: None,
        }
    }

    /// Creates tasks with the costs of each robot.
    pub fn from_rows(tasks: Vec<Task>, cost_s: Vec<Vec<Option<f64>>>) -> Self {
        Self {
            tasks,
            cost_s,
            after_s: None,
        }
    }

    /// Creates random tasks that lead from one place of a grid to another. Some costs are therefore equal, and a direct
    /// way is never longer than one with a stop.
    pub fn on_grid(chance: &mut ChaCha8Rng, robots: usize, tasks: usize) -> Self {
        let starts = places(chance, robots);
        let (from, to) = (places(chance, tasks), places(chance, tasks));
        let mut situation = Self::between(&starts, &from, &to);
        for task in &mut situation.tasks {
            task.reward = f64::from(chance.random_range(1..4_u8));
        }
        situation
    }

    /// Creates tasks of no duration at random places of a grid. The costs are a metric: the same in both directions.
    pub fn at_places(chance: &mut ChaCha8Rng, robots: usize, tasks: usize) -> Self {
        let (starts, at) = (places(chance, robots), places(chance, tasks));
        Self::between(&starts, &at, &at)
    }

    /// Creates tasks that lead from one place to another.
    fn between(starts: &[(i32, i32)], from: &[(i32, i32)], to: &[(i32, i32)]) -> Self {
        let way = |a: (i32, i32), b: (i32, i32)| f64::from((a.0 - b.0).abs() + (a.1 - b.1).abs());
        let units_from = |start| {
            from.iter()
                .zip(to)
                .map(move |(&a, &b)| way(start, a) + way(a, b))
        };
        Self {
            tasks: vec![Task::default(); from.len()],
            cost_s: starts
                .iter()
                .map(|&start| units_from(start).map(Some).collect())
                .collect(),
            after_s: Some(to.iter().map(|&end| units_from(end).collect()).collect()),
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
            let cost_s = (0..400_u32).prop_map(|quarters| f64::from(quarters) / 4.0);
            let cost_s = prop::option::weighted(0.8, cost_s);
            let cost_s = prop::collection::vec(prop::collection::vec(cost_s, tasks), robots);
            let tasks = prop::collection::vec(task, tasks);
            (tasks, cost_s).prop_map(|(tasks, cost_s)| Self {
                tasks,
                cost_s,
                after_s: None,
            })
        })
    }

    /// Changes some costs to others below `most_s`, and sets some tasks due or done, with probability `share`.
    pub fn change(&mut self, chance: &mut ChaCha8Rng, most_s: f64, share: f64) {
        for cost_s in self.cost_s.iter_mut().flatten().flatten() {
            if chance.random_bool(0.3) {
                *cost_s = chance.random_range(0.1..most_s);
            }
        }
        for task in &mut self.tasks {
            if chance.random_bool(share) {
                task.units = if task.units.is_none() { Some(0) } else { None };
            }
        }
    }

    /// Returns the time for a unit of `task` after one of each of other tasks, s.
    pub fn seconds(&self, rank: usize, after: &[TaskId], task: TaskId) -> Option<f64> {
        match (&self.after_s, after.last()) {
            (Some(after_s), Some(last)) => Some(after_s[last.index()][task.index()]),
            _ => self.cost_s[rank][task.index()],
        }
    }
}

/// Returns random places of a grid.
fn places(chance: &mut ChaCha8Rng, count: usize) -> Vec<(i32, i32)> {
    let mut place = || (chance.random_range(0..30), chance.random_range(0..30));
    (0..count).map(|_| place()).collect()
}

/// A team of robots. Tests may change the situation between steps.
pub struct Team<A: Allocator> {
    pub situation: Situation,
    pub robots: Vec<Robot<A>>,
    /// The possible tasks, as `applicable[rank][task]`.
    pub applicable: Vec<Vec<bool>>,
    /// The delivery of messages in [`Team::step`], as `links[from][to]`.
    pub links: Vec<Vec<bool>>,
    /// The probability of message loss in [`Team::step`].
    pub loss: f64,
    pub in_flight: Vec<Arc<Broadcast>>,
    config: A::Config,
    tau: SimTime,
    tick: u64,
    chance: ChaCha8Rng,
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
    pub progressed: Vec<TaskId>,
    pub outcome: StepOutcome,
}

impl<A: Allocator> Team<A> {
    pub fn new(situation: Situation, config: A::Config) -> Self {
        Self::with_tau(0, TAU, situation, config)
    }

    /// Creates a team that makes no progress, in which a teammate counts as lost after `tau`. The seed determines the
    /// message losses and the random links.
    pub fn still(seed: u64, tau: SimTime, situation: Situation, config: A::Config) -> Self {
        let mut team = Self::with_tau(seed, tau, situation, config);
        for robot in &mut team.robots {
            robot.makes_progress = false;
        }
        team
    }

    /// Creates a team in which each robot can do all tasks. Each task has two units, of `costs` seconds.
    pub fn with_work(robots: usize, costs: &[u32], config: A::Config) -> Self {
        let costs: Vec<f64> = costs.iter().copied().map(f64::from).collect();
        let mut situation = Situation::from_costs(&vec![&costs[..]; robots]);
        for task in &mut situation.tasks {
            task.units = Some(2);
        }
        Self::new(situation, config)
    }

    fn with_tau(seed: u64, tau: SimTime, situation: Situation, config: A::Config) -> Self {
        let (robots, tasks) = (situation.cost_s.len(), situation.tasks.len());
        let mut team = Self {
            situation,
            robots: Vec::new(),
            applicable: vec![vec![true; tasks]; robots],
            links: vec![vec![true; robots]; robots],
            loss: 0.0,
            in_flight: Vec::new(),
            config,
            tau,
            tick: 0,
            chance: ChaCha8Rng::seed_from_u64(seed),
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
        let robots = self.situation.cost_s.len();
        let mut me = fixtures::self_state(RobotId(rank as u32), robots, self.briefs());
        me.behaviors
            .retain(|own| self.cost_s(rank, own.task).is_some());
        (me.incarnation, me.ceased_after) = (incarnation, self.tau);
        me
    }

    /// Links the robots along a line, with a share `more` of random additional links.
    pub fn connect_as_line(&mut self, more: f64) {
        links::connect_as_line(&mut self.links, more, &mut self.chance);
    }

    /// Returns the largest distance between two robots, in links.
    pub fn diameter(&self) -> usize {
        links::diameter(&self.links)
    }

    pub fn briefs(&self) -> Arc<[TaskBrief]> {
        let brief = |(task, id): (&Task, u32)| {
            let ranks = 0..self.situation.cost_s.len();
            let able = ranks.filter(|&rank| self.cost_s(rank, TaskId(id)).is_some());
            let costs = able
                .clone()
                .filter_map(|rank| self.cost_s(rank, TaskId(id)));
            TaskBrief {
                max_robots: task.max_robots,
                priority: task.priority,
                unit_s: costs.fold(0.0, f64::max),
                robots: able.map(|rank| RobotId(rank as u32)).collect(),
                coalition: task.coalition,
            }
        };
        self.situation.tasks.iter().zip(0..).map(brief).collect()
    }

    pub fn allocator(&self, rank: usize) -> &A {
        let controller = self.robots[rank].controller.as_ref();
        controller.expect("the robot is running").allocator()
    }

    /// Returns the ranks of the robots that are not crashed.
    pub fn running(&self) -> impl Iterator<Item = usize> + Clone {
        let ranks = 0..self.robots.len();
        ranks.filter(|&rank| self.robots[rank].controller.is_some())
    }

    fn cost_s(&self, rank: usize, task: TaskId) -> Option<f64> {
        self.situation.cost_s[rank][task.index()]
    }

    pub fn now(&self) -> SimTime {
        SimTime(self.tick * STEP.0)
    }

    /// Makes one step in which broadcasts reach the linked robots, except those that are lost.
    pub fn step(&mut self) {
        let (links, loss) = (self.links.clone(), self.loss);
        let mut chance = self.chance.clone();
        self.step_with(|broadcast, receiver| {
            links[broadcast.sender.index()][receiver.index()] && !chance.random_bool(loss)
        });
        self.chance = chance;
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
            let me = RobotId(rank as u32);
            let mut received = self.in_flight.clone();
            received.retain(|broadcast| broadcast.sender != me && passes(broadcast, me));
            let choices = self.choices(rank);
            let applicable: Vec<bool> = choices.iter().map(|choice| choice.applicable).collect();
            let robot = &mut self.robots[rank];
            let Some(controller) = &mut robot.controller else {
                continue;
            };
            let situation = &self.situation;
            let input = Input {
                applicable: &applicable,
                choices: &choices,
                progressed: &std::mem::take(&mut robot.progressed),
                received: &received,
                seconds: &|after, task| situation.seconds(rank, after, task),
                ground_truth: &ground_truth,
                ..fixtures::input(now, me)
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
                    round: task.round,
                    applicable: task.units != Some(0) && self.applicable[rank][id as usize],
                    reward: task.reward,
                    priority: task.priority,
                    max_robots: task.max_robots,
                    ..fixtures::choice(id, cost_s)
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
        let now = self.now();
        let robot = &mut self.robots[rank];
        let number = (robot.incarnation, robot.seq);
        robot.seq += 1;
        let body = BroadcastContent::Allocation(message);
        let broadcast = fixtures::broadcast(RobotId(rank as u32), number, now, body);
        self.in_flight.push(Arc::new(broadcast));
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

    /// Returns the task that each robot executes, by rank.
    pub fn active(&self) -> Vec<Option<usize>> {
        let active = |robot: &Robot<A>| robot.active.map(TaskId::index);
        self.robots.iter().map(active).collect()
    }

    pub fn executors(&self, task: usize) -> Vec<usize> {
        let task = Some(TaskId(task as u32));
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
        let heartbeats = self.outcome.announcements.iter().map(fixtures::heartbeat);
        let messages = self.outcome.say.drain(..).map(BroadcastContent::Allocation);
        let (incarnation, first) = (self.incarnation, self.seq);
        let bodies: Vec<BroadcastContent> = heartbeats.chain(messages).collect();
        self.seq += bodies.len() as u64;
        let numbered = bodies.into_iter().zip(first..);
        numbered.map(move |(body, seq)| fixtures::broadcast(sender, (incarnation, seq), sent, body))
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

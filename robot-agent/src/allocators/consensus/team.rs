//! A team in lockstep: several allocators with their costs, on lossy links. Robots do not move or make progress unless
//! the test does so.

use std::sync::Arc;

use proto::team::{Broadcast, BroadcastContent};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocator::{
    Allocator, Choice, Decision, Input, OwnBehavior, RandomDraws, SelfState, TaskBrief,
};
use crate::allocators::links;

/// The length of a step, ms.
pub const STEP_MS: u64 = 50;

/// The costs and rewards of the tasks.
#[derive(Clone, Debug)]
pub struct Work {
    /// The time of a first unit, s: a row per robot, a column per task.
    pub first_s: Vec<Vec<f64>>,
    /// The time of a unit of the second task after one of the first, s.
    pub after_s: Vec<Vec<f64>>,
    pub reward: Vec<f64>,
    pub priority: Vec<i32>,
    pub max_robots: Vec<usize>,
}

impl Work {
    /// Creates random work. A task leads from one place of a grid to another. Some costs are therefore equal, and a
    /// direct way is never longer than one with a stop.
    pub fn random(chance: &mut ChaCha8Rng, robots: usize, tasks: usize) -> Self {
        let mut places = |count: usize| -> Vec<(i32, i32)> {
            let mut place = || (chance.random_range(0..30), chance.random_range(0..30));
            (0..count).map(|_| place()).collect()
        };
        let (starts, from, to) = (places(robots), places(tasks), places(tasks));
        let way = |a: (i32, i32), b: (i32, i32)| f64::from((a.0 - b.0).abs() + (a.1 - b.1).abs());
        let from_all = |starts: &[(i32, i32)]| -> Vec<Vec<f64>> {
            let units = || from.iter().zip(&to);
            let row = |&start| units().map(|(&a, &b)| way(start, a) + way(a, b)).collect();
            starts.iter().map(row).collect()
        };
        Self {
            first_s: from_all(&starts),
            after_s: from_all(&to),
            reward: (0..tasks)
                .map(|_| f64::from(chance.random_range(1..4_u8)))
                .collect(),
            priority: vec![0; tasks],
            max_robots: vec![1; tasks],
        }
    }

    pub fn robots(&self) -> usize {
        self.first_s.len()
    }

    pub fn tasks(&self) -> usize {
        self.reward.len()
    }

    /// Returns the time at which each unit of a path is done, s.
    pub fn times(&self, robot: usize, path: &[usize]) -> Vec<f64> {
        let mut time_s = 0.0;
        let mut times = Vec::new();
        for (place, &task) in path.iter().enumerate() {
            time_s += match place {
                0 => self.first_s[robot][task],
                _ => self.after_s[path[place - 1]][task],
            };
            times.push(time_s);
        }
        times
    }

    fn seconds(&self, robot: usize, after: &[TaskId], task: TaskId) -> f64 {
        match after.last() {
            Some(last) => self.after_s[last.index()][task.index()],
            None => self.first_s[robot][task.index()],
        }
    }

    /// Computes S(p), without the bonus of a unit under way.
    pub fn score(&self, robot: usize, path: &[usize]) -> f64 {
        let times = self.times(robot, path).into_iter().zip(path);
        times.fold(0.0, |score, (time_s, &task)| {
            score + self.reward[task] * libm::pow(0.98, time_s)
        })
    }
}

#[derive(Clone, Debug)]
pub struct Member<A> {
    pub allocator: A,
    pub decision: Decision,
    pub me: SelfState,
    seq: u64,
}

pub struct Team<A: Allocator> {
    pub work: Work,
    pub members: Vec<Member<A>>,
    /// The delivery of messages, as `links[from][to]`.
    pub links: Vec<Vec<bool>>,
    /// The probability of message loss.
    pub loss: f64,
    /// The robots that skip their steps.
    pub crashed: Vec<bool>,
    /// The applicable tasks, as `can[robot][task]`.
    pub applicable: Vec<Vec<bool>>,
    /// The time since which each task has been due.
    pub round: Vec<SimTime>,
    /// The progress of each robot before this step.
    pub progressed: Vec<Vec<TaskId>>,
    pub tick: u64,
    chance: ChaCha8Rng,
    on_air: Vec<Arc<Broadcast>>,
    whispers: Vec<(usize, Arc<Broadcast>)>,
}

impl<A: Allocator> Team<A> {
    /// Creates a team in which all robots receive each other.
    pub fn new(seed: u64, work: Work, config: &A::Config, ceased_after: SimTime) -> Self {
        let robots = work.robots();
        let mut team = Self {
            members: Vec::new(),
            links: vec![vec![true; robots]; robots],
            loss: 0.0,
            crashed: vec![false; robots],
            applicable: vec![vec![true; work.tasks()]; robots],
            round: vec![SimTime::ZERO; work.tasks()],
            progressed: vec![Vec::new(); robots],
            work,
            tick: 0,
            chance: ChaCha8Rng::seed_from_u64(seed),
            on_air: Vec::new(),
            whispers: Vec::new(),
        };
        for robot in 0..robots {
            let member = team.fresh_member(robot, 1, config, ceased_after);
            team.members.push(member);
        }
        team
    }

    /// Creates a robot without any earlier state.
    pub fn fresh_member(
        &self,
        robot: usize,
        incarnation: Incarnation,
        config: &A::Config,
        ceased_after: SimTime,
    ) -> Member<A> {
        let work = &self.work;
        let behaviors = (0..work.tasks()).map(|task| OwnBehavior {
            id: BehaviorId(task as u16),
            task: TaskId(task as u16),
            max_robots: work.max_robots[task],
            priority: work.priority[task],
        });
        let briefs = (0..work.tasks()).map(|task| TaskBrief {
            max_robots: work.max_robots[task],
            priority: work.priority[task],
            unit_s: 60.0,
            robots: (0..work.robots() as u16).map(RobotId).collect(),
            coalition: None,
        });
        let me = SelfState {
            robot: RobotId(robot as u16),
            incarnation,
            team: work.robots(),
            tasks: work.tasks(),
            behaviors: behaviors.collect(),
            step_s: STEP_MS as f64 / 1000.0,
            heartbeat_period: SimTime(1000),
            ceased_after,
            assigned: Arc::new([]),
            briefs: briefs.collect(),
        };
        Member {
            allocator: A::new(&me, config),
            decision: Decision::default(),
            me,
            seq: 0,
        }
    }

    /// Links the robots along a line, with a share `more` of random additional links.
    pub fn connect_as_line(&mut self, more: f64) {
        links::connect_as_line(&mut self.links, more, &mut self.chance);
    }

    /// Returns the largest distance between two robots, in links.
    pub fn diameter(&self) -> usize {
        links::diameter(&self.links)
    }

    /// Restarts all robots with the time `tau` until a teammate counts as lost. Then message losses, cut links, crashes,
    /// restarts and new rounds occur in any order, and end. `check` is called after each step.
    pub fn go_through_trouble(
        &mut self,
        seed: u64,
        config: &A::Config,
        tau: SimTime,
        check: impl Fn(&Self),
    ) {
        let robots = self.members.len();
        for robot in 0..robots {
            self.members[robot] = self.fresh_member(robot, 1, config, tau);
        }
        let mut incarnations = vec![1; robots];
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..10 {
            self.loss = [0.0, 0.3, 0.9][chance.random_range(0..3)];
            for link in self.links.iter_mut().flatten() {
                *link = chance.random_bool(0.7);
            }
            let robot = chance.random_range(0..robots);
            match chance.random_range(0..4) {
                0 => self.crashed[robot] = true,
                1 => {
                    incarnations[robot] += 1;
                    self.members[robot] =
                        self.fresh_member(robot, incarnations[robot], config, tau);
                    self.crashed[robot] = false;
                }
                2 => {
                    let task = chance.random_range(0..self.work.tasks());
                    self.round[task] = self.now();
                }
                _ => {}
            }
            for _ in 0..chance.random_range(1..150) {
                self.step();
                check(self);
            }
        }
        self.loss = 0.0;
        for link in self.links.iter_mut().flatten() {
            *link = true;
        }
    }

    pub fn now(&self) -> SimTime {
        SimTime(STEP_MS * self.tick)
    }

    /// Makes one step of all robots. Each receives the messages of the previous step.
    pub fn step(&mut self) {
        let now = self.now();
        let mut outgoing = Vec::new();
        for (robot, member) in self.members.iter_mut().enumerate() {
            if self.crashed[robot] {
                continue;
            }
            let mut received = Vec::new();
            for broadcast in &self.on_air {
                let from = broadcast.sender.index();
                let is_linked = from != robot && self.links[from][robot];
                if is_linked && !self.chance.random_bool(self.loss) {
                    received.push(Arc::clone(broadcast));
                }
            }
            let whispers = self.whispers.iter().filter(|(to, _)| *to == robot);
            received.extend(whispers.map(|(_, broadcast)| Arc::clone(broadcast)));
            let choices: Vec<Choice> = (0..self.work.tasks())
                .map(|task| Choice {
                    behavior: BehaviorId(task as u16),
                    task: TaskId(task as u16),
                    round: self.round[task],
                    applicable: self.applicable[robot][task],
                    cost_s: Some(self.work.first_s[robot][task]),
                    opens_in_s: 0.0,
                    reward: self.work.reward[task],
                    priority: self.work.priority[task],
                    max_robots: self.work.max_robots[task],
                })
                .collect();
            let decision = &mut member.decision;
            decision.reason = None;
            decision.say.clear();
            decision.rows.clear();
            let input = Input {
                now,
                step_s: member.me.step_s,
                position: None,
                heading_rad: None,
                energy_j: None,
                is_laden: false,
                applicable: &self.applicable[robot],
                choices: &choices,
                progressed: &std::mem::take(&mut self.progressed[robot]),
                received: &received,
                seconds: &|after, task| Some(self.work.seconds(robot, after, task)),
                place: &|_| None,
                travel_s: &|_| None,
                ground_truth: &[],
                draws: RandomDraws::new(7, member.me.robot, self.tick),
            };
            member.allocator.step(&input, decision);
            for (index, message) in decision.say.iter().enumerate() {
                outgoing.push(Arc::new(Broadcast {
                    sender: member.me.robot,
                    incarnation: member.me.incarnation,
                    tick: self.tick,
                    index: index as u16,
                    seq: member.seq,
                    sent: now,
                    body: BroadcastContent::Allocation(message.clone()),
                }));
                member.seq += 1;
            }
        }
        self.whispers.clear();
        self.on_air = outgoing;
        self.tick += 1;
    }

    /// Returns the active task of each robot, by rank.
    pub fn active(&self) -> Vec<Option<usize>> {
        let active = |member: &Member<A>| member.decision.active.map(BehaviorId::index);
        self.members.iter().map(active).collect()
    }

    /// Delivers a broadcast to one robot only, in the next step, after all others.
    pub fn deliver_to(&mut self, robot: usize, broadcast: Arc<Broadcast>) {
        self.whispers.push((robot, broadcast));
    }

    /// Returns the number of messages in flight.
    pub fn in_flight(&self) -> usize {
        self.on_air.len()
    }
}

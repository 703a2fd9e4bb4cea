//! Conformance tests for allocators of any crate: the laws G1 to G4 of ALLOCATORS.md.
//!
//! ```
//! use robot_agent::allocator::NoParameters;
//! use robot_agent::allocators::nearest::Nearest;
//! robot_agent::testkit::check_allocator::<Nearest>(&NoParameters {});
//! ```

use std::sync::Arc;

use glam::Vec2;
use proto::allocation::{AllocationMessage, OPEN_MESSAGE_MAX, OpenMessage};
use proto::codec::{decode, encode, encoded_len};
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use proto::telemetry::{AllocationRow, BehaviorState};
use proto::tick::TaskOffer;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use terminal::panics;

use crate::allocator::{
    Allocator, AllocatorRunner, Choice, Input, OwnBehavior, RandomDraws, RunningAllocator,
    SelfState, StepOutcome, TaskBrief,
};

const TEAMS: u64 = 60;
const STEPS: u64 = 400;

/// Runs an allocator through random situations and checks the laws. The broadcasts of teammates are heartbeats, junk,
/// and messages of the same allocator.
///
/// # Panics
/// Panics with the violated law, the seed and the step.
pub fn check_allocator<A: Allocator>(config: &A::Config) {
    check_running_allocator(|me| Box::new(AllocatorRunner::<A>::new(me, config)));
}

/// Checks allocators with their own states and heartbeats, like [`check_allocator`].
///
/// # Panics
/// Panics like [`check_allocator`].
pub(crate) fn check_running_allocator(
    mut make: impl FnMut(SelfState) -> Box<dyn RunningAllocator>,
) {
    for seed in 0..TEAMS {
        let [first, second] = std::array::from_fn(|_| Trial::new(seed, &mut make).run());
        assert!(
            first == second,
            "seed {seed}: G1, the same inputs give the same decisions"
        );
    }
}

/// A robot in a team with the same allocator for all.
struct Trial {
    seed: u64,
    rng: ChaCha8Rng,
    me: SelfState,
    /// Four copies of the robot's allocator. The first is rolled back now and then. The others must give the same
    /// outcomes: without rollbacks, with each broadcast twice, and with junk from unknown robots.
    instances: [Box<dyn RunningAllocator>; 4],
    /// A teammate's allocator, which supplies messages.
    other: Box<dyn RunningAllocator>,
    sent: Vec<AllocationMessage>,
    states: Vec<BehaviorState>,
    seq: u64,
}

impl Trial {
    fn new(seed: u64, make: &mut impl FnMut(SelfState) -> Box<dyn RunningAllocator>) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let tasks = rng.random_range(1..6_u32);
        let behaviors = (0..tasks).map(|task| OwnBehavior {
            id: BehaviorId(task),
            task: TaskId(task),
            max_robots: rng.random_range(1..3),
            priority: rng.random_range(-1..2),
        });
        let behaviors: Vec<OwnBehavior> = behaviors.collect();
        let team = rng.random_range(2..5);
        let brief = |behavior: &OwnBehavior| TaskBrief {
            max_robots: behavior.max_robots,
            priority: behavior.priority,
            unit_s: 2.0,
            robots: (0..team as u32).map(RobotId).collect(),
            coalition: None,
        };
        let me = SelfState {
            robot: RobotId(1),
            incarnation: 1,
            briefs: behaviors.iter().map(brief).collect(),
            behaviors,
            team,
            tasks: tasks as usize,
            step_s: 0.05,
            heartbeat_period: SimTime(1000),
            ceased_after: SimTime(5000),
            assigned: (0..tasks).map(TaskId).collect(),
        };
        let other = SelfState {
            robot: RobotId(0),
            ..me.clone()
        };
        Self {
            seed,
            rng,
            instances: std::array::from_fn(|_| make(me.clone())),
            other: make(other),
            sent: Vec::new(),
            states: vec![BehaviorState::Hibernating; me.behaviors.len()],
            seq: 0,
            me,
        }
    }

    fn run(mut self) -> Vec<StepOutcome> {
        let mut choices = Vec::new();
        let mut ground_truth = Vec::new();
        let mut trace = Vec::new();
        for tick in 0..STEPS {
            let now = SimTime(50 * tick);
            self.situation(now, &mut choices);
            let received = self.broadcasts(now);
            let progressed: Vec<TaskId> = self.some_tasks(0.02);
            let position = self.rng.random_bool(0.9).then_some(Vec2::ONE);
            let is_laden = self.rng.random_bool(0.1);
            let applicable: Vec<bool> = choices.iter().map(|choice| choice.applicable).collect();
            let (seed, step_s) = (self.seed, self.me.step_s);
            // The cost does not depend on the other tasks.
            let seconds = |_: &[TaskId], task: TaskId| {
                choices.iter().find(|choice| choice.task == task)?.cost_s
            };
            let input = |received, robot| Input {
                now,
                step_s,
                position,
                heading_rad: position.map(|_| 0.0),
                energy_j: None,
                is_laden,
                applicable: &applicable,
                choices: &choices,
                progressed: &progressed,
                received,
                seconds: &seconds,
                place: &|_| None,
                travel_s: &|_| None,
                ground_truth: &ground_truth,
                draws: RandomDraws::new(seed, robot, tick),
            };
            let twice: Vec<Arc<Broadcast>> = received
                .iter()
                .flat_map(|broadcast| [broadcast.clone(), broadcast.clone()])
                .collect();
            let mut with_junk = received.clone();
            with_junk.extend(strangers(&received, self.me.team));

            let lists = [&received, &received, &twice, &with_junk];
            let mut outcomes: [StepOutcome; 4] = Default::default();
            let at = format!("seed {}, step {tick}", self.seed);
            for ((instance, outcome), list) in
                self.instances.iter_mut().zip(&mut outcomes).zip(lists)
            {
                let step = || instance.step(&input(list, self.me.robot), outcome);
                if let Err(panic) = panics::catch(step) {
                    panic!("{at}: G3, no message makes it panic: {panic}");
                }
            }
            assert_eq!(
                outcomes[0], outcomes[1],
                "{at}: G1, clones give equal outcomes, and a step that does not count leaves no trace"
            );
            assert_eq!(
                outcomes[0], outcomes[2],
                "{at}: G1, a second copy changes nothing"
            );
            assert_eq!(
                outcomes[0], outcomes[3],
                "{at}: G1, broadcasts of robots outside the team change nothing"
            );

            let mut other = StepOutcome::default();
            self.other.step(&input(&[], RobotId(0)), &mut other);
            self.sent.extend(other.say);
            let rows = [
                (RobotId(0), &other.rows),
                (self.me.robot, &outcomes[0].rows),
            ];
            let offers = self.offers(&rows);
            let surplus = self.sent.len().saturating_sub(8);
            self.sent.drain(..surplus);

            let [outcome, ..] = &outcomes;
            self.check(&at, outcome, &choices);
            trace.push(outcome.clone());
            if self.rng.random_bool(0.1) {
                // A step that does not count: the copy from before it is restored.
                let kept = self.instances[0].checkpoint();
                let mut discarded = StepOutcome::default();
                let later = Input {
                    now: SimTime(now.0 + 1),
                    ..input(&[], self.me.robot)
                };
                self.instances[0].step(&later, &mut discarded);
                self.instances[0] = kept;
            }
            ground_truth = offers;
        }
        trace
    }

    /// Sets the choices of the robot. They change seldom.
    fn situation(&mut self, now: SimTime, choices: &mut Vec<Choice>) {
        if choices.is_empty() || self.rng.random_bool(0.05) {
            choices.clear();
            for behavior in &self.me.behaviors {
                choices.push(Choice {
                    behavior: behavior.id,
                    task: behavior.task,
                    round: SimTime(now.0 / 8000 * 8000),
                    applicable: self.rng.random_bool(0.7),
                    cost_s: self
                        .rng
                        .random_bool(0.9)
                        .then(|| self.rng.random_range(0.0..200.0)),
                    opens_in_s: 0.0,
                    reward: f64::from(self.rng.random_range(1..4)),
                    priority: behavior.priority,
                    max_robots: behavior.max_robots,
                });
            }
        }
    }

    fn some_tasks(&mut self, share: f64) -> Vec<TaskId> {
        let all = 0..self.me.tasks as u32;
        all.filter(|_| self.rng.random_bool(share))
            .map(TaskId)
            .collect()
    }

    /// Returns most of the offers that the world derives from the rows of a step.
    fn offers(&mut self, rows: &[(RobotId, &Vec<AllocationRow>)]) -> Vec<TaskOffer> {
        let rows = rows.iter();
        let rows = rows.flat_map(|&(robot, rows)| rows.iter().map(move |row| (robot, row)));
        let offers = rows.filter(|(_, row)| row.utility > 0.0);
        offers
            .filter(|_| self.rng.random_bool(0.95))
            .map(|(robot, row)| TaskOffer {
                robot,
                behavior: row.behavior,
                task: row.task,
                utility: row.utility,
            })
            .collect()
    }

    /// Returns random broadcasts of teammates: valid ones, invalid ones, and messages of the allocator.
    fn broadcasts(&mut self, now: SimTime) -> Vec<Arc<Broadcast>> {
        let count = if self.rng.random_bool(0.2) {
            self.rng.random_range(1..4)
        } else {
            0
        };
        let mut broadcasts: Vec<Arc<Broadcast>> =
            (0..count).map(|_| Arc::new(self.broadcast(now))).collect();
        broadcasts
            .sort_by_key(|broadcast| (broadcast.sender, broadcast.incarnation, broadcast.seq));
        broadcasts
    }

    fn broadcast(&mut self, now: SimTime) -> Broadcast {
        self.seq += 1;
        let wild = self.rng.random_bool(0.1);
        let sender = match self.rng.random_range(0..self.me.team as u32) {
            1 => RobotId(0),
            other => RobotId(other),
        };
        let body = if self.rng.random_bool(0.5) {
            self.heartbeat(now, wild)
        } else {
            BroadcastContent::Allocation(self.allocation(wild))
        };
        Broadcast {
            sender,
            incarnation: self.rng.random_range(1..3),
            tick: now.0 / 50,
            index: 0,
            seq: if wild { u64::MAX - self.seq } else { self.seq },
            sent: if wild { SimTime(u64::MAX) } else { now },
            body,
        }
    }

    fn heartbeat(&mut self, now: SimTime, wild: bool) -> BroadcastContent {
        let states = [
            TaskState::Executing,
            TaskState::Idle,
            TaskState::Released,
            TaskState::Waiting,
        ];
        let state = states[self.rng.random_range(0..states.len())];
        let tasks = self.me.tasks as u32 + if wild { 40 } else { 0 };
        let task = (state != TaskState::Idle).then(|| TaskId(self.rng.random_range(0..tasks)));
        let back_ms = self.rng.random_range(0..9000);
        BroadcastContent::Heartbeat(Heartbeat {
            state,
            since: if wild {
                SimTime(u64::MAX)
            } else {
                now.since(SimTime(back_ms))
            },
            set: task.map(|task| BehaviorId(task.0)),
            task,
            progress: self.rng.random_range(0..9),
            position: Some(Vec2::splat(if wild { f32::NAN } else { 2.0 })),
            carrying: false,
            shared_knowledge: SharedKnowledge::default(),
        })
    }

    /// Returns a message of the allocator. With `wild`, its bytes are random.
    fn allocation(&mut self, wild: bool) -> AllocationMessage {
        let length = self.rng.random_range(0..40);
        let junk = (0..length).map(|_| self.rng.random()).collect();
        if self.sent.is_empty() {
            return AllocationMessage::Open(OpenMessage {
                schema: "somebody/else".to_owned(),
                bytes: junk,
            });
        }
        let place = self.rng.random_range(0..self.sent.len());
        match self.sent[place].clone() {
            AllocationMessage::Open(sent) if wild => AllocationMessage::Open(OpenMessage {
                bytes: junk,
                ..sent
            }),
            sent if wild => self.garbled(sent),
            sent => sent,
        }
    }

    /// Returns the message with some bytes changed, if they still decode: other tasks and times, numbers that are not
    /// finite.
    fn garbled(&mut self, message: AllocationMessage) -> AllocationMessage {
        let mut bytes = encode(&message).unwrap_or_default();
        let from = self.rng.random_range(0..bytes.len().max(1));
        let length = self.rng.random_range(1..9);
        let ones = self.rng.random_bool(0.5);
        for byte in bytes.iter_mut().skip(from).take(length) {
            *byte = if ones { 0xff } else { self.rng.random() };
        }
        decode(&bytes).unwrap_or(message)
    }

    fn check(&mut self, at: &str, outcome: &StepOutcome, choices: &[Choice]) {
        if let Some(active) = outcome.active {
            let can = choices
                .iter()
                .any(|choice| choice.behavior == active && choice.applicable);
            assert!(can, "{at}: G2, the active behavior is applicable");
        }
        for change in &outcome.changes {
            let state = &mut self.states[change.set.index()];
            assert_eq!(*state, change.from, "{at}: states follow each other");
            *state = change.to;
        }
        for (behavior, state) in self.me.behaviors.iter().zip(&self.states) {
            let is_active = outcome.active == Some(behavior.id);
            assert_eq!(
                is_active,
                *state == BehaviorState::Active,
                "{at}: exactly the active behavior is in the state active"
            );
        }
        let most = 1 + self.me.tasks;
        assert!(
            outcome.say.len() <= most,
            "{at}: G4, at most {most} messages"
        );
        for message in &outcome.say {
            let length = encoded_len(message).unwrap_or(usize::MAX);
            assert!(
                length <= OPEN_MESSAGE_MAX,
                "{at}: G4, a message has {length} bytes"
            );
        }
        for row in &outcome.rows {
            let mut behaviors = self.me.behaviors.iter();
            assert!(
                behaviors.any(|own| (own.id, own.task) == (row.behavior, row.task)),
                "{at}: rows are about own behaviors and their tasks"
            );
            assert!(
                row.utility.is_finite(),
                "{at}: a utility is {}",
                row.utility
            );
        }
    }
}

fn strangers(received: &[Arc<Broadcast>], team: usize) -> impl Iterator<Item = Arc<Broadcast>> {
    received.iter().map(move |broadcast| {
        let mut stranger = broadcast.as_ref().clone();
        stranger.sender = RobotId(team as u32 + 7);
        Arc::new(stranger)
    })
}

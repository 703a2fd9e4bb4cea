//! Tests of the complete engine, with a small team of engines in one process.

mod bounds;
mod equations;
mod heartbeats;
mod history;
mod properties;
mod steps;
mod takeover;
mod teammates;
mod waiting;

use scenario::testkit::default_scenario;
use std::sync::Arc;

use proto::team::{Broadcast, BroadcastContent, TaskState};
use proto::telemetry::{BehaviorState, Reason, StateChange};
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{
    BehaviorParams, Catalog, Preset, Robot, Scenario, Setup, StepOrder, Switches, TaskSection,
};

use super::{Engine, Parameters};
use crate::allocator::{Announcement, Input, RunningAllocator, StepOutcome};
use crate::fixtures;

/// The index of each set of the default mission for a robot without a side sensor. The tasks have the same numbers.
const FIND: usize = 0;
const TOP: usize = 1;
const BOTTOM: usize = 2;
const REPORT: usize = 3;
const ALL: [bool; 4] = [true; 4];
/// Sensory feedback for which only move(top) is applicable.
const ONLY_TOP: [bool; 4] = [false, true, false, false];

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);
const GREEN: RobotId = RobotId(2);

/// Returns the catalog id of the set at `index`.
fn set(index: usize) -> BehaviorId {
    BehaviorId(index as u32 + 1)
}

fn task(index: usize) -> TaskId {
    TaskId(index as u32)
}

fn ms(ms: u64) -> SimTime {
    SimTime(ms)
}

/// Creates a setup of `count` robots with the values of docs/ALLIANCE.md §4: θ=100, δ_fast=5, δ_slow=1, φ=30, τ=5.
/// Heartbeats are sent every second; ψ and λ are too long to matter.
fn setup(preset: Preset, count: usize, step_ms: u64) -> Setup {
    let names = ["blue", "gold", "green", "red"];
    let scenario = Scenario {
        step_ms,
        robots: names[..count]
            .iter()
            .map(|name| Robot {
                name: (*name).to_owned(),
                ..Robot::default()
            })
            .collect(),
        ..default_scenario()
    };
    let mut setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    setup.alliance.threshold = 100.0;
    setup.alliance.switches = preset.switches();
    setup.step_order = preset.step_order();
    every_set(&mut setup, |set| {
        set.broadcast_rate_hz = 1.0;
        set.ceased_after_s = 5.0;
        set.fast_impatience = 5.0;
        toward_all(set, 1.0, 30.0);
        set.before_yielding_s = 10_000.0;
        set.before_giving_up_s = 10_000.0;
    });
    setup
}

fn engine(robot: RobotId, setup: &Setup) -> Engine {
    Engine::new(robot, setup, &Parameters::from_setup(setup))
}

/// Changes the section of one task in the scenario.
fn with_task(mut setup: Setup, name: &str, edit: impl FnOnce(&mut TaskSection)) -> Setup {
    edit(setup.scenario.tasks.entry(name.to_owned()).or_default());
    setup.catalog = Arc::new(Catalog::new(&setup.scenario));
    setup
}

fn every_set(setup: &mut Setup, edit: impl FnMut(&mut BehaviorParams)) {
    let robots = Arc::make_mut(&mut setup.alliance.robots).values_mut();
    robots
        .flat_map(|robot| robot.sets.values_mut())
        .for_each(edit);
}

/// Sets δ_slow and φ toward all teammates.
fn toward_all(set: &mut BehaviorParams, slow: f64, phi_s: f64) {
    let rates = Arc::make_mut(&mut set.slow_impatience).values_mut();
    rates.for_each(|rate| *rate = slow);
    let times = Arc::make_mut(&mut set.willing_to_affect_s).values_mut();
    times.for_each(|time_s| *time_s = phi_s);
}

/// Edits all sets of one robot.
fn behaviors_of(setup: &mut Setup, robot: &str, edit: impl FnMut(&mut BehaviorParams)) {
    let robot = Arc::make_mut(&mut setup.alliance.robots)
        .get_mut(robot)
        .unwrap();
    robot.sets.values_mut().for_each(edit);
}

/// Creates a teammate's heartbeat about the set at `index`.
fn heartbeat(
    sender: RobotId,
    seq: u64,
    sent: SimTime,
    state: TaskState,
    since: SimTime,
    index: usize,
) -> Broadcast {
    let announcement = Announcement {
        state,
        since,
        behavior: (state != TaskState::Idle).then(|| set(index)),
        task: (state != TaskState::Idle).then(|| task(index)),
        progress: 0,
    };
    broadcast(sender, seq, sent, &announcement)
}

fn broadcast(sender: RobotId, seq: u64, sent: SimTime, announcement: &Announcement) -> Broadcast {
    fixtures::broadcast(sender, (1, seq), sent, fixtures::heartbeat(announcement))
}

/// An engine with scripted teammates.
struct Solo {
    engine: Engine,
    step_ms: u64,
    now: SimTime,
    seq: u64,
}

impl Solo {
    fn new(robot: RobotId, setup: &Setup) -> Self {
        Self {
            engine: engine(robot, setup),
            step_ms: setup.alliance.step_ms,
            now: SimTime::ZERO,
            seq: 0,
        }
    }

    /// Makes one step at `now` and advances the time.
    fn step(&mut self, applicable: [bool; 4], messages: &[Broadcast]) -> StepOutcome {
        let output = step_of(&mut self.engine, self.now, messages, &applicable, &[]);
        self.now = self.now + ms(self.step_ms);
        output
    }

    /// Returns the next message of a teammate about move(top), sent now.
    fn message(&mut self, sender: RobotId, state: TaskState, since: SimTime) -> Broadcast {
        self.seq += 1;
        heartbeat(sender, self.seq, self.now, state, since, TOP)
    }

    /// Makes steps without messages until `end`, exclusive.
    fn quiet_until(&mut self, end: SimTime, applicable: [bool; 4]) {
        while self.now < end {
            self.step(applicable, &[]);
        }
    }
}

fn step_of(
    engine: &mut Engine,
    now: SimTime,
    received: &[Broadcast],
    applicable: &[bool],
    progressed: &[TaskId],
) -> StepOutcome {
    let received: Vec<_> = received.iter().cloned().map(Arc::new).collect();
    let mut output = StepOutcome::default();
    let input = Input {
        received: &received,
        applicable,
        progressed,
        ..fixtures::input(now, engine.config.robot)
    };
    RunningAllocator::step(engine, &input, &mut output);
    output
}

/// Engines that receive each other's broadcasts.
struct Team {
    engines: Vec<Engine>,
    step_ms: u64,
    order: StepOrder,
    now: SimTime,
    seq: u64,
    /// The broadcasts that each robot receives in its next step.
    inboxes: Vec<Vec<Broadcast>>,
    /// Returns whether a broadcast from the first to the second robot is delivered.
    link: Box<dyn Fn(RobotId, RobotId) -> bool>,
    /// All state changes so far.
    changes: Vec<(SimTime, RobotId, StateChange)>,
}

impl Team {
    fn new(setup: &Setup) -> Self {
        let count = setup.scenario.robots.len();
        Self {
            engines: (0..count as u32)
                .map(|rank| engine(RobotId(rank), setup))
                .collect(),
            step_ms: setup.alliance.step_ms,
            order: setup.step_order,
            now: SimTime::ZERO,
            seq: 0,
            inboxes: vec![Vec::new(); count],
            link: Box::new(|_, _| true),
            changes: Vec::new(),
        }
    }

    /// Makes one step of all robots; `applicable` is indexed by rank.
    fn step(&mut self, applicable: &[[bool; 4]]) -> Vec<StepOutcome> {
        self.step_with(applicable, &[])
    }

    /// Makes one step with progress on some tasks.
    fn step_with(
        &mut self,
        applicable: &[[bool; 4]],
        progressed: &[(RobotId, TaskId)],
    ) -> Vec<StepOutcome> {
        let mut later = vec![Vec::new(); self.engines.len()];
        let mut outputs = Vec::new();
        for (rank, applicable) in applicable.iter().enumerate() {
            let robot = RobotId(rank as u32);
            let mut received = std::mem::take(&mut self.inboxes[rank]);
            received.sort_by_key(|broadcast| (broadcast.sender, broadcast.seq));
            let tasks: Vec<TaskId> = progressed
                .iter()
                .filter(|(actor, _)| *actor == robot)
                .map(|&(_, task)| task)
                .collect();
            let engine = &mut self.engines[rank];
            let output = step_of(engine, self.now, &received, applicable, &tasks);
            for announcement in &output.announcements {
                self.seq += 1;
                let message = broadcast(robot, self.seq, self.now, announcement);
                for receiver in (0..self.engines.len()).filter(|&receiver| receiver != rank) {
                    if (self.link)(robot, RobotId(receiver as u32)) {
                        let same_step = self.order == StepOrder::InOrder && receiver > rank;
                        let inboxes = if same_step {
                            &mut self.inboxes
                        } else {
                            &mut later
                        };
                        inboxes[receiver].push(message.clone());
                    }
                }
            }
            let changes = output.changes.iter();
            self.changes
                .extend(changes.map(|&change| (self.now, robot, change)));
            outputs.push(output);
        }
        for (inbox, messages) in self.inboxes.iter_mut().zip(later) {
            inbox.extend(messages);
        }
        self.now = self.now + ms(self.step_ms);
        outputs
    }

    fn run_until(&mut self, end: SimTime, applicable: &[[bool; 4]]) {
        while self.now < end {
            self.step(applicable);
        }
    }

    /// Returns the changes of one robot's set as (ms, state, reason).
    fn changes_of(&self, robot: RobotId, index: usize) -> Vec<(u64, BehaviorState, Reason)> {
        self.changes
            .iter()
            .filter(|(_, changed, change)| *changed == robot && change.set == set(index))
            .map(|(at, _, change)| (at.0, change.to, change.reason))
            .collect()
    }
}

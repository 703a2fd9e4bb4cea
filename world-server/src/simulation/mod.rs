//! One run, tick by tick: world, barrier and faults as a plain function of reports and inputs.
//!
//! Per tick, the caller runs [`Simulation::begin`] and performs each [`Simulation::next_act`]. It sends each
//! [`Simulation::next_recipient`] robot its [`Simulation::message`] and passes every answer to [`Simulation::report`]. After
//! [`Simulation::is_complete`] it calls [`Simulation::finish`] and [`Simulation::record`].
//!
//! - `tick`: the steps of a tick, in this order. `ended_tick`: its result, for the recorder. `end`: the end of the run.
//! - `presence`: robots that take part. `robot_tick`: the part of a tick that concerns one robot. `reports`: their reports. `figures`: progress of the mission.
//! - `commands`: operators' orders. `triggers`: events that faults wait for.
//! - `effects`: effects of faults. `process_actions`: process actions of faults.
//! - `external_bodies`: bodies that move in another world.
//! - `ground_truth`: ground truth for allocators that request it.
//! - `view`: views for observers. `levels`, `corners`: their curves.

mod commands;
mod corners;
mod effects;
mod end;
mod ended_tick;
mod external_bodies;
mod figures;
mod ground_truth;
mod levels;
mod presence;
mod process_actions;
mod reports;
mod robot_tick;
#[cfg(test)]
mod tests;
mod tick;
mod triggers;
mod view;

use std::collections::{BTreeMap, VecDeque};

use prefetch::{Layer, prefetch};
use proto::team::Broadcast;
use proto::telemetry::{AllocationRow, Motivation};
use proto::tick::{Outcome, TickMessage};
use run_log::{BodyInput, Input};
use scenario::ids::{BehaviorId, RobotId, Tick};
use scenario::time::SimTime;
use scenario::{Catalog, Setup, StepOrder};

use crate::barrier::Barrier;
use crate::faults::actuators::Actuators;
use crate::faults::campaign;
use crate::faults::links::LinkFaults;
use crate::faults::schedule::{FaultIndex, Schedule};
use crate::faults::sensors::Sensors;
use crate::interruption::{Interruption, InterruptionHandler};
use crate::mission::WorldKind;
use crate::world::World;
use run_log::recorder::{Answers, Event, FaultEvent, FaultHits};

use commands::QueuedCommand;
use ended_tick::EndedTick;
pub use figures::Counts;
use ground_truth::GroundTruth;
use process_actions::{Acts, PendingAction};
pub use robot_tick::{TeamPart, TickContext};
use tick::TickPhase;
use view::ViewHistory;

pub use view::SENSING_TEAM_MAX;

/// A clone continues with the same state.
#[derive(Clone)]
pub struct Simulation {
    /// Boxed, because a tick needs little of it, and batches request the memory of the other fields.
    setup: Box<Setup>,
    world: World,
    barrier: Barrier,
    /// The last message to each robot, by rank.
    messages: Vec<TickMessage>,
    /// The behavior set that each robot last reported as active, by rank.
    active: Vec<Option<BehaviorId>>,
    /// The active behavior set in each robot's report of the previous tick, by rank; `None` without a report or after death. It
    /// is constant within a tick.
    reported: Vec<Option<Option<BehaviorId>>>,
    answers: Answers,
    /// True for each robot with an external controller, by rank; empty if there are none.
    external: Vec<bool>,
    /// The broadcasts of external controllers since the current tick began.
    broadcasts: Vec<Broadcast>,
    /// The external controllers that have sent an undecodable broadcast since the current tick began, with the reason.
    undecodable: Vec<(RobotId, String)>,
    /// The size of the recorded answers of each external controller, by rank, bytes.
    answer_bytes: Vec<u64>,
    /// The messages of allocators since the current tick began, by the sender's rank; `None` if they are not recorded.
    allocation_messages: Option<Vec<Vec<Broadcast>>>,
    schedule: Schedule,
    links: LinkFaults,
    sensors: Sensors,
    actuators: Actuators,
    ground_truth: GroundTruth,
    interruptions: BTreeMap<FaultIndex, Interruption>,
    handlers: Vec<Box<dyn InterruptionHandler>>,
    /// True if a launcher starts and signals processes.
    has_launcher: bool,
    phase: TickPhase,
    /// The number of ordered operations in the current tick: commands, transitions of faults, process actions. Outside inputs
    /// record it.
    order_index: u32,
    commands: VecDeque<QueuedCommand>,
    acts: Acts,
    /// The kills of the current tick, executed after its last report.
    pending_kills: Vec<PendingAction>,
    /// The poses of external bodies for the current tick, until they take effect.
    placements: Vec<BodyInput>,
    inputs: Vec<Input>,
    failures: Vec<Input>,
    /// The events of the current tick from neither reports nor the world.
    events: Vec<Event>,
    /// The effects of faults in the current tick, each fault once.
    hits: Vec<FaultHits>,
    memories: ViewHistory,
    unscripted: bool,
    /// The number of times that the team continued without a silent agent.
    stalls: u64,
    /// The number of messages that receivers missed.
    messages_dropped: u64,
    outcome: Option<Outcome>,
    /// The last ended tick, kept to reuse its memory.
    ended: EndedTick,
}

impl Simulation {
    /// Creates a run at tick 0 without any agents. Without a launcher, faults of processes are rejected.
    #[must_use]
    pub fn new(setup: Setup, mission: WorldKind, has_launcher: bool) -> Self {
        let world = World::new(&setup, mission);
        let robots = setup.scenario.robots.len();
        let barrier = Barrier::new(&setup.scenario.robots, setup.step_order);
        let mut simulation = Self {
            world,
            barrier,
            messages: vec![TickMessage::default(); robots],
            active: vec![None; robots],
            reported: vec![None; robots],
            answers: Answers::new(robots),
            external: if setup.scenario.external_controllers().is_empty() {
                Vec::new()
            } else {
                let robots = setup.scenario.robots.iter();
                robots.map(|robot| robot.controller.is_some()).collect()
            },
            broadcasts: Vec::new(),
            undecodable: Vec::new(),
            answer_bytes: vec![0; robots],
            allocation_messages: None,
            schedule: Schedule::default(),
            links: LinkFaults::new(&setup),
            sensors: Sensors::new(&setup),
            actuators: Actuators::new(&setup),
            ground_truth: GroundTruth::default(),
            interruptions: BTreeMap::new(),
            handlers: Vec::new(),
            has_launcher,
            phase: TickPhase::default(),
            order_index: 0,
            commands: VecDeque::new(),
            acts: Acts::default(),
            pending_kills: Vec::new(),
            placements: Vec::new(),
            inputs: Vec::new(),
            failures: Vec::new(),
            events: Vec::new(),
            hits: Vec::new(),
            memories: ViewHistory::new(robots),
            unscripted: false,
            stalls: 0,
            messages_dropped: 0,
            outcome: None,
            ended: EndedTick::default(),
            setup: Box::new(setup),
        };
        simulation.arm_scenario();
        simulation.schedule.end_tick();
        simulation.outcome = simulation.decide_outcome();
        simulation
    }

    /// Requests the memory of a layer, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        match layer {
            Layer::Fields => prefetch(self),
            Layer::Lists => {
                // The parts of the setup that each tick needs.
                prefetch(&self.setup.scenario.robots);
                prefetch(&self.setup.scenario.limit_s);
                prefetch(&self.setup.alliance.threshold);
                prefetch(&self.setup.catalog);
                prefetch(&self.setup.roster);
                prefetch(&*self.messages);
                prefetch(&*self.active);
                prefetch(&*self.reported);
                prefetch(&*self.answer_bytes);
                self.answers.prefetch(layer);
                self.barrier.prefetch();
                self.memories.prefetch();
                self.ended.prefetch();
                self.world.prefetch(layer);
            }
            Layer::Elements => {
                for message in &self.messages {
                    message.readings.mission.prefetch();
                }
                self.answers.prefetch(layer);
                self.world.prefetch(layer);
            }
            Layer::Contents => self.world.prefetch(layer),
        }
    }

    fn arm_scenario(&mut self) {
        let Setup { seed, scenario, .. } = &*self.setup;
        let mut orders = scenario.faults.timeline.clone();
        if let Some(random) = &scenario.faults.random {
            orders.extend(campaign::expand(random, scenario, *seed));
        }
        for order in orders {
            // Validation ensures distinct ids.
            if let Ok(fault) = self.schedule.arm(order, SimTime::ZERO) {
                self.push_fault_event(FaultEvent::Armed, fault, "");
            }
        }
    }

    /// Adds an experiment's own interruption handler.
    pub fn add_handler(&mut self, handler: Box<dyn InterruptionHandler>) {
        self.handlers.push(handler);
    }

    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    #[must_use]
    pub fn barrier(&self) -> &Barrier {
        &self.barrier
    }

    #[must_use]
    pub fn tick(&self) -> Tick {
        self.barrier.tick()
    }

    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    /// Returns a robot's message of the current tick; before it is due, the previous message.
    #[must_use]
    pub fn message(&self, robot: RobotId) -> &TickMessage {
        &self.messages[robot.index()]
    }

    /// Returns a robot's last reported motivations, in the order of the catalog.
    #[must_use]
    pub fn motivations(&self, robot: RobotId) -> &[Motivation] {
        &self.answers.report(robot).motivations
    }

    /// Returns the rows of a robot's last report for its behavior sets, with their holders. Empty under allocators with
    /// motivations.
    #[must_use]
    pub fn allocation(&self, robot: RobotId) -> &[AllocationRow] {
        &self.answers.report(robot).allocation
    }

    /// Returns the behavior set that a robot last reported as active.
    #[must_use]
    pub fn active(&self, robot: RobotId) -> Option<BehaviorId> {
        self.active[robot.index()]
    }

    /// Returns the levels of a robot's latest report: motivations, or else utilities. They contain the applicable and the
    /// active behavior sets under any allocator.
    #[must_use]
    pub fn levels(&self, robot: RobotId) -> Vec<Motivation> {
        let spec = &self.setup.scenario.robots[robot.index()];
        let (_, levels) = levels::levels(self.answers.report(robot), &self.setup, spec);
        levels.into_owned()
    }

    #[must_use]
    pub fn catalog(&self) -> &Catalog {
        &self.setup.catalog
    }

    fn steps_in_order(&self) -> bool {
        self.setup.step_order == StepOrder::InOrder
    }

    fn name(&self, robot: RobotId) -> &str {
        self.setup.roster.name(robot)
    }

    #[must_use]
    pub fn robot_named(&self, name: &str) -> Option<RobotId> {
        self.setup.roster.find(name)
    }
}

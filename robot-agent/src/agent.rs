//! The controller of one robot: receive, perceive, select a behavior, act, broadcast. A pure function of its inputs.

use std::collections::BTreeMap;
use std::sync::Arc;

use prefetch::{Layer, prefetch};
use proto::codec::encoded_len;
use proto::mission::SharedKnowledge;
use proto::secret::SEAL_BYTES;
use proto::team::{Broadcast, BroadcastContent};
use proto::tick::{Report, TickMessage};
use scenario::ids::{Incarnation, RobotId, TaskId, Tick};
use scenario::time::SimTime;
use scenario::{BehaviorParams, LearnedTimesByTask, Setup};

use crate::allocator::{
    Announcement, Choice, ConfigError, ConfiguredAllocator, Input, OwnBehavior, RandomDraws,
    RunningAllocator, SelfState, StepOutcome, TaskBrief, assignment,
};
use crate::mission::{
    ControllerConstructor, ControllerInput, MissionController, Perception, StepOutput,
};
use crate::registry::AgentRegistry;
use proto::link::{IncomingMessages, StepMessages};

#[derive(Clone, Debug)]
pub struct Agent {
    robot: RobotId,
    incarnation: Incarnation,
    /// Contains the messages in flight. They are part of the state that a rollback restores.
    links: IncomingMessages,
    allocator: Box<dyn RunningAllocator>,
    /// Cached result of [`RunningAllocator::weighs_costs`].
    weighs_costs: bool,
    /// Cached result of [`RunningAllocator::uses_radio`].
    uses_radio: bool,
    mission: Box<dyn MissionController>,
    behaviors: Arc<[OwnBehavior]>,
    /// The numbers of behavior sets and tasks of the run.
    catalog_size: (usize, usize),
    seed: u64,
    step_s: f64,
    next_seq: u64,
}

/// An agent at the start of a tick. Another process continues it.
#[derive(Clone, Debug)]
pub struct AgentSnapshot {
    pub agent: Agent,
    /// The tick that the agent steps first.
    pub first_tick: Tick,
}

/// Data that all robots of a run share. It exists once per process.
#[derive(Clone, Debug)]
pub struct TeamConfig {
    controller: ControllerConstructor,
    allocators: Vec<ConfiguredAllocator>,
    assignment: Vec<Arc<[TaskId]>>,
    tasks: Arc<[TaskBrief]>,
}

impl TeamConfig {
    /// Creates the shared data of a run. The registry supplies the mission and the allocators.
    ///
    /// # Errors
    /// Fails if the registry lacks the mission or an allocator of the run, or if a parameter is invalid.
    pub fn new(setup: &Setup, registry: &AgentRegistry) -> Result<Self, ConfigError> {
        let scenario = &setup.scenario;
        let mut prepared: BTreeMap<(Option<&str>, &str), ConfiguredAllocator> = BTreeMap::new();
        let mut allocators = Vec::with_capacity(scenario.robots.len());
        let mut uses_assignment = false;
        for robot in &scenario.robots {
            // A controller that is not in the registry belongs to another program and is not started here.
            let controller = robot
                .controller
                .as_deref()
                .filter(|name| registry.has_controller(name));
            let allocator_name = scenario.stated_allocator(robot);
            let allocator_of_robot = match (prepared.get(&(controller, allocator_name)), controller)
            {
                (Some(known), _) => known.clone(),
                (None, Some(controller)) => registry.prepare_controller(controller, setup)?,
                (None, None) => registry.prepare(allocator_name, setup)?,
            };
            allocators.push(allocator_of_robot.clone());
            uses_assignment |= controller.is_none() && registry.uses_assignment(allocator_name);
            prepared.insert((controller, allocator_name), allocator_of_robot);
        }
        let mission = registry.controller_kind(setup)?;
        // The work of an assignment grows with the cube of the team size, so it is computed only for allocators that
        // use it.
        let assignment = if uses_assignment {
            assignment::assign(
                &(mission.planned_cost_ms)(setup),
                &setup.catalog.mission.coalitions(scenario),
            )
        } else {
            Vec::new()
        };
        Ok(Self {
            controller: (mission.constructor)(setup),
            allocators,
            assignment,
            tasks: TaskBrief::all(setup),
        })
    }

    /// Returns a copy in which the allocators of these robots come from another registry.
    ///
    /// # Errors
    /// Fails if the registry lacks an allocator, or if a parameter is invalid.
    pub fn with_allocators_of(
        &self,
        registry: &AgentRegistry,
        robots: &[RobotId],
        setup: &Setup,
    ) -> Result<Self, ConfigError> {
        let mut team = self.clone();
        for robot in robots {
            let spec = &setup.scenario.robots[robot.index()];
            let allocator = registry.prepare(setup.scenario.stated_allocator(spec), setup)?;
            team.allocators[robot.index()] = allocator;
        }
        Ok(team)
    }

    fn me(&self, robot: RobotId, incarnation: Incarnation, setup: &Setup) -> SelfState {
        let spec = &setup.scenario.robots[robot.index()];
        let values = setup.alliance.robots.get(&spec.name);
        let longest = |seconds: fn(&BehaviorParams) -> f64| {
            let all = values.into_iter().flat_map(|robot| robot.sets.values());
            SimTime::from_secs_f64(all.map(seconds).fold(0.0, f64::max))
        };
        SelfState {
            robot,
            incarnation,
            team: setup.scenario.robots.len(),
            tasks: setup.catalog.tasks.len(),
            briefs: Arc::clone(&self.tasks),
            behaviors: OwnBehavior::of_robot(robot, setup),
            step_s: SimTime(setup.scenario.step_ms).as_secs_f64(),
            heartbeat_period: longest(|values| 1.0 / values.broadcast_rate_hz),
            ceased_after: longest(|values| values.ceased_after_s),
            assigned: assignment::tasks_of(&self.assignment, robot),
        }
    }
}

/// Input, output and scratch buffers of a step. Reuse one workspace for all agents, so that a step does not allocate.
#[derive(Debug, Default)]
pub struct Workspace {
    /// Input: one entry per broadcast of the manifest, in its order. `None` marks a broadcast that has not arrived.
    /// The step empties the list.
    pub arrived: Vec<Option<Arc<Broadcast>>>,
    pub report: Report,
    /// Output: the broadcasts for the team. They are published before the report.
    pub broadcasts: Vec<Broadcast>,
    /// Used broadcasts, whose buffers the step reuses.
    pub used_broadcasts: Vec<Broadcast>,
    messages: StepMessages,
    perception: Perception,
    choices: Vec<Choice>,
    outcome: StepOutcome,
    output: StepOutput,
}

impl Agent {
    #[must_use]
    pub fn new(robot: RobotId, incarnation: Incarnation, setup: &Setup, team: &TeamConfig) -> Self {
        let prepared = &team.allocators[robot.index()];
        let me = team.me(robot, incarnation, setup);
        let behaviors = me.behaviors.as_slice().into();
        let allocator = (prepared.start)(me, setup);
        let controller = prepared.controller.as_ref().unwrap_or(&team.controller);
        Self {
            robot,
            incarnation,
            links: IncomingMessages::new(robot, setup),
            weighs_costs: allocator.weighs_costs(),
            uses_radio: allocator.uses_radio(),
            allocator,
            mission: controller.create(robot, setup),
            behaviors,
            catalog_size: (setup.catalog.sets.len(), setup.catalog.tasks.len()),
            seed: setup.seed,
            step_s: SimTime(setup.scenario.step_ms).as_secs_f64(),
            next_seq: 0,
        }
    }

    /// Requests the memory of a layer below the agent's own fields, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        match layer {
            Layer::Fields | Layer::Lists => {}
            Layer::Elements => {
                prefetch(&*self.allocator);
                prefetch(&*self.behaviors);
                self.mission.prefetch(layer);
            }
            Layer::Contents => {
                self.allocator.prefetch();
                self.mission.prefetch(layer);
            }
        }
    }

    #[must_use]
    pub fn incarnation(&self) -> Incarnation {
        self.incarnation
    }

    /// Returns the learned task durations, by task and robot.
    #[must_use]
    pub fn learned(&self, setup: &Setup) -> LearnedTimesByTask {
        let mut all = LearnedTimesByTask::new();
        for (task, robot, times) in self.allocator.learned() {
            let task = setup.catalog.task_name(task).to_owned();
            let robot = setup.roster.name(robot).to_owned();
            all.entry(task).or_default().insert(robot, times);
        }
        all
    }

    /// Replaces the allocator's parameters by those of `setup`, for which `team` was created, and keeps its state. Returns
    /// whether it did: nothing changes if the state depends on a changed parameter.
    pub fn adopt(&mut self, setup: &Setup, team: &TeamConfig) -> bool {
        let config = team.allocators[self.robot.index()].config.as_deref();
        self.allocator.adopt(setup, config)
    }

    pub fn step(&mut self, tick: &TickMessage, space: &mut Workspace) {
        self.perceive(tick, space);
        self.allocate(tick, space);
        self.act(tick, space);
    }

    /// Runs the first part of a step: reception and perception. A caller with several agents may run each part for
    /// all of them, because the code of a step is larger than a first-level cache.
    pub fn perceive(&mut self, tick: &TickMessage, space: &mut Workspace) {
        if self.uses_radio {
            self.links
                .receive(tick, &mut space.arrived, &mut space.messages);
            // A message about a behavior set or task that does not exist is logged, but has no effect.
            let (sets, tasks) = self.catalog_size;
            let is_known = |message: &Arc<Broadcast>| message.unknown_number(sets, tasks).is_none();
            space.messages.inbox.retain(is_known);
        } else {
            space.arrived.clear();
            space.messages.clear();
        }
        space.perception.clear();
        let input = input_of(tick, &self.behaviors);
        self.mission
            .perceive(&input, &space.messages.inbox, &mut space.perception);
        // A robot without energy cannot execute any behavior.
        if tick.readings.energy_j.is_some_and(|left_j| left_j <= 0.0) {
            space.perception.applicable.fill(false);
        }
    }

    /// Runs the second part of a step: the allocator selects the active behavior.
    pub fn allocate(&mut self, tick: &TickMessage, space: &mut Workspace) {
        space.choices.clear();
        let input = input_of(tick, &self.behaviors);
        let position = self.mission.position(&input);
        if self.weighs_costs {
            let applicable = &space.perception.applicable;
            self.mission.choices(&input, applicable, &mut space.choices);
            let is_number = |choice: &Choice| {
                choice.cost_s.is_none_or(f64::is_finite) && choice.reward.is_finite()
            };
            assert!(
                space.choices.iter().all(is_number),
                "the mission's controller returned an invalid choice: {:?}",
                space.choices.iter().find(|choice| !is_number(choice))
            );
        }
        let input = Input {
            now: tick.now,
            step_s: self.step_s,
            position,
            heading_rad: tick.readings.pose.map(|pose| pose.heading_rad),
            energy_j: tick.readings.energy_j,
            is_laden: self.mission.is_laden(),
            applicable: &space.perception.applicable,
            choices: &space.choices,
            progressed: &space.perception.progressed,
            received: &space.messages.inbox,
            seconds: &|after, task| self.mission.seconds(position, after, task),
            place: &|task| self.mission.place(position, task),
            travel_s: &|task| self.mission.travel_s(position, task),
            ground_truth: &tick.ground_truth,
            draws: RandomDraws::new(self.seed, self.robot, tick.tick),
        };
        self.allocator.step(&input, &mut space.outcome);
        space.messages.inbox.clear();
    }

    /// Runs the third part of a step: actions, broadcasts and the report.
    pub fn act(&mut self, tick: &TickMessage, space: &mut Workspace) {
        space.output.clear();
        let input = input_of(tick, &self.behaviors);
        self.mission
            .act(&input, space.outcome.active, &mut space.output);
        let actuation = &space.output.actuation;
        assert!(
            actuation.speed_m_s.is_finite() && actuation.turn_rad_s.is_finite(),
            "the mission's controller returned an invalid speed: {} m/s and {} rad/s",
            actuation.speed_m_s,
            actuation.turn_rad_s
        );
        space.broadcasts.clear();
        if self.uses_radio {
            self.write_broadcasts(tick, space);
        }
        self.write_report(tick, space);
    }

    fn write_broadcasts(&mut self, tick: &TickMessage, space: &mut Workspace) {
        let Workspace {
            broadcasts,
            used_broadcasts: spent,
            outcome,
            output,
            ..
        } = space;
        for announcement in &outcome.announcements {
            let body = self.heartbeat(tick, announcement, spent);
            broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
        }
        // The check is faster than draining an empty list, which is the usual case.
        if !output.bulletins.is_empty() {
            for bulletin in output.bulletins.drain(..) {
                spent.pop();
                let body = BroadcastContent::Bulletin(bulletin);
                broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
            }
        }
        if !outcome.say.is_empty() {
            for message in outcome.say.drain(..) {
                let body = BroadcastContent::Allocation(message);
                broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
            }
        }
    }

    fn write_report(&self, tick: &TickMessage, space: &mut Workspace) {
        let Workspace {
            report,
            broadcasts,
            messages,
            perception,
            outcome,
            output,
            ..
        } = space;
        report.robot = self.robot;
        report.incarnation = self.incarnation;
        report.tick = tick.tick;
        report.broadcasts = broadcasts.len() as u16;
        report.broadcast_bytes = broadcasts.iter().map(payload_bytes).sum();
        report.active = outcome.active;
        std::mem::swap(&mut report.motivations, &mut outcome.motivations);
        std::mem::swap(&mut report.allocation, &mut outcome.rows);
        std::mem::swap(&mut report.changes, &mut outcome.changes);
        std::mem::swap(&mut report.receptions, &mut messages.receptions);
        report.notes.clear();
        for notes in [&mut perception.notes, &mut output.notes] {
            // The check is faster than appending an empty list, which is the usual case.
            if !notes.is_empty() {
                report.notes.append(notes);
            }
        }
        // Written last: copying fields that were just written would cause a store-forwarding stall.
        report.actuation = output.actuation;
    }

    /// Creates a heartbeat and reuses the buffer of a used one.
    fn heartbeat(
        &self,
        tick: &TickMessage,
        announcement: &Announcement,
        spent: &mut Vec<Broadcast>,
    ) -> BroadcastContent {
        let mut shared_knowledge = SharedKnowledge::default();
        while let Some(broadcast) = spent.pop() {
            // The other kinds have no buffer worth reusing.
            if let BroadcastContent::Heartbeat(heartbeat) = broadcast.body {
                shared_knowledge = heartbeat.shared_knowledge;
                break;
            }
        }
        let input = input_of(tick, &self.behaviors);
        self.mission.shared_knowledge(&input, &mut shared_knowledge);
        let (position, carrying) = (self.mission.position(&input), self.mission.is_laden());
        BroadcastContent::Heartbeat(announcement.heartbeat(position, carrying, shared_knowledge))
    }

    fn broadcast(&mut self, tick: &TickMessage, index: usize, body: BroadcastContent) -> Broadcast {
        let seq = self.next_seq;
        self.next_seq += 1;
        Broadcast {
            sender: self.robot,
            incarnation: self.incarnation,
            tick: tick.tick,
            index: index as u16,
            seq,
            sent: tick.now,
            body,
        }
    }
}

fn input_of<'a>(tick: &'a TickMessage, behaviors: &'a [OwnBehavior]) -> ControllerInput<'a> {
    ControllerInput {
        now: tick.now,
        readings: &tick.readings,
        behaviors,
    }
}

/// Returns the size of a broadcast on the bus, bytes, without the overhead of zenoh and TCP.
#[must_use]
pub fn payload_bytes(broadcast: &Broadcast) -> u32 {
    // A broadcast that is too large to encode is not published either.
    encoded_len(broadcast).map_or(0, |bytes| (bytes + SEAL_BYTES) as u32)
}

/// The number of steps between two checkpoints of an agent. A copy takes about half as long as a step.
const CHECKPOINT_EVERY: usize = 32;

/// An agent whose latest step is tentative until the world confirms that its report counted.
///
/// A rollback is rare. It restores the checkpoint and repeats the steps that counted, so that no step needs a copy.
#[derive(Clone, Debug)]
pub struct TentativeAgent {
    agent: Agent,
    checkpoint: Agent,
    /// The steps since the checkpoint. All but the latest are known to count.
    since: Vec<StepInput>,
}

#[derive(Clone, Debug)]
struct StepInput {
    tick: Box<TickMessage>,
    arrived: Vec<Option<Arc<Broadcast>>>,
}

impl TentativeAgent {
    #[must_use]
    pub fn new(agent: Agent) -> Self {
        Self {
            checkpoint: agent.clone(),
            agent,
            since: Vec::with_capacity(CHECKPOINT_EVERY),
        }
    }

    /// Restores the state before the latest step if that step did not count, then runs [`Agent::step`].
    pub fn step(&mut self, tick: Box<TickMessage>, space: &mut Workspace) {
        let latest = self.since.last().map(|input| input.tick.tick);
        if latest.is_some_and(|latest| tick.last_counted.is_none_or(|counted| counted < latest)) {
            self.since.pop();
            self.agent = self.checkpoint.clone();
            let mut scratch = Workspace::default();
            for input in &self.since {
                scratch.arrived.clone_from(&input.arrived);
                self.agent.step(&input.tick, &mut scratch);
            }
        }
        if self.since.len() == CHECKPOINT_EVERY {
            self.since.clear();
            self.checkpoint = self.agent.clone();
        }
        let arrived = space.arrived.clone();
        self.agent.step(&tick, space);
        self.since.push(StepInput { tick, arrived });
    }
}

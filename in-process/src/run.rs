//! World and agents, stepped tick by tick. This module does not depend on the sink's type, so that it is compiled once, optimized.

use missions::Registry;
use prefetch::{Layer, prefetch};
use proto::process::ProcessAction;
use proto::tick::Outcome;
use robot_agent::agent::{Agent, TeamConfig};
use robot_agent::registry::AgentRegistry;
use run_log::recorder::Record;
use run_log::{Branch, Input, InputLine};
use scenario::ids::{Incarnation, RobotId, Tick};
use scenario::{Problem, Profile, Setup, Vocabulary};
use world_server::barrier::Presence;
use world_server::simulation::Simulation;

use crate::StartError;
use crate::broadcast_store::BroadcastStore;
use crate::external_command::BodyCommand;
use crate::external_controllers::{AnswerError, AnswerSource, TickError};
use crate::inputs::{LoggedInputs, TickInputs};
use crate::pool::WorkerPool;
use crate::seat::{Seat, Workspaces};
use crate::traffic::BroadcastCounts;

/// A run without its log.
pub(super) struct Run {
    pub simulation: Simulation,
    /// The setup as agents receive it.
    briefing: Setup,
    common: TeamConfig,
    /// Controllers in order of rank.
    pub seats: Vec<Seat>,
    /// By rank: `true` for robots with external controllers.
    is_external: Vec<bool>,
    pub answer_source: Option<Box<dyn AnswerSource>>,
    /// The error of an external controller that has not answered in this tick.
    pub unanswered: Option<AnswerError>,
    pub broadcasts: BroadcastStore,
    /// The robots of the current group. Their workspaces are in `spaces`, in the same order.
    pub asked: Vec<RobotId>,
    pub spaces: Workspaces,
    /// The threads that step the team; `None` without threads of their own.
    pub pool: Option<WorkerPool>,
    inputs: LoggedInputs,
    /// By rank: commands that replace those of the agents. Empty if no body was ever driven.
    pub driven: Vec<Option<BodyCommand>>,
    /// The counts of broadcasts; `None` if they are not counted.
    pub traffic: Option<BroadcastCounts>,
    /// The known allocators, including which of them learn.
    vocabulary: Vocabulary,
    /// The known allocators and controllers, for parameters that change during the run.
    agents: AgentRegistry,
}

impl Run {
    /// Creates a run that is ready for tick 0. `answer_source` answers for robots with external controllers.
    pub fn new(
        registry: &Registry,
        setup: Setup,
        inputs: Vec<InputLine>,
        answer_source: Option<Box<dyn AnswerSource>>,
    ) -> Result<Self, StartError> {
        let mut is_external = vec![false; setup.scenario.robots.len()];
        for (robot, is_external) in setup.scenario.robots.iter().zip(&mut is_external) {
            let controller = robot.controller.as_deref();
            if let Some(controller) =
                controller.filter(|controller| !registry.agents().has_controller(controller))
            {
                *is_external = true;
                if answer_source.is_none() {
                    return Err(StartError::ExternalController {
                        robot: robot.name.clone(),
                        controller: controller.to_owned(),
                    });
                }
            }
        }
        let mission = registry.worlds().find(&setup.scenario)?;
        let briefing = setup.for_robots();
        let vocabulary = registry.vocabulary();
        let informed = vocabulary.ground_truth_robots(&setup.scenario);
        let mut run = Self {
            common: TeamConfig::new(&briefing, registry.agents())?,
            briefing,
            seats: is_external.iter().map(|_| Seat::Empty).collect(),
            is_external,
            answer_source,
            unanswered: None,
            broadcasts: BroadcastStore::new(setup.scenario.robots.len()),
            asked: Vec::new(),
            spaces: Workspaces::default(),
            pool: None,
            simulation: Simulation::new(setup, mission, true),
            inputs: LoggedInputs::default(),
            driven: Vec::new(),
            traffic: None,
            vocabulary,
            agents: registry.agents().clone(),
        };
        run.inputs.add(inputs);
        run.simulation.send_ground_truth_to(informed);
        // A run that is over at its start admits no robots.
        if run.simulation.outcome().is_none() {
            run.admit(0);
        }
        Ok(run)
    }

    /// Returns a copy with the same state between two ticks. The allocators of the robots in `adopting` use the data that
    /// `registry` supplies. Returns `None` if external controllers answer, or if one of these allocators keeps its data.
    pub fn copied(&self, registry: &Registry, adopting: &[RobotId]) -> Option<Self> {
        if self.answer_source.is_some() {
            return None;
        }
        let agents = registry.agents().clone();
        let common = self
            .common
            .with_allocators_of(&agents, adopting, &self.briefing);
        let common = common.ok()?;
        let mut seats = self.seats.clone();
        for robot in adopting {
            if let Seat::Agent(agent) = &mut seats[robot.index()]
                && !agent.adopt(&self.briefing, &common)
            {
                return None;
            }
        }
        Some(Self {
            simulation: self.simulation.clone(),
            briefing: self.briefing.clone(),
            common,
            seats,
            is_external: self.is_external.clone(),
            answer_source: None,
            unanswered: None,
            broadcasts: self.broadcasts.clone(),
            asked: Vec::new(),
            spaces: Workspaces::default(),
            pool: None,
            inputs: self.inputs.clone(),
            driven: self.driven.clone(),
            traffic: self.traffic.clone(),
            vocabulary: self.vocabulary.clone(),
            agents,
        })
    }

    /// Requests the memory of a layer, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        self.simulation.prefetch(layer);
        match layer {
            Layer::Fields => {
                prefetch(&self.seats);
                prefetch(&self.answer_source);
                prefetch(&self.unanswered);
                prefetch(&self.broadcasts);
                prefetch(&self.asked);
                prefetch(&self.spaces);
                prefetch(&self.pool);
                prefetch(&self.inputs);
                prefetch(&self.driven);
                prefetch(&self.traffic);
            }
            Layer::Lists => {
                prefetch(&*self.seats);
                prefetch(&*self.asked);
                prefetch(&*self.driven);
                self.broadcasts.prefetch();
            }
            Layer::Elements | Layer::Contents => {
                for seat in &self.seats {
                    if let Seat::Agent(agent) = seat {
                        agent.prefetch(layer);
                    }
                }
            }
        }
    }

    /// Returns the learned task times, see [`Team::learned`](crate::Team::learned).
    pub fn learned(&self) -> Profile {
        let setup = self.simulation.setup();
        let vocabulary = &self.vocabulary;
        let robots = setup.scenario.robots.iter().zip(&self.seats);
        let robots = robots
            .filter(|(robot, _)| vocabulary.learns(setup.scenario.decider_of(robot)))
            .filter_map(|(robot, seat)| {
                let times = match seat {
                    Seat::Agent(agent) => agent.learned(setup),
                    Seat::Empty | Seat::Foreign => setup.profile.robots.get(&robot.name)?.clone(),
                };
                Some((robot.name.clone(), times))
            });
        Profile {
            robots: robots.collect(),
        }
    }

    /// Adds inputs, see [`Team::add_inputs`](crate::Team::add_inputs).
    pub fn add_inputs(&mut self, lines: Vec<InputLine>) {
        self.inputs.add(lines);
    }

    /// Drives a body, see [`Team::drive`](crate::Team::drive).
    pub fn drive(&mut self, robot: RobotId, command: Option<BodyCommand>) {
        if self.driven.is_empty() {
            self.driven = vec![None; self.seats.len()];
        }
        self.driven[robot.index()] = command;
    }

    pub fn exchange(&mut self, spaces: &mut Workspaces) {
        std::mem::swap(&mut self.spaces, spaces);
    }

    /// Runs one tick and passes its record to the recorder. Returns the outcome if the run has ended.
    pub fn tick(&mut self, recorder: &mut dyn Record) -> Result<Option<Outcome>, TickError> {
        let tick = self.simulation.tick();
        let mut inputs = self.inputs.take(tick);
        while self.simulation.outcome().is_none() && !self.simulation.is_complete() {
            let has_changed = self.carry_out_changes(&mut inputs);
            let has_answers = self.gather_answers(&inputs)?;
            if !has_changed && !has_answers && !self.simulation.is_complete() {
                // No robot takes part, and no further input will change that.
                self.simulation.end_if_idle();
                return Ok(self.simulation.outcome());
            }
        }
        if self.simulation.is_complete() {
            self.feed(&mut inputs);
            self.admit(tick + 1);
            self.simulation.finish();
            self.simulation.record(recorder)?;
        }
        Ok(self.simulation.outcome())
    }

    /// Applies the faults and the external inputs that are due, each with its process actions. Returns `true` if there were any.
    fn carry_out_changes(&mut self, inputs: &mut TickInputs) -> bool {
        let mut has_changed = false;
        self.feed(inputs);
        self.simulation.begin();
        loop {
            // A pending act may depend on an input at the current order index.
            let mut has_inputs = self.feed(inputs);
            let next = self.simulation.take_action();
            has_inputs |= self.feed(inputs);
            if let Some(Some((robot, act))) = next {
                self.act(robot, act, inputs);
            }
            if next.is_none() && !has_inputs {
                return has_changed;
            }
            has_changed = true;
        }
    }

    /// Sends the tick to the robots that wait for it and gathers their reports. Returns `true` if there were any.
    fn gather_answers(&mut self, inputs: &TickInputs) -> Result<bool, AnswerError> {
        if self.simulation.outcome().is_none() {
            self.simulation.gather();
        }
        self.remove_dead(inputs);
        let mut has_answers = false;
        while self.step_group(inputs) {
            has_answers = true;
        }
        self.unanswered.take().map_or(Ok(has_answers), Err)
    }

    /// Admits the robots that take part from this tick on. Must be called before the tick begins.
    fn admit(&mut self, tick: Tick) {
        for input in self.inputs.unordered(tick) {
            self.admit_input(&input);
        }
    }

    /// Admits a robot if the input is an arrival.
    fn admit_input(&mut self, input: &Input) {
        match input {
            Input::Join {
                robot, incarnation, ..
            } => {
                if let Some(robot) = self.simulation.robot_named(robot) {
                    self.spawn_agent(robot, *incarnation);
                    self.simulation
                        .admit(robot, *incarnation, input.moment().is_some());
                }
            }
            // The run began without this robot.
            Input::Gone {
                robot,
                incarnation: 0,
                ..
            } => {
                if let Some(robot) = self.simulation.robot_named(robot) {
                    self.simulation.start_without(robot);
                }
            }
            Input::StallEnd { robot, .. } => {
                if let Some(robot) = self.simulation.robot_named(robot)
                    && let Some(incarnation) = self.simulation.barrier().incarnation(robot)
                {
                    self.simulation
                        .admit(robot, incarnation, input.moment().is_some());
                }
            }
            _ => {}
        }
    }

    /// Applies the external inputs at the current order index of the tick. Returns `true` if there were any.
    #[inline]
    fn feed(&mut self, inputs: &mut TickInputs) -> bool {
        // Most ticks have no inputs.
        !inputs.ordered.is_empty() && self.feed_some(inputs)
    }

    #[inline(never)]
    fn feed_some(&mut self, inputs: &mut TickInputs) -> bool {
        let mut any = false;
        let ordered = &mut inputs.ordered;
        while let Some(input) = ordered.pop_front_if(|input| self.simulation.is_input_due(input)) {
            any = true;
            match &input {
                Input::Gone { robot, .. } => {
                    if let Some(robot) = self.simulation.robot_named(robot) {
                        self.end_agent(robot);
                    }
                }
                Input::Order { order, .. } => {
                    if let Err(why) = self.simulation.order(order.clone()) {
                        tracing::warn!(%why, "a logged order was refused");
                    }
                }
                Input::Branch(branch) => {
                    if let Err(why) = self.branch(branch) {
                        tracing::warn!(%why, "a logged branch was refused");
                    }
                }
                Input::Body(body) => self.simulation.place_body(body.clone()),
                // All faults that one command clears are one input.
                Input::Clear { ids, .. } => self.simulation.replay_clear(ids.clone()),
                _ => self.admit_input(&input),
            }
        }
        any
    }

    fn spawn_agent(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.seats[robot.index()] = match &mut self.answer_source {
            Some(answer_source) if self.is_external[robot.index()] => {
                answer_source.start_incarnation(robot, incarnation);
                Seat::Foreign
            }
            _ => Seat::Agent(Agent::new(robot, incarnation, &self.briefing, &self.common)),
        };
    }

    /// Carries out a process act at once, as the launcher does, or fails like in the log.
    fn act(&mut self, robot: RobotId, act: ProcessAction, inputs: &TickInputs) {
        let name = self.name(robot).to_owned();
        let number = self.simulation.act_number();
        if let Some(why) = inputs.failure_of(&name, act, number) {
            return self.simulation.act_done(robot, act, Err(why.to_owned()));
        }
        match act {
            ProcessAction::Start => {
                let tick = self.simulation.tick();
                if let Some(incarnation) = self.inputs.next_incarnation(tick, &name) {
                    self.simulation.skip_to(robot, incarnation);
                }
                if let Ok((robot, incarnation, _)) = self.simulation.invite(&name) {
                    self.spawn_agent(robot, incarnation);
                    self.simulation.arrive(robot, incarnation);
                }
            }
            ProcessAction::Kill | ProcessAction::Terminate => self.end_agent(robot),
            ProcessAction::Stop | ProcessAction::Continue => {
                self.simulation.act_done(robot, act, Ok(()));
            }
        }
    }

    pub(super) fn end_agent(&mut self, robot: RobotId) {
        if let Some(incarnation) = self.simulation.barrier().incarnation(robot) {
            let seat = &mut self.seats[robot.index()];
            if matches!(std::mem::replace(seat, Seat::Empty), Seat::Foreign)
                && let Some(answer_source) = &mut self.answer_source
            {
                answer_source.end_incarnation(robot);
            }
            self.simulation.agent_lost(robot, incarnation);
        }
    }

    /// Changes faults and parameters before anything else happens in the current tick.
    ///
    /// # Errors
    /// If a fault or a parameter does not fit the state. Nothing has changed then.
    pub fn branch(&mut self, branch: &Branch) -> Result<(), Problem> {
        if branch.parameters.is_empty() {
            return self.simulation.branch(branch);
        }
        let setup = self
            .simulation
            .setup()
            .with_parameters(&branch.parameters)?;
        let briefing = setup.for_robots();
        let common = TeamConfig::new(&briefing, &self.agents)
            .map_err(|error| Problem::of_value(error.to_string(), ""))?;
        let agents = self.adopted(&briefing, &common)?;
        self.simulation.branch(branch)?;
        for (robot, agent) in agents {
            self.seats[robot.index()] = Seat::Agent(agent);
        }
        (self.briefing, self.common) = (briefing, common);
        Ok(())
    }

    /// Returns the agents whose parameters differ in `briefing`, with the new ones.
    fn adopted(
        &self,
        briefing: &Setup,
        common: &TeamConfig,
    ) -> Result<Vec<(RobotId, Agent)>, Problem> {
        let mut agents = Vec::new();
        for (seat, robot) in self.seats.iter().zip(self.simulation.barrier().robots()) {
            let Seat::Agent(agent) = seat else { continue };
            let spec = &briefing.scenario.robots[robot.index()];
            let allocator = briefing.scenario.decider_of(spec);
            let values = |setup: &Setup| {
                let alliance = setup.alliance.robots.get(&spec.name).cloned();
                (setup.scenario.allocator_values(allocator), alliance)
            };
            if values(briefing) == values(&self.briefing) {
                continue;
            }
            let mut agent = agent.clone();
            if !agent.adopt(briefing, common) {
                let what = format!(
                    "the state of {} depends on this parameter of {allocator}",
                    spec.name
                );
                return Err(Problem::of_value(what, "start the mission anew"));
            }
            agents.push((robot, agent));
        }
        Ok(agents)
    }

    /// Returns the agent of a robot, for another process; `None` if the robot has no agent in this process.
    pub fn take_agent(&mut self, robot: RobotId) -> Option<Agent> {
        match std::mem::replace(&mut self.seats[robot.index()], Seat::Empty) {
            Seat::Agent(agent) => Some(agent),
            Seat::Empty | Seat::Foreign => None,
        }
    }

    /// Ends dead agents that do not take part in this tick.
    fn remove_dead(&mut self, inputs: &TickInputs) {
        if inputs.leave_reports_alone() {
            return;
        }
        for robot in self.simulation.barrier().robots() {
            if self.simulation.barrier().presence(robot) == Presence::Silent
                && self.death(robot, inputs).is_some()
            {
                self.end_agent(robot);
            }
        }
    }

    pub(super) fn name(&self, robot: RobotId) -> &str {
        &self.simulation.setup().scenario.robots[robot.index()].name
    }
}

//! World and agents, stepped tick by tick. This module does not depend on the sink's type, so that it is compiled once, optimized.

use std::collections::{BTreeMap, VecDeque};

use missions::Registry;
use proto::process::ProcessAction;
use proto::tick::Outcome;
use robot_agent::agent::{Agent, TeamConfig, Workspace};
use run_log::recorder::Record;
use run_log::{Input, InputLine};
use scenario::ids::{Incarnation, RobotId, Tick};
use scenario::{Profile, Setup, Vocabulary};
use world_server::barrier::{Presence, Verdict};
use world_server::simulation::Simulation;

use crate::StartError;
use crate::broadcast_store::BroadcastStore;
use crate::external_command::BodyCommand;
use crate::external_controllers::{AnswerError, AnswerSource, TickError};
use crate::traffic::BroadcastCounts;

type Outside = BTreeMap<Tick, Vec<Input>>;

/// The number of robots that run through sensing, perception, thinking, acting and reporting together. Each of these steps runs a
/// lot of code, which stays in the cache for the whole group.
const TOGETHER: usize = 32;

/// The controller of a robot's current incarnation.
enum Seat {
    Empty,
    Agent(Agent),
    /// A controller outside this program.
    Foreign,
}

/// The workspaces of the robots of a group. Several teams that are stepped in turn can share one set, which then stays in the
/// cache.
#[derive(Default)]
pub struct Workspaces(Vec<Workspace>);

/// A run without its log.
pub(super) struct Run {
    pub simulation: Simulation,
    /// The setup as agents receive it.
    briefing: Setup,
    common: TeamConfig,
    /// Controllers in order of rank.
    seats: Vec<Seat>,
    /// By rank: `true` for robots with external controllers.
    is_external: Vec<bool>,
    answer_source: Option<Box<dyn AnswerSource>>,
    /// The error of an external controller that has not answered in this tick.
    unanswered: Option<AnswerError>,
    broadcasts: BroadcastStore,
    /// The robots of the current group. Their workspaces are in `spaces`, in the same order.
    asked: Vec<RobotId>,
    spaces: Workspaces,
    outside: Outside,
    /// By rank: commands that replace those of the agents. Empty if no body was ever driven.
    driven: Vec<Option<BodyCommand>>,
    /// The counts of broadcasts; `None` if they are not counted.
    pub traffic: Option<BroadcastCounts>,
    /// The incarnations that process faults start, by tick and robot. An incarnation that ends before it takes part has a number, too.
    incarnations: BTreeMap<(Tick, String), VecDeque<Incarnation>>,
    /// The known allocators, including which of them learn.
    vocabulary: Vocabulary,
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
            let controller = robot.mind.as_deref();
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
        let mut outside = Outside::new();
        let mut incarnations = BTreeMap::new();
        for line in inputs {
            match line.input {
                Input::Join {
                    robot,
                    incarnation,
                    scripted: true,
                    ..
                } => {
                    let incarnations: &mut VecDeque<_> =
                        incarnations.entry((line.tick, robot)).or_default();
                    incarnations.push_back(incarnation);
                }
                input if input.is_scripted() => {}
                input => outside.entry(line.tick).or_default().push(input),
            }
        }
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
            simulation: Simulation::new(setup, mission, true),
            outside,
            driven: Vec::new(),
            traffic: None,
            incarnations,
            vocabulary,
        };
        run.simulation.send_ground_truth_to(informed);
        // A run that is over at its start admits no robots.
        if run.simulation.outcome().is_none() {
            run.admit(0);
        }
        Ok(run)
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
        let (mut timed, outside) = match self.outside.remove(&tick) {
            Some(outside) => in_order(outside),
            None => Default::default(),
        };
        for input in &outside {
            self.apply_order(input);
        }
        while self.simulation.outcome().is_none() && !self.simulation.is_complete() {
            self.feed(&mut timed);
            self.simulation.begin();
            let mut idle = true;
            loop {
                // A pending act may depend on an input at the current order index.
                let mut has_inputs = self.feed(&mut timed);
                let next = self.simulation.take_action();
                has_inputs |= self.feed(&mut timed);
                if let Some(Some((robot, act))) = next {
                    self.act(robot, act, &outside);
                }
                if next.is_none() && !has_inputs {
                    break;
                }
                idle = false;
            }
            if self.simulation.outcome().is_none() {
                self.simulation.gather();
            }
            self.remove_dead(&outside);
            while self.ask_some(&outside) {
                idle = false;
            }
            if let Some(why) = self.unanswered.take() {
                return Err(why.into());
            }
            if idle && !self.simulation.is_complete() {
                // No robot takes part, and no further input will change that.
                self.simulation.end_if_idle();
                return Ok(self.simulation.outcome());
            }
        }
        if self.simulation.is_complete() {
            self.feed(&mut timed);
            self.admit(tick + 1);
            self.simulation.finish();
            self.simulation.record(recorder)?;
        }
        Ok(self.simulation.outcome())
    }

    /// Admits the robots that take part from this tick on. Must be called before the tick begins.
    fn admit(&mut self, tick: Tick) {
        let inputs = self.outside.get(&tick).cloned().unwrap_or_default();
        for input in inputs.iter().filter(|input| input.moment().is_none()) {
            self.admit_input(input);
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
    fn feed(&mut self, timed: &mut VecDeque<Input>) -> bool {
        // Most ticks have no inputs.
        !timed.is_empty() && self.feed_some(timed)
    }

    #[inline(never)]
    fn feed_some(&mut self, timed: &mut VecDeque<Input>) -> bool {
        let mut any = false;
        while let Some(input) = timed.pop_front_if(|input| self.simulation.is_input_due(input)) {
            any = true;
            match &input {
                Input::Gone { robot, .. } => {
                    if let Some(robot) = self.simulation.robot_named(robot) {
                        self.end_agent(robot);
                    }
                }
                _ => {
                    self.admit_input(&input);
                    self.apply_order(&input);
                }
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

    /// Applies an operator's order if the input is one.
    fn apply_order(&mut self, input: &Input) {
        match input {
            Input::Order { order, .. } => {
                if let Err(why) = self.simulation.order(order.clone()) {
                    tracing::warn!(%why, "a logged order was refused");
                }
            }
            // All faults that one command clears are one input.
            Input::Clear { ids, .. } => self.simulation.replay_clear(ids.clone()),
            _ => {}
        }
    }

    /// Carries out a process act at once, as the launcher does, or fails like in the log.
    fn act(&mut self, robot: RobotId, act: ProcessAction, outside: &[Input]) {
        let name = self.name(robot).to_owned();
        let number = self.simulation.act_number();
        let failed = outside.iter().find_map(|input| match input {
            Input::Failed {
                robot,
                act: failed,
                number: at,
                reason,
            } if (robot, *failed) == (&name, act) && at.is_none_or(|at| at == number) => {
                Some(reason)
            }
            _ => None,
        });
        if let Some(why) = failed {
            return self.simulation.act_done(robot, act, Err(why.clone()));
        }
        match act {
            ProcessAction::Start => {
                let key = (self.simulation.tick(), name);
                let incarnations = self.incarnations.get_mut(&key);
                if let Some(incarnation) = incarnations.and_then(VecDeque::pop_front) {
                    self.simulation.skip_to(robot, incarnation);
                }
                let (_, name) = key;
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

    fn end_agent(&mut self, robot: RobotId) {
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

    /// Ends dead agents that do not take part in this tick.
    fn remove_dead(&mut self, outside: &[Input]) {
        for robot in self.simulation.barrier().robots() {
            if self.simulation.barrier().presence(robot) == Presence::Silent
                && self.death(robot, outside).is_some()
            {
                self.end_agent(robot);
            }
        }
    }

    /// Returns the tick in which the robot counted last, if it dies in this tick.
    fn death(&self, robot: RobotId, outside: &[Input]) -> Option<Option<Tick>> {
        if outside.is_empty() {
            return None;
        }
        let name = self.name(robot);
        outside.iter().find_map(|input| match input {
            Input::Gone {
                robot: of,
                incarnation,
                last_counted,
                ..
            } if of == name
                && self.simulation.barrier().incarnation(robot) == Some(*incarnation) =>
            {
                Some(*last_counted)
            }
            _ => None,
        })
    }

    /// Steps the next group of robots. Returns `false` if no robot is left.
    fn ask_some(&mut self, outside: &[Input]) -> bool {
        // With external inputs, all robots that can be sent the tick form one group, because the inputs take effect after that.
        let most = if outside.is_empty() {
            TOGETHER
        } else {
            usize::MAX
        };
        self.asked.clear();
        while self.asked.len() < most
            && let Some(robot) = self.simulation.next_recipient()
        {
            self.asked.push(robot);
        }
        if self.asked.is_empty() {
            return false;
        }
        if outside.is_empty() {
            self.answer(outside);
            return true;
        }
        let mut asked = std::mem::take(&mut self.asked);
        // A robot that dies while reports are gathered dies before the last report arrives. The order is therefore: robots that die after
        // their own report or stall, then other robots that die, then all others.
        let tick = self.simulation.tick();
        asked.sort_by_key(|robot| match self.death(*robot, outside) {
            Some(counted) if counted == Some(tick) || self.stalls(*robot, outside) => 0,
            Some(_) => 1,
            None => 2,
        });
        for robot in &asked {
            self.asked.clear();
            self.asked.push(*robot);
            self.ask(*robot, outside);
        }
        true
    }

    /// Returns `true` if the robot does not answer in this tick.
    fn stalls(&self, robot: RobotId, outside: &[Input]) -> bool {
        let name = self.name(robot);
        outside
            .iter()
            .any(|input| matches!(input, Input::StallBegin { robot: of, .. } if of == name))
    }

    fn ask(&mut self, robot: RobotId, outside: &[Input]) {
        let death = self.death(robot, outside);
        if self.stalls(robot, outside) {
            self.simulation.stall(robot);
        } else if death.is_none_or(|counted| counted == Some(self.simulation.tick())) {
            self.answer(outside);
        }
        if death.is_some() {
            self.end_agent(robot);
        }
    }

    /// Steps the agents of the group and then passes on their reports.
    fn answer(&mut self, outside: &[Input]) {
        let Workspaces(spaces) = &mut self.spaces;
        let most = spaces.len().max(self.asked.len());
        spaces.resize_with(most, Workspace::default);
        let robots = &self.simulation.setup().scenario.robots;
        let name = |robot: RobotId| &robots[robot.index()].name;
        for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
            let message = self.simulation.message(robot);
            let is_lost = |sender, tick, index| {
                outside.iter().any(|input| match input {
                    Input::Lost {
                        receiver,
                        sender: of,
                        sent_tick,
                        index: lost,
                    } => {
                        receiver == name(robot)
                            && (*sent_tick, *lost) == (tick, index)
                            && of == name(sender)
                    }
                    _ => false,
                })
            };
            self.broadcasts
                .collect(&message.manifest, is_lost, &mut space.arrived);
            match &mut self.seats[robot.index()] {
                Seat::Agent(agent) => agent.perceive(message, space),
                Seat::Foreign => {
                    if let Some(answer_source) = &mut self.answer_source {
                        let (report, broadcasts) = (&mut space.report, &mut space.broadcasts);
                        let answered = answer_source.answer(
                            robot,
                            message,
                            &space.arrived,
                            report,
                            broadcasts,
                        );
                        self.unanswered = self.unanswered.take().or(answered.err());
                    }
                }
                Seat::Empty => {}
            }
        }
        if self.unanswered.is_some() {
            return;
        }
        for phase in [Agent::allocate, Agent::act] {
            for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
                if let Seat::Agent(agent) = &mut self.seats[robot.index()] {
                    phase(agent, self.simulation.message(robot), space);
                }
            }
        }
        let tick = self.simulation.tick();
        let mut dismissed = Vec::new();
        for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
            if !matches!(self.seats[robot.index()], Seat::Empty) {
                if let Some(traffic) = &mut self.traffic {
                    traffic.add(&space.broadcasts);
                }
                if let Some(Some(command)) = self.driven.get(robot.index()) {
                    command.apply_to(&mut space.report.actuation);
                }
                if self.simulation.has_external_controller(robot) {
                    for broadcast in &space.broadcasts {
                        self.simulation.keep_broadcast(broadcast.clone());
                    }
                }
                if self.simulation.records_allocation_messages() {
                    for broadcast in &space.broadcasts {
                        self.simulation.keep_allocation_message(broadcast);
                    }
                }
                self.broadcasts.send(
                    tick,
                    robot,
                    &mut space.broadcasts,
                    &mut space.used_broadcasts,
                );
                if self.simulation.report(&space.report) == Verdict::Malformed {
                    dismissed.push(robot);
                }
            }
        }
        // Without its controller the robot counts as crashed, as in a run by processes.
        for robot in dismissed {
            self.end_agent(robot);
        }
    }

    fn name(&self, robot: RobotId) -> &str {
        &self.simulation.setup().scenario.robots[robot.index()].name
    }
}

/// Splits the external inputs of a tick into those with an order index, sorted by it, and the others. Joins without an order index
/// are left out, because they are admitted before the tick.
fn in_order(outside: Vec<Input>) -> (VecDeque<Input>, Vec<Input>) {
    let (mut timed, mut outside): (Vec<Input>, Vec<Input>) = outside
        .into_iter()
        .partition(|input| input.moment().is_some() || input.is_command());
    outside.retain(|input| !matches!(input, Input::Join { .. }));
    // A command takes effect at the end of its order index. Commands without one take effect at the first.
    timed.sort_by_key(|input| (input.moment().unwrap_or(0), input.is_command()));
    (timed.into(), outside)
}

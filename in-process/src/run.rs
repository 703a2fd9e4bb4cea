//! World and agents, stepped tick by tick. It knows nobody who writes the log, so that it is compiled once, where it is optimized.

use std::collections::{BTreeMap, VecDeque};

use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::log::{Input, InputLine};
use alliance_proto::process::ProcessAct;
use alliance_proto::scenario::{Profile, Setup, Vocabulary};
use alliance_proto::tick::Outcome;
use missions::Registry;
use robot_agent::agent::{Agent, TeamConfig, Workspace};
use world_server::barrier::Presence;
use world_server::recorder::Record;
use world_server::simulation::Simulation;

use crate::StartError;
use crate::air::Air;
use crate::driven::Command;
use crate::foreign::{Foreign, ForeignError, TickError};
use crate::traffic::Traffic;

/// What comes from outside, by the tick that it changes.
type Outside = BTreeMap<Tick, Vec<Input>>;

/// So many robots sense, then perceive, then think, then act, then report: each of these runs through much code, which is in the cache
/// if several do the same one after the other.
const TOGETHER: usize = 32;

/// Whoever lives in a robot.
enum Seat {
    Empty,
    Agent(Agent),
    /// Somebody else answers for it.
    Foreign,
}

/// The workspaces of the robots that are asked at the moment. Whoever steps many teams in turns lends them all the same ones, which
/// stay in the cache.
#[derive(Default)]
pub struct Spaces(Vec<Workspace>);

/// A run, but for its log.
pub(super) struct Run {
    pub simulation: Simulation,
    /// What all agents are told.
    briefing: Setup,
    /// What they make of it.
    common: TeamConfig,
    /// By rank.
    seats: Vec<Seat>,
    /// By rank: whose minds this program does not have, and who answers for them.
    is_foreign: Vec<bool>,
    foreign: Option<Box<dyn Foreign>>,
    /// Why a foreign mind has not answered in this tick.
    unanswered: Option<ForeignError>,
    air: Air,
    /// Those who are asked at the moment, and the workspace of each.
    asked: Vec<RobotId>,
    spaces: Spaces,
    outside: Outside,
    /// By rank, of bodies that somebody else drives; empty where nobody does.
    driven: Vec<Option<Command>>,
    /// What was said, if that is to be counted.
    pub traffic: Option<Traffic>,
    /// Which lives faults have begun: one that ended before it took part has a number, too.
    lives: BTreeMap<(Tick, String), VecDeque<Incarnation>>,
    /// Tells which allocators learn.
    vocabulary: Vocabulary,
}

impl Run {
    /// Ready for tick 0; somebody may answer for the robots whose minds this program does not have.
    ///
    /// # Errors
    /// [`StartError`], but for that of the log.
    pub fn new(
        registry: &Registry,
        setup: Setup,
        inputs: Vec<InputLine>,
        foreign: Option<Box<dyn Foreign>>,
    ) -> Result<Self, StartError> {
        let mut is_foreign = vec![false; setup.scenario.robots.len()];
        for (robot, is_foreign) in setup.scenario.robots.iter().zip(&mut is_foreign) {
            let mind = robot.mind.as_deref();
            if let Some(mind) = mind.filter(|mind| !registry.agents().has_mind(mind)) {
                *is_foreign = true;
                if foreign.is_none() {
                    return Err(StartError::Mind {
                        robot: robot.name.clone(),
                        mind: mind.to_owned(),
                    });
                }
            }
        }
        let mission = registry.worlds().of(&setup.scenario)?;
        let briefing = setup.briefing();
        let vocabulary = registry.vocabulary();
        let told_truth = vocabulary.told_truth(&setup.scenario);
        let mut outside = Outside::new();
        let mut lives = BTreeMap::new();
        for line in inputs {
            match line.input {
                Input::Join {
                    robot,
                    incarnation,
                    scripted: true,
                    ..
                } => {
                    let lives: &mut VecDeque<_> = lives.entry((line.tick, robot)).or_default();
                    lives.push_back(incarnation);
                }
                input if input.is_scripted() => {}
                input => outside.entry(line.tick).or_default().push(input),
            }
        }
        let mut run = Self {
            common: TeamConfig::of(&briefing, registry.agents())?,
            briefing,
            seats: is_foreign.iter().map(|_| Seat::Empty).collect(),
            is_foreign,
            foreign,
            unanswered: None,
            air: Air::new(setup.scenario.robots.len()),
            asked: Vec::new(),
            spaces: Spaces::default(),
            simulation: Simulation::new(setup, mission, true),
            outside,
            driven: Vec::new(),
            traffic: None,
            lives,
            vocabulary,
        };
        run.simulation.tell_truth_to(told_truth);
        // Over at its start, for want of anything to do, a run takes nobody in.
        if run.simulation.outcome().is_none() {
            run.admit(0);
        }
        Ok(run)
    }

    /// See [`Team::learned`](crate::Team::learned).
    pub fn learned(&self) -> Profile {
        let setup = self.simulation.setup();
        let vocabulary = &self.vocabulary;
        let robots = setup.scenario.robots.iter().zip(&self.seats);
        let robots = robots
            .filter(|(robot, _)| vocabulary.learns(setup.scenario.allocator_of(robot)))
            .filter_map(|(robot, seat)| {
                let known = match seat {
                    Seat::Agent(agent) => agent.learned(setup),
                    Seat::Empty | Seat::Foreign => setup.profile.robots.get(&robot.name)?.clone(),
                };
                Some((robot.name.clone(), known))
            });
        Profile {
            robots: robots.collect(),
        }
    }

    /// See [`Team::drive`](crate::Team::drive).
    pub fn drive(&mut self, robot: RobotId, command: Option<Command>) {
        if self.driven.is_empty() {
            self.driven = vec![None; self.seats.len()];
        }
        self.driven[robot.index()] = command;
    }

    /// See [`Team::exchange`](crate::Team::exchange).
    pub fn exchange(&mut self, spaces: &mut Spaces) {
        std::mem::swap(&mut self.spaces, spaces);
    }

    /// One tick, which goes to that recorder. Says how the run ended, once it has.
    ///
    /// # Errors
    /// When the log cannot be written, or a foreign mind does not answer.
    pub fn tick(&mut self, recorder: &mut dyn Record) -> Result<Option<Outcome>, TickError> {
        let tick = self.simulation.tick();
        let (mut timed, outside) = match self.outside.remove(&tick) {
            Some(outside) => in_order(outside),
            None => Default::default(),
        };
        for input in &outside {
            self.obey(input);
        }
        while self.simulation.outcome().is_none() && !self.simulation.is_complete() {
            self.feed(&mut timed);
            self.simulation.begin();
            let mut idle = true;
            loop {
                // An act may have waited for a moment before it was asked for.
                let mut is_fed = self.feed(&mut timed);
                let next = self.simulation.take_act();
                is_fed |= self.feed(&mut timed);
                if let Some(Some((robot, act))) = next {
                    self.act(robot, act, &outside);
                }
                if next.is_none() && !is_fed {
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
                // Nobody takes part, and nobody will.
                self.simulation.abandon();
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

    /// Lets in whoever takes part from that tick on; before it begins.
    fn admit(&mut self, tick: Tick) {
        let coming = self.outside.get(&tick).cloned().unwrap_or_default();
        for input in coming.iter().filter(|input| input.moment().is_none()) {
            self.let_in(input);
        }
    }

    /// If that is somebody who comes.
    fn let_in(&mut self, input: &Input) {
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
            // The run began without it.
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

    /// What came from outside at this very moment of the tick; says whether there was anything.
    #[inline]
    fn feed(&mut self, timed: &mut VecDeque<Input>) -> bool {
        // As in most ticks.
        !timed.is_empty() && self.feed_some(timed)
    }

    #[inline(never)]
    fn feed_some(&mut self, timed: &mut VecDeque<Input>) -> bool {
        let mut any = false;
        while let Some(input) = timed.pop_front_if(|input| self.simulation.feeds(input)) {
            any = true;
            match &input {
                Input::Gone { robot, .. } => {
                    if let Some(robot) = self.simulation.robot_named(robot) {
                        self.die(robot);
                    }
                }
                _ => {
                    self.let_in(&input);
                    self.obey(&input);
                }
            }
        }
        any
    }

    fn spawn_agent(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.seats[robot.index()] = match &mut self.foreign {
            Some(foreign) if self.is_foreign[robot.index()] => {
                foreign.spawn(robot, incarnation);
                Seat::Foreign
            }
            _ => Seat::Agent(Agent::new(robot, incarnation, &self.briefing, &self.common)),
        };
    }

    /// If that is what an operator ordered.
    fn obey(&mut self, input: &Input) {
        match input {
            Input::Order { order, .. } => {
                if let Err(why) = self.simulation.order(order.clone()) {
                    tracing::warn!(%why, "a logged order was refused");
                }
            }
            // Those of one command together: they are one input.
            Input::Clear { ids, .. } => self.simulation.clear_again(ids.clone()),
            _ => {}
        }
    }

    /// Does at once what the launcher does to processes, or fails at it where the log says that it failed.
    fn act(&mut self, robot: RobotId, act: ProcessAct, outside: &[Input]) {
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
            ProcessAct::Start => {
                let joins = (self.simulation.tick(), name);
                let lives = self.lives.get_mut(&joins);
                if let Some(incarnation) = lives.and_then(VecDeque::pop_front) {
                    self.simulation.skip_to(robot, incarnation);
                }
                let (_, name) = joins;
                if let Ok((robot, incarnation, _)) = self.simulation.invite(&name) {
                    self.spawn_agent(robot, incarnation);
                    self.simulation.arrive(robot, incarnation);
                }
            }
            ProcessAct::Kill | ProcessAct::Terminate => self.die(robot),
            ProcessAct::Stop | ProcessAct::Continue => {
                self.simulation.act_done(robot, act, Ok(()));
            }
        }
    }

    fn die(&mut self, robot: RobotId) {
        if let Some(incarnation) = self.simulation.barrier().incarnation(robot) {
            let seat = &mut self.seats[robot.index()];
            if matches!(std::mem::replace(seat, Seat::Empty), Seat::Foreign)
                && let Some(foreign) = &mut self.foreign
            {
                foreign.die(robot);
            }
            self.simulation.gone(robot, incarnation);
        }
    }

    /// The deaths of those who take no part in this tick anyway.
    fn remove_dead(&mut self, outside: &[Input]) {
        for robot in self.simulation.barrier().robots() {
            if self.simulation.barrier().presence(robot) == Presence::Silent
                && self.death(robot, outside).is_some()
            {
                self.die(robot);
            }
        }
    }

    /// If the robot dies in this tick: the tick in which it counted last.
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

    /// Asks those who are next, and does what comes of it; says whether there was anybody.
    fn ask_some(&mut self, outside: &[Input]) -> bool {
        // What comes from outside happens when all are asked who can be.
        let most = if outside.is_empty() {
            TOGETHER
        } else {
            usize::MAX
        };
        self.asked.clear();
        while self.asked.len() < most
            && let Some(robot) = self.simulation.next_question()
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
        // Who dies while reports are gathered has done so before the last of them was there, or missed: first of all who dies after its
        // own, or after it was missed.
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

    /// Whether the robot does not answer in this tick.
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
            self.die(robot);
        }
    }

    /// Steps the agents that were asked, and then hands over their reports.
    fn answer(&mut self, outside: &[Input]) {
        let Spaces(spaces) = &mut self.spaces;
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
            self.air
                .collect(&message.manifest, is_lost, &mut space.arrived);
            match &mut self.seats[robot.index()] {
                Seat::Agent(agent) => agent.perceive(message, space),
                Seat::Foreign => {
                    if let Some(foreign) = &mut self.foreign {
                        let (report, said) = (&mut space.report, &mut space.broadcasts);
                        let answered = foreign.answer(robot, message, &space.arrived, report, said);
                        self.unanswered = self.unanswered.take().or(answered.err());
                    }
                }
                Seat::Empty => {}
            }
        }
        if self.unanswered.is_some() {
            return;
        }
        for part in [Agent::think, Agent::act] {
            for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
                if let Seat::Agent(agent) = &mut self.seats[robot.index()] {
                    part(agent, self.simulation.message(robot), space);
                }
            }
        }
        let tick = self.simulation.tick();
        for (&robot, space) in self.asked.iter().zip(&mut *spaces) {
            if !matches!(self.seats[robot.index()], Seat::Empty) {
                if let Some(traffic) = &mut self.traffic {
                    traffic.add(&space.broadcasts);
                }
                if let Some(Some(command)) = self.driven.get(robot.index()) {
                    command.take_over(&mut space.report.actuation);
                }
                if self.simulation.is_foreign(robot) {
                    for broadcast in &space.broadcasts {
                        self.simulation.overhear(broadcast.clone());
                    }
                }
                self.air
                    .send(tick, robot, &mut space.broadcasts, &mut space.spent);
                self.simulation.report(&space.report);
            }
        }
    }

    fn name(&self, robot: RobotId) -> &str {
        &self.simulation.setup().scenario.robots[robot.index()].name
    }
}

/// What comes from outside in a tick: what has a moment, in order, and the rest, without those who were let in
/// before it.
fn in_order(outside: Vec<Input>) -> (VecDeque<Input>, Vec<Input>) {
    let (mut timed, mut outside): (Vec<Input>, Vec<Input>) = outside
        .into_iter()
        .partition(|input| input.moment().is_some() || input.is_command());
    outside.retain(|input| !matches!(input, Input::Join { .. }));
    // A command ends the moment at which it is obeyed; one without a moment was obeyed at the first.
    timed.sort_by_key(|input| (input.moment().unwrap_or(0), input.is_command()));
    (timed.into(), outside)
}

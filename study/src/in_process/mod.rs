//! A whole run in one process: the same world, agents, radio and recorder, without processes and sockets, with the same
//! bytes as the result. What faults ask of processes is done to agents.

mod air;
mod foreign;
mod traffic;

use std::collections::{BTreeMap, VecDeque};

use alliance_proto::event::EventLine;
use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::log::{Input, InputLine, LogLevel, RunFile};
use alliance_proto::mission::Deed;
use alliance_proto::process::ProcessAct;
use alliance_proto::readings::Actuation;
use alliance_proto::scenario::{Profile, Setup, Vocabulary};
use alliance_proto::tick::Outcome;
use alliance_proto::view::View;
use missions::Registry;
use robot_agent::agent::{Agent, TeamConfig, Workspace};
use robot_agent::allocator::ConfigError;
use world_server::barrier::Presence;
use world_server::mission::UnknownMission;
use world_server::recorder::{RecordError, Recorder, Sink};
use world_server::simulation::Simulation;

use air::Air;
pub use foreign::{Foreign, ForeignError, Kept, TickError};
pub use traffic::{Said, Traffic};

/// What comes from outside, by the tick that it changes.
type Outside = BTreeMap<Tick, Vec<Input>>;

/// So many robots sense, then perceive, then think, then act, then report: each of these runs through much code, which is in the cache
/// if several do the same one after the other.
const TOGETHER: usize = 32;

/// Why a run in one process cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The log cannot be written.
    #[error(transparent)]
    Log(#[from] RecordError),
    /// This program does not know an allocator of the run, or not with these parameters.
    #[error(transparent)]
    Allocator(#[from] ConfigError),
    /// This program does not know the mission of the run.
    #[error(transparent)]
    Mission(#[from] UnknownMission),
    /// This program does not have the mind of a robot, and nobody answers for it.
    #[error(
        "the mind '{mind}' of {robot} is a program of its own, which runs by processes alone: \
         `alliance run SCENARIO --mind {mind}=COMMAND`"
    )]
    Mind {
        /// Whose.
        robot: String,
        /// Its name.
        mind: String,
    },
}

/// Whoever lives in a robot.
enum Seat {
    Empty,
    Agent(Agent),
    /// Somebody else answers for it.
    Foreign,
}

/// What somebody else makes of a robot's body in the place of its agent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// As [`Actuation::speed_m_s`]; finite.
    pub speed_m_s: f32,
    /// As [`Actuation::turn_rad_s`]; finite.
    pub turn_rad_s: f32,
    /// What it does beside driving; `None`: what its agent wants.
    pub deed: Option<Deed>,
}

impl Command {
    fn take_over(&self, actuation: &mut Actuation) {
        actuation.speed_m_s = self.speed_m_s;
        actuation.turn_rad_s = self.turn_rad_s;
        if let Some(deed) = self.deed {
            actuation.deed = deed;
        }
    }
}

/// The workspaces of the robots that are asked at the moment. Whoever steps many teams in turns lends them all the same ones, which
/// stay in the cache.
#[derive(Default)]
pub struct Spaces(Vec<Workspace>);

/// A team and its world, stepped by hand.
pub struct Team<S> {
    simulation: Simulation,
    recorder: Recorder<S>,
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
    traffic: Option<Traffic>,
    /// Which lives faults have begun: one that ended before it took part has a number, too.
    lives: BTreeMap<(Tick, String), VecDeque<Incarnation>>,
    /// Tells which allocators learn.
    vocabulary: Vocabulary,
}

impl<S: Sink> Team<S> {
    /// All robots of the scenario that are not absent, ready for tick 0.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn new(setup: Setup, log: LogLevel, sink: S) -> Result<Self, StartError> {
        let joins = joins_of(&setup);
        Self::with_inputs(setup, joins, log, sink)
    }

    /// A run to which the same happens from outside as to one that was logged. What a fault asked for happens by itself.
    ///
    /// # Errors
    /// When the log cannot be written.
    pub fn with_inputs(
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
    ) -> Result<Self, StartError> {
        Self::with_registry(Registry::of_this_program(), setup, inputs, log, sink)
    }

    /// The same where somebody answers for the robots whose minds this program does not have.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn with_foreign(
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
        foreign: Option<Box<dyn Foreign>>,
    ) -> Result<Self, StartError> {
        Self::with_all(
            Registry::of_this_program(),
            setup,
            inputs,
            log,
            sink,
            foreign,
        )
    }

    /// The same with missions and allocators that need not be those of the program.
    ///
    /// # Errors
    /// [`StartError`].
    pub fn with_registry(
        registry: &Registry,
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
    ) -> Result<Self, StartError> {
        Self::with_all(registry, setup, inputs, log, sink, None)
    }

    fn with_all(
        registry: &Registry,
        setup: Setup,
        inputs: Vec<InputLine>,
        log: LogLevel,
        sink: S,
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
        let recorder = Recorder::new(&setup, log, sink)?;
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
        let mut team = Self {
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
            recorder,
            outside,
            driven: Vec::new(),
            traffic: None,
            lives,
            vocabulary,
        };
        team.simulation.tell_truth_to(told_truth);
        // Over at its start, for want of anything to do, a run takes nobody in.
        if team.simulation.outcome().is_none() {
            team.admit(0);
        }
        Ok(team)
    }

    /// The run.
    pub fn simulation(&self) -> &Simulation {
        &self.simulation
    }

    /// What the robots that learn know by now of how long each of them needs. Who has no agent has lost what it learned in this run,
    /// and knows what it began it with.
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

    /// From now on the body of that robot does this, whatever its agent wants, which senses, hears and speaks as before; `None`: its
    /// agent drives again. A run that is driven from outside is not repeated by its inputs.
    pub fn drive(&mut self, robot: RobotId, command: Option<Command>) {
        if self.driven.is_empty() {
            self.driven = vec![None; self.seats.len()];
        }
        self.driven[robot.index()] = command;
    }

    /// Exchanges the team's workspaces for these. Nothing in them lasts from one tick to the next.
    pub fn exchange(&mut self, spaces: &mut Spaces) {
        std::mem::swap(&mut self.spaces, spaces);
    }

    /// Counts from now on what is said, by kind.
    pub fn count_traffic(&mut self) {
        self.traffic = Some(Traffic::default());
    }

    /// What was said, if it is counted.
    pub fn traffic(&self) -> Option<&Traffic> {
        self.traffic.as_ref()
    }

    /// What has happened since this was asked last, see [`Recorder::take_events`].
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.recorder.take_events()
    }

    /// A snapshot for eyes, see [`Simulation::glance`].
    pub fn glance(&self) -> View {
        self.simulation.glance()
    }

    /// One tick. Says how the run ended, once it has.
    ///
    /// # Errors
    /// When the log cannot be written, or a foreign mind does not answer.
    pub fn tick(&mut self) -> Result<Option<Outcome>, TickError> {
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
            self.simulation.record(&mut self.recorder)?;
        }
        Ok(self.simulation.outcome())
    }

    /// Runs to the end.
    ///
    /// # Errors
    /// Those of [`Team::tick`].
    pub fn run(mut self) -> Result<(Outcome, Recorder<S>), TickError> {
        loop {
            if let Some(outcome) = self.tick()? {
                return Ok(self.finish(outcome)?);
            }
        }
    }

    /// Runs to the end, or until that many ticks are done: then it ends as it is told to. `see` looks at the run before the
    /// first tick and after each.
    ///
    /// # Errors
    /// Those of [`Team::tick`].
    pub fn run_for(
        mut self,
        ticks: u64,
        then: Outcome,
        see: impl FnMut(&mut Simulation),
    ) -> Result<(Outcome, Recorder<S>), TickError> {
        let outcome = self.go_on_for(ticks, then, see)?;
        Ok(self.finish(outcome)?)
    }

    /// The same without the end of the log: says how the run ends.
    ///
    /// # Errors
    /// Those of [`Team::tick`].
    pub fn go_on_for(
        &mut self,
        ticks: u64,
        then: Outcome,
        mut see: impl FnMut(&mut Simulation),
    ) -> Result<Outcome, TickError> {
        see(&mut self.simulation);
        while self.simulation.tick() < ticks {
            let outcome = self.tick()?;
            see(&mut self.simulation);
            if let Some(outcome) = outcome {
                return Ok(outcome);
            }
        }
        // A run that ended for want of robots has begun one more tick: what fell due in it is in the log.
        let barrier = self.simulation.barrier();
        let is_deserted = barrier
            .robots()
            .all(|robot| barrier.presence(robot) != Presence::Present);
        if then == Outcome::NoRobotLeft && is_deserted {
            self.tick()?;
        }
        Ok(self.simulation.outcome().unwrap_or(then))
    }

    /// Ends the log: the run ended like this.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn end(mut self, outcome: Outcome) -> Result<(RunFile, Recorder<S>), RecordError> {
        let ending = self.simulation.ending();
        let run = self.recorder.finish(outcome, ending)?;
        Ok((run, self.recorder))
    }

    fn finish(self, outcome: Outcome) -> Result<(Outcome, Recorder<S>), RecordError> {
        let (_, recorder) = self.end(outcome)?;
        Ok((outcome, recorder))
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

/// What comes from outside where nothing does but all robots of the scenario that are not absent, at the start.
#[must_use]
pub fn joins_of(setup: &Setup) -> Vec<InputLine> {
    let present = setup.scenario.robots.iter().filter(|robot| !robot.absent);
    let joins = present.map(|robot| InputLine {
        tick: 0,
        input: Input::Join {
            robot: robot.name.clone(),
            incarnation: 1,
            moment: None,
            scripted: false,
        },
    });
    joins.collect()
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

//! World, barrier and faults together: one run, tick by tick, as a plain function of reports and inputs.
//!
//! The shell over zenoh and the run within one process drive it alike: [`Simulation::begin`] the tick, do to processes what
//! [`Simulation::next_act`] asks for, send each [`Simulation::next_question`] its [`Simulation::message`], hand every answer to
//! [`Simulation::report`], and when [`Simulation::is_complete`], [`Simulation::finish`] and [`Simulation::record`].
//!
//! - `presence`: which robots take part. `reports`: what robots say. `figures`: how far the mission has come.
//! - `commands`: what operators order and clear. `triggers`: events that faults wait for.
//! - `effects`: what a fault does when it takes effect and when it heals. `acts`: what it asks of processes.
//! - `truth`: what robots are told that no robot could know, if their allocators ask for it.
//! - `view`: what observers see of it all. `bends`: what they need of curves, however seldom they look.

mod acts;
mod bends;
mod commands;
mod effects;
mod figures;
mod levels;
mod presence;
mod reports;
#[cfg(test)]
mod tests;
mod triggers;
mod truth;
mod view;

use std::collections::{BTreeMap, VecDeque};

use alliance_proto::ids::{BehaviorId, RobotId, Tick};
use alliance_proto::log::Input;
use alliance_proto::readings::Actuation;
use alliance_proto::scenario::{Catalog, Setup, StepOrder};
use alliance_proto::team::Broadcast;
use alliance_proto::telemetry::Motivation;
use alliance_proto::tick::{Outcome, TickMessage};
use alliance_proto::time::SimTime;

use crate::barrier::{Barrier, Gathered};
use crate::faults::actuators::Actuators;
use crate::faults::campaign;
use crate::faults::links::Links;
use crate::faults::schedule::{FaultIndex, Schedule};
use crate::faults::sensors::Sensors;
use crate::faults::skills::impairments;
use crate::interruption::{Interruption, InterruptionHandler};
use crate::mission::{MissionWorld, Target, TeamFigures, Value};
use crate::recorder::{Answers, BodyRecord, Event, FaultEvent, Record, RecordError, TickRecord};
use crate::world::{Impairment, World};

use acts::{Act, Acts};
use commands::QueuedCommand;
use truth::Truth;
use view::Memories;

/// A run.
pub struct Simulation {
    setup: Setup,
    world: World,
    barrier: Barrier,
    /// What each robot was sent last, by rank.
    messages: Vec<TickMessage>,
    /// Behavior set that each robot last reported as active, by rank.
    active: Vec<Option<BehaviorId>>,
    /// What each robot reported as active in the tick before, by rank; `None`: it has not, or died in that tick. It does not change in
    /// the midst of a tick, at whatever moment somebody comes or goes.
    reported: Vec<Option<Option<BehaviorId>>>,
    answers: Answers,
    /// Whose minds are programs of their own, by rank; empty where nobody's is. And what these have said since the current tick began.
    foreign: Vec<bool>,
    said: Vec<Broadcast>,
    schedule: Schedule,
    links: Links,
    sensors: Sensors,
    actuators: Actuators,
    truth: Truth,
    /// Changes of the world that last.
    interruptions: BTreeMap<FaultIndex, Interruption>,
    handlers: Vec<Box<dyn InterruptionHandler>>,
    /// Whether somebody starts and signals processes.
    has_launcher: bool,
    /// The handlers have had their turn before the current tick.
    interrupted: bool,
    /// The current tick has been asked for: what comes now concerns the next one.
    opened: bool,
    /// The current tick's reports have been looked at for what they trigger.
    settled: bool,
    /// How much has happened in the current tick whose order matters: commands, faults' turns, acts. It numbers what comes from
    /// outside.
    moment: u32,
    /// Commands that wait for their turn.
    commands: VecDeque<QueuedCommand>,
    acts: Acts,
    /// Kills of the current tick, to be done once everybody has reported.
    pending_kills: Vec<Act>,
    /// Commands of the current tick.
    inputs: Vec<Input>,
    /// Acts of the current tick that could not be done.
    failures: Vec<Input>,
    /// Events of the current tick that no report and no step of the world tells.
    events: Vec<Event>,
    memories: Memories,
    unscripted: bool,
    outcome: Option<Outcome>,
    ended: Ended,
}

/// The tick that has ended last; kept for its memory.
#[derive(Default)]
struct Ended {
    /// Its number and time, until it is recorded.
    at: Option<(Tick, SimTime)>,
    gathered: Gathered,
    inputs: Vec<Input>,
    bodies: Vec<BodyRecord>,
    commands: Vec<Option<Actuation>>,
    events: Vec<Event>,
    /// Broadcasts of foreign minds that count, by sender and index.
    said: Vec<Broadcast>,
    mission: Vec<Value>,
    targets: Vec<Target>,
    mission_state: u64,
    /// The mission's figures as of then, once it has changed since.
    figures: Option<Box<TeamFigures>>,
}

impl Simulation {
    /// A run at tick 0, nobody there yet. Without a launcher nobody starts or signals processes, and faults that need it are
    /// refused.
    #[must_use]
    pub fn new(setup: Setup, mission: MissionWorld, has_launcher: bool) -> Self {
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
            foreign: if setup.scenario.minds().is_empty() {
                Vec::new()
            } else {
                let robots = setup.scenario.robots.iter();
                robots.map(|robot| robot.mind.is_some()).collect()
            },
            said: Vec::new(),
            schedule: Schedule::default(),
            links: Links::new(&setup),
            sensors: Sensors::new(&setup),
            actuators: Actuators::new(&setup),
            truth: Truth::default(),
            interruptions: BTreeMap::new(),
            handlers: Vec::new(),
            has_launcher,
            interrupted: false,
            opened: false,
            settled: false,
            moment: 0,
            commands: VecDeque::new(),
            acts: Acts::default(),
            pending_kills: Vec::new(),
            inputs: Vec::new(),
            failures: Vec::new(),
            events: Vec::new(),
            memories: Memories::new(robots),
            unscripted: false,
            outcome: None,
            ended: Ended::default(),
            setup,
        };
        simulation.arm_scenario();
        simulation.outcome = simulation.decide_outcome();
        simulation
    }

    /// Arms the scenario's own faults.
    fn arm_scenario(&mut self) {
        let Setup { seed, scenario, .. } = &self.setup;
        let mut orders = scenario.faults.timeline.clone();
        if let Some(random) = &scenario.faults.random {
            orders.extend(campaign::expand(random, scenario, *seed));
        }
        for order in orders {
            // Validation lets no two of them have the same id.
            if let Ok(fault) = self.schedule.arm(order, SimTime::ZERO) {
                self.tell(FaultEvent::Armed, fault, "");
            }
        }
    }

    /// Lets an experiment's own handler interrupt the run.
    pub fn add_handler(&mut self, handler: Box<dyn InterruptionHandler>) {
        self.handlers.push(handler);
    }

    /// The run's scenario, seed and parameters.
    #[must_use]
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The world, for checks and pictures.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Who takes part.
    #[must_use]
    pub fn barrier(&self) -> &Barrier {
        &self.barrier
    }

    /// The tick whose reports are being gathered.
    #[must_use]
    pub fn tick(&self) -> Tick {
        self.barrier.tick()
    }

    /// How the run ended, once it has.
    #[must_use]
    pub fn outcome(&self) -> Option<Outcome> {
        self.outcome
    }

    /// Whether a stall or a loss happened that the scenario did not ask for.
    #[must_use]
    pub fn is_unscripted(&self) -> bool {
        self.unscripted
    }

    /// Ends the run before the current tick: nothing of that one counts.
    pub fn interrupt(&mut self) {
        self.outcome.get_or_insert(Outcome::Interrupted);
    }

    /// Ends the run because nobody is left to carry on with it.
    pub fn abandon(&mut self) {
        if self.outcome.is_none() && self.barrier.is_idle() {
            self.outcome = Some(Outcome::NoRobotLeft);
        }
    }

    /// Who is to be asked now, if anybody is: what that robot is to be sent is its [`Simulation::message`].
    pub fn next_question(&mut self) -> Option<RobotId> {
        self.begin();
        if self.outcome.is_some() || !self.acts.is_empty() {
            return None;
        }
        self.gather();
        let Some(question) = self.barrier.next_question(&*self.world) else {
            // Nobody may be there to be asked.
            self.settle();
            return None;
        };
        let robot = question.robot;
        let message = &mut self.messages[robot.index()];
        message.incarnation = question.incarnation;
        message.tick = self.barrier.tick();
        message.now = self.world.now();
        message.last_counted = question.last_counted;
        self.barrier.hand_over(robot, &mut message.manifest);
        for entry in &mut message.manifest {
            entry.link = self.links.state(entry.sender, robot).map(Box::new);
        }
        self.links.held(robot, &mut message.held);
        self.truth.tell(robot, &mut message.truth);
        // What was distorted is not what was sensed.
        if self.sensors.were_always_intact() && self.world.senses_the_same(robot) {
            return Some(robot);
        }
        self.answers.readings_change(robot);
        self.world.sense(robot, &mut message.readings);
        let hits = self.sensors.distort(
            self.world.mission(),
            robot,
            message.tick,
            &mut message.readings,
        );
        for fault in hits {
            self.hit(fault, 1);
        }
        Some(robot)
    }

    /// What a robot is sent in the current tick once it is asked; before that, what it was sent last.
    #[must_use]
    pub fn message(&self, robot: RobotId) -> &TickMessage {
        &self.messages[robot.index()]
    }

    /// Begins to gather reports, if anybody is there to give one: else the tick waits, and commands for it with it.
    #[inline]
    pub fn gather(&mut self) {
        if !self.opened && self.barrier.started() && !self.barrier.is_idle() {
            self.open();
        }
    }

    /// The current tick is asked for from now on: what faults do to it is settled.
    #[inline(never)]
    fn open(&mut self) {
        self.opened = true;
        self.moment += 1;
        let world = &self.world;
        self.links
            .begin(self.barrier.tick(), self.schedule.in_force(), |robot| {
                world.pose(robot).position
            });
        let told = |robot: RobotId| &self.messages[robot.index()];
        self.sensors
            .begin(self.barrier.tick(), self.schedule.in_force(), told);
        self.actuators.begin(self.schedule.in_force());
        let impaired = impairments(self.schedule.in_force(), &self.setup.roster);
        self.world
            .impair(impaired.map(|(_, impairment)| impairment));
        self.learn_truth();
    }

    fn steps_in_order(&self) -> bool {
        self.setup.step_order == StepOrder::InOrder
    }

    /// Once everybody has reported: what that triggers, and the kills of this tick.
    #[inline]
    fn settle(&mut self) {
        // Asked after each report.
        if !self.settled && self.opened && self.barrier.is_complete() {
            self.close();
        }
    }

    /// Everybody has reported.
    fn close(&mut self) {
        self.settled = true;
        self.moment += 1;
        if !self.steps_in_order() && self.schedule.waiting().next().is_some() {
            for robot in self.barrier.robots() {
                if self.barrier.has_answered(robot) {
                    let report = self.answers.report(robot).clone();
                    self.trigger_by_report(&report);
                }
            }
        }
        for act in std::mem::take(&mut self.pending_kills) {
            self.acts.push(act);
        }
    }

    /// Whether every agent that takes part has reported, and everything that faults ask of processes has happened.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.outcome.is_none() && self.settled && self.barrier.is_complete() && self.acts.is_empty()
    }

    /// Ends the tick: the reports that count move the world. What it was is to be recorded before the next report comes, see
    /// [`Simulation::record`]; there is time for that once the next tick has been asked for.
    pub fn finish(&mut self) {
        let (tick, now) = (self.barrier.tick(), self.world.now());
        let mut ended = std::mem::take(&mut self.ended);
        let gathered = &mut ended.gathered;
        self.barrier.finish(&*self.world, gathered);
        (self.interrupted, self.opened, self.settled) = (false, false, false);
        self.moment = 0;
        self.acts.end_tick();
        let mut answers = std::mem::take(&mut self.answers);
        answers.count(&gathered.counted);
        ended.inputs.clear();
        ended.inputs.append(&mut self.inputs);
        ended.inputs.append(&mut gathered.inputs);
        ended.inputs.append(&mut self.failures);
        self.take_note(now, answers.all(), &mut ended.inputs);
        for robot in &gathered.dead {
            self.active[robot.index()] = None;
        }
        self.note_reported(answers.all(), &ended.inputs);
        ended.bodies.clear();
        ended.bodies.extend(self.bodies());

        let commands = &mut ended.commands;
        commands.clear();
        let told = answers.all().iter();
        commands.extend(told.map(|answer| answer.counts.then_some(answer.report.actuation)));
        for (robot, command) in self.barrier.robots().zip(&mut *commands) {
            let mission = self.world.mission();
            for fault in self.actuators.disobey(mission, robot, command) {
                self.hit(fault, 1);
            }
        }
        let mut happened = self.world.step(commands);
        self.tell_of_impairments();
        for robot in &gathered.dead {
            happened.append(&mut self.world.lose(*robot));
        }
        self.trigger_by_world(&happened, &ended.inputs);
        ended.events.clear();
        ended.events.append(&mut self.events);
        ended.events.append(&mut happened);

        ended.said.clear();
        let all = answers.all();
        let counts = |it: &Broadcast| {
            let answer = &all[it.sender.index()];
            answer.counts && answer.report.incarnation == it.incarnation
        };
        ended.said.extend(self.said.drain(..).filter(counts));
        ended.at = Some((tick, now));
        ended.mission.clear();
        self.world.mission().row(&mut ended.mission);
        ended.targets.clear();
        self.world.mission().targets(&mut ended.targets);
        ended.mission_state = self.world.mission().state();
        ended.figures = None;
        self.answers = answers;
        self.ended = ended;
        self.outcome = self.decide_outcome();
    }

    /// What robots did worse in the last step hits the faults that impair them.
    fn tell_of_impairments(&mut self) {
        let acted = |it: &Impairment| it.has_acted;
        if !self.world.impairments().iter().any(acted) {
            // As in most runs.
            return;
        }
        // Since the tick was opened no fault has begun or ended.
        let faults = impairments(self.schedule.in_force(), &self.setup.roster);
        let told = faults.zip(self.world.impairments());
        let hits = told.filter_map(|((fault, _), it)| it.has_acted.then_some(fault));
        for fault in hits.collect::<Vec<_>>() {
            self.hit(fault, 1);
        }
    }

    /// Hands over what the tick was that has ended, once. Says whether there was one.
    ///
    /// # Errors
    /// When the log cannot be written.
    pub fn record(&mut self, recorder: &mut dyn Record) -> Result<bool, RecordError> {
        let ended = &mut self.ended;
        let Some((tick, now)) = ended.at.take() else {
            return Ok(false);
        };
        recorder.record(&TickRecord {
            tick,
            now,
            inputs: &ended.inputs,
            bodies: &ended.bodies,
            answers: self.answers.all(),
            foreign: &self.foreign,
            said: &ended.said,
            events: &ended.events,
            mission: &ended.mission,
            targets: &ended.targets,
            mission_state: ended.mission_state,
        })?;
        Ok(true)
    }

    /// The motivations that a robot last reported, in the order of the catalog.
    #[must_use]
    pub fn motivations(&self, robot: RobotId) -> &[Motivation] {
        &self.answers.report(robot).motivations
    }

    /// The tasks and behavior sets of the run.
    #[must_use]
    pub fn catalog(&self) -> &Catalog {
        &self.setup.catalog
    }

    fn name(&self, robot: RobotId) -> &str {
        self.setup.roster.name(robot)
    }

    /// The robot of that name.
    #[must_use]
    pub fn robot_named(&self, name: &str) -> Option<RobotId> {
        self.setup.roster.robot_named(name)
    }

    /// Robots as they are before this tick's commands move them.
    fn bodies(&self) -> impl Iterator<Item = BodyRecord> {
        self.barrier.robots().map(|robot| BodyRecord {
            present: self.world.is_present(robot),
            pose: self.world.pose(robot),
            speed_m_s: self.world.speed_m_s(robot),
            carrying: self.world.mission().load(robot).is_some(),
            energy_j: self.world.energy_j(robot),
            active: self.active[robot.index()],
        })
    }

    fn decide_outcome(&self) -> Option<Outcome> {
        let limit = SimTime::from_secs_f64(self.setup.scenario.limit_s);
        let end = self.world.mission().end(self.world.now());
        end.or_else(|| (self.world.now() >= limit).then_some(Outcome::TimeLimit))
    }
}

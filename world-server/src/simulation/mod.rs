//! One run, tick by tick: world, barrier and faults as a plain function of reports and inputs.
//!
//! Per tick, the caller runs [`Simulation::begin`] and performs each [`Simulation::next_act`]. It sends each
//! [`Simulation::next_recipient`] robot its [`Simulation::message`] and passes every answer to [`Simulation::report`]. After
//! [`Simulation::is_complete`] it calls [`Simulation::finish`] and [`Simulation::record`].
//!
//! - `presence`: robots that take part. `reports`: their reports. `figures`: progress of the mission.
//! - `commands`: operators' orders. `triggers`: events that faults wait for.
//! - `effects`: effects of faults. `process_actions`: process actions of faults.
//! - `ground_truth`: ground truth for allocators that request it.
//! - `view`: views for observers. `levels`, `corners`: their curves.

mod commands;
mod corners;
mod effects;
mod figures;
mod ground_truth;
mod levels;
mod presence;
mod process_actions;
mod reports;
#[cfg(test)]
mod tests;
mod triggers;
mod view;

use std::collections::{BTreeMap, VecDeque};

use proto::readings::Actuation;
use proto::team::Broadcast;
use proto::telemetry::Motivation;
use proto::tick::{Outcome, TickMessage};
use run_log::Input;
use scenario::ids::{BehaviorId, RobotId, Tick};
use scenario::time::SimTime;
use scenario::{Catalog, Setup, StepOrder};

use crate::barrier::{Barrier, Presence, TickResult};
use crate::faults::actuators::Actuators;
use crate::faults::campaign;
use crate::faults::links::Links;
use crate::faults::schedule::{FaultIndex, Schedule};
use crate::faults::sensors::Sensors;
use crate::faults::skills::impairments;
use crate::interruption::{Interruption, InterruptionHandler};
use crate::mission::{FigureValue, MissionWorld, Target, TeamFigures};
use crate::world::{Impairment, World};
use run_log::recorder::{Answers, BodyRecord, Event, FaultEvent, Record, RecordError, TickRecord};

use commands::QueuedCommand;
use ground_truth::GroundTruth;
use process_actions::{Acts, PendingAction};
use view::ViewHistory;

pub struct Simulation {
    setup: Setup,
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
    /// The messages of allocators since the current tick began; `None` if they are not recorded.
    allocation_messages: Option<Vec<Broadcast>>,
    schedule: Schedule,
    links: Links,
    sensors: Sensors,
    actuators: Actuators,
    ground_truth: GroundTruth,
    interruptions: BTreeMap<FaultIndex, Interruption>,
    handlers: Vec<Box<dyn InterruptionHandler>>,
    /// True if a launcher starts and signals processes.
    has_launcher: bool,
    /// True if the handlers have run before the current tick.
    interrupted: bool,
    /// True once tick messages of the current tick may be sent; new commands then affect the next tick.
    opened: bool,
    /// True once the current tick's reports have been searched for triggers.
    settled: bool,
    /// The number of ordered operations in the current tick: commands, transitions of faults, process actions. Outside inputs
    /// record it.
    order_index: u32,
    commands: VecDeque<QueuedCommand>,
    acts: Acts,
    /// The kills of the current tick, executed after its last report.
    pending_kills: Vec<PendingAction>,
    inputs: Vec<Input>,
    failures: Vec<Input>,
    /// The events of the current tick from neither reports nor the world.
    events: Vec<Event>,
    memories: ViewHistory,
    unscripted: bool,
    outcome: Option<Outcome>,
    ended: Ended,
}

/// The data of the last ended tick, kept to reuse its memory.
#[derive(Default)]
struct Ended {
    /// The tick's number and time, until it is recorded.
    at: Option<(Tick, SimTime)>,
    gathered: TickResult,
    inputs: Vec<Input>,
    bodies: Vec<BodyRecord>,
    commands: Vec<Option<Actuation>>,
    events: Vec<Event>,
    /// The broadcasts of external controllers that count, by sender and index.
    broadcasts: Vec<Broadcast>,
    /// The messages of allocators whose reports count, by sender and index.
    allocation_messages: Vec<Broadcast>,
    mission: Vec<FigureValue>,
    targets: Vec<Target>,
    mission_state: u64,
    /// The mission's figures at the end of the tick, if the mission has changed since.
    figures: Option<Box<TeamFigures>>,
}

impl Simulation {
    /// Creates a run at tick 0 without any agents. Without a launcher, faults of processes are rejected.
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
            external: if setup.scenario.external_controllers().is_empty() {
                Vec::new()
            } else {
                let robots = setup.scenario.robots.iter();
                robots.map(|robot| robot.mind.is_some()).collect()
            },
            broadcasts: Vec::new(),
            undecodable: Vec::new(),
            allocation_messages: None,
            schedule: Schedule::default(),
            links: Links::new(&setup),
            sensors: Sensors::new(&setup),
            actuators: Actuators::new(&setup),
            ground_truth: GroundTruth::default(),
            interruptions: BTreeMap::new(),
            handlers: Vec::new(),
            has_launcher,
            interrupted: false,
            opened: false,
            settled: false,
            order_index: 0,
            commands: VecDeque::new(),
            acts: Acts::default(),
            pending_kills: Vec::new(),
            inputs: Vec::new(),
            failures: Vec::new(),
            events: Vec::new(),
            memories: ViewHistory::new(robots),
            unscripted: false,
            outcome: None,
            ended: Ended::default(),
            setup,
        };
        simulation.arm_scenario();
        simulation.outcome = simulation.decide_outcome();
        simulation
    }

    fn arm_scenario(&mut self) {
        let Setup { seed, scenario, .. } = &self.setup;
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

    /// Checks whether a stall or a loss outside the scenario has happened.
    #[must_use]
    pub fn is_unscripted(&self) -> bool {
        self.unscripted
    }

    /// Ends the run before the current tick, which does not count.
    pub fn interrupt(&mut self) {
        self.outcome.get_or_insert(Outcome::Interrupted);
    }

    /// Ends the run if no robot takes part.
    pub fn end_if_idle(&mut self) {
        if self.outcome.is_none() && self.barrier.is_idle() {
            self.outcome = Some(Outcome::NoRobotLeft);
        }
    }

    /// Returns the next robot that needs its tick message, which [`Simulation::message`] then returns.
    pub fn next_recipient(&mut self) -> Option<RobotId> {
        self.begin();
        if self.outcome.is_some() || !self.acts.is_empty() {
            return None;
        }
        self.gather();
        let Some(question) = self.barrier.next_recipient(&*self.world) else {
            // There may be no robots at all.
            self.settle();
            return None;
        };
        let robot = question.robot;
        let message = &mut self.messages[robot.index()];
        message.incarnation = question.incarnation;
        message.tick = self.barrier.tick();
        message.now = self.world.now();
        message.last_counted = question.last_counted;
        self.barrier.take_manifest(robot, &mut message.manifest);
        for entry in &mut message.manifest {
            entry.link = self.links.state(entry.sender, robot).map(Box::new);
        }
        self.links.write_held_senders(robot, &mut message.held);
        self.ground_truth
            .write_offers(robot, &mut message.ground_truth);
        // Distorted readings differ from the sensed ones.
        if self.sensors.never_broken() && self.world.readings_are_valid(robot) {
            return Some(robot);
        }
        self.answers.mark_readings_changed(robot);
        self.world.write_readings(robot, &mut message.readings);
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

    /// Returns a robot's message of the current tick; before it is due, the previous message.
    #[must_use]
    pub fn message(&self, robot: RobotId) -> &TickMessage {
        &self.messages[robot.index()]
    }

    /// Starts to collect reports if any robot takes part. Otherwise the tick and its commands wait.
    #[inline]
    pub fn gather(&mut self) {
        if !self.opened && self.barrier.started() && !self.barrier.is_idle() {
            self.open();
        }
    }

    /// Starts the tick: from now on its link, sensor, actuator and skill faults are fixed.
    #[inline(never)]
    fn open(&mut self) {
        self.opened = true;
        self.order_index += 1;
        let world = &self.world;
        self.links
            .begin(self.barrier.tick(), self.schedule.in_force(), |robot| {
                world.pose(robot).position
            });
        let sent = |robot: RobotId| &self.messages[robot.index()];
        self.sensors
            .begin(self.barrier.tick(), self.schedule.in_force(), sent);
        self.actuators.begin_tick(self.schedule.in_force());
        let impaired = impairments(self.schedule.in_force(), &self.setup.roster);
        self.world
            .impair(impaired.map(|(_, impairment)| impairment));
        self.compute_ground_truth();
    }

    fn steps_in_order(&self) -> bool {
        self.setup.step_order == StepOrder::InOrder
    }

    /// Evaluates triggers and kills after the tick's last report.
    #[inline]
    fn settle(&mut self) {
        // This runs after each report.
        if !self.settled && self.opened && self.barrier.is_complete() {
            self.close();
        }
    }

    fn close(&mut self) {
        self.settled = true;
        self.order_index += 1;
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

    /// Checks whether every present agent has reported and every process action has finished.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.outcome.is_none() && self.settled && self.barrier.is_complete() && self.acts.is_empty()
    }

    /// Ends the tick: the counting reports move the world. Call [`Simulation::record`] before the next report; it may run
    /// after the next tick messages are sent.
    pub fn finish(&mut self) {
        let (tick, now) = (self.barrier.tick(), self.world.now());
        let mut ended = std::mem::take(&mut self.ended);
        let gathered = &mut ended.gathered;
        self.barrier.finish(&*self.world, gathered);
        (self.interrupted, self.opened, self.settled) = (false, false, false);
        self.order_index = 0;
        self.acts.end_tick();
        let mut answers = std::mem::take(&mut self.answers);
        answers.count(&gathered.counted);
        ended.inputs.clear();
        ended.inputs.append(&mut self.inputs);
        ended.inputs.append(&mut gathered.inputs);
        ended.inputs.append(&mut self.failures);
        self.update_from_answers(now, answers.all(), &mut ended.inputs);
        for robot in &gathered.dead {
            self.active[robot.index()] = None;
        }
        self.record_reported(answers.all(), &ended.inputs);
        ended.bodies.clear();
        ended.bodies.extend(self.bodies());

        let commands = &mut ended.commands;
        commands.clear();
        let reported = answers.all().iter();
        commands.extend(reported.map(|answer| answer.counts.then_some(answer.report.actuation)));
        for (robot, command) in self.barrier.robots().zip(&mut *commands) {
            let mission = self.world.mission();
            for fault in self.actuators.apply_to(mission, robot, command) {
                self.hit(fault, 1);
            }
        }
        let mut happened = self.world.step(commands);
        self.count_impairment_hits();
        for robot in &gathered.dead {
            happened.append(&mut self.world.release_load(*robot));
        }
        self.trigger_by_world(&happened, &ended.inputs);
        ended.events.clear();
        ended.events.append(&mut self.events);
        ended.events.append(&mut happened);

        ended.broadcasts.clear();
        let all = answers.all();
        let counts = |broadcast: &Broadcast| {
            let answer = &all[broadcast.sender.index()];
            answer.counts && answer.report.incarnation == broadcast.incarnation
        };
        ended
            .broadcasts
            .extend(self.broadcasts.drain(..).filter(counts));
        self.undecodable.clear();
        ended.allocation_messages.clear();
        if let Some(messages) = &mut self.allocation_messages {
            ended
                .allocation_messages
                .extend(messages.drain(..).filter(counts));
            // A repeated answer can send a message twice.
            ended
                .allocation_messages
                .sort_by_key(|message| (message.sender, message.index));
            ended
                .allocation_messages
                .dedup_by_key(|message| (message.sender, message.index));
        }
        ended.at = Some((tick, now));
        ended.mission.clear();
        self.world.mission().row(&mut ended.mission);
        ended.targets.clear();
        self.world.mission().targets(&mut ended.targets);
        ended.mission_state = self.world.mission().state_hash();
        ended.figures = None;
        self.answers = answers;
        self.ended = ended;
        self.outcome = self.decide_outcome();
    }

    /// Counts hits of the faults that impaired a skill in the last step.
    fn count_impairment_hits(&mut self) {
        let acted = |impairment: &Impairment| impairment.was_used;
        if !self.world.impairments().iter().any(acted) {
            // Most runs have no impairments.
            return;
        }
        // No fault has begun or ended since the tick was opened.
        let faults = impairments(self.schedule.in_force(), &self.setup.roster);
        let pairs = faults.zip(self.world.impairments());
        let hits =
            pairs.filter_map(|((fault, _), impairment)| impairment.was_used.then_some(fault));
        for fault in hits.collect::<Vec<_>>() {
            self.hit(fault, 1);
        }
    }

    /// Passes the data of the ended tick to the recorder, once. Returns whether there was such a tick.
    ///
    /// # Errors
    /// If the log cannot be written.
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
            external: &self.external,
            broadcasts: &ended.broadcasts,
            allocation_messages: &ended.allocation_messages,
            events: &ended.events,
            mission: &ended.mission,
            targets: &ended.targets,
            mission_state: ended.mission_state,
        })?;
        Ok(true)
    }

    /// Returns a robot's last reported motivations, in the order of the catalog.
    #[must_use]
    pub fn motivations(&self, robot: RobotId) -> &[Motivation] {
        &self.answers.report(robot).motivations
    }

    #[must_use]
    pub fn catalog(&self) -> &Catalog {
        &self.setup.catalog
    }

    fn name(&self, robot: RobotId) -> &str {
        self.setup.roster.name(robot)
    }

    #[must_use]
    pub fn robot_named(&self, name: &str) -> Option<RobotId> {
        self.setup.roster.find(name)
    }

    /// Returns the robots' states before the commands of this tick move them.
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
            .or_else(|| self.is_out_of_energy().then_some(Outcome::NoRobotLeft))
    }

    /// Checks whether no robot will act again, because all robots with a running agent have used up their energy. Nothing
    /// recharges a battery, and the schedule brings no other robot back.
    fn is_out_of_energy(&self) -> bool {
        if self.setup.scenario.energy.is_none() || self.schedule.will_return_robots() {
            return false;
        }
        let runs = |robot: &RobotId| {
            !matches!(
                self.barrier.presence(*robot),
                Presence::Empty | Presence::Invited
            )
        };
        let mut left = self.barrier.robots().filter(runs).peekable();
        let is_empty = |robot| {
            self.world
                .energy_j(robot)
                .is_some_and(|left_j| left_j <= 0.0)
        };
        left.peek().is_some() && left.all(is_empty)
    }
}

//! World, barrier and faults together: one run, tick by tick, as a plain function of reports and inputs.
//!
//! The shell over zenoh and the run within one process drive it alike: [`Simulation::begin`] the tick, do to processes what
//! [`Simulation::next_act`] asks for, send each [`Simulation::next_question`] its [`Simulation::message`], hand every answer to
//! [`Simulation::report`], and when [`Simulation::is_complete`], [`Simulation::finish`] and [`Simulation::record`].
//!
//! - `commands`: what operators order and clear. `triggers`: events that faults wait for.
//! - `effects`: what a fault does when it takes effect and when it heals. `acts`: what it asks of processes.
//! - `truth`: what robots are told that no robot could know, if their allocators ask for it.
//! - `view`: what observers see of it all. `bends`: what they need of curves, however seldom they look.

mod acts;
mod bends;
mod commands;
mod effects;
mod levels;
#[cfg(test)]
mod tests;
mod triggers;
mod truth;
mod view;

use std::collections::{BTreeMap, VecDeque};

use alliance_proto::ids::{BehaviorId, Incarnation, RobotId, Tick};
use alliance_proto::join::Refusal;
use alliance_proto::log::Input;
use alliance_proto::mission::columns::{ColumnKind, ColumnValue};
use alliance_proto::process::ProcessAct;
use alliance_proto::readings::Actuation;
use alliance_proto::scenario::{Catalog, Setup, StepOrder};
use alliance_proto::team::Broadcast;
use alliance_proto::telemetry::{Delivery, Motivation};
use alliance_proto::tick::{Outcome, Report, TickMessage};
use alliance_proto::time::SimTime;

use crate::barrier::{Barrier, Gathered, MAX_BROADCASTS, Presence, Verdict};
use crate::faults::actuators::Actuators;
use crate::faults::campaign;
use crate::faults::links::Links;
use crate::faults::schedule::{FaultIndex, Schedule};
use crate::faults::sensors::Sensors;
use crate::faults::skills::impairments;
use crate::interruption::{Interruption, InterruptionHandler};
use crate::mission::{MissionWorld, Target, TeamFigures, Value};
use crate::recorder::{
    Answer, Answers, BodyRecord, Ending, Event, FaultEvent, Record, RecordError, TickRecord,
};
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

    /// See [`Barrier::invite`].
    ///
    /// # Errors
    /// Why the agent may not join.
    pub fn invite(&mut self, robot: &str) -> Result<(RobotId, Incarnation, Tick), Refusal> {
        if self.outcome.is_some() {
            return Err(Refusal::Over);
        }
        self.barrier.invite(robot)
    }

    /// See [`Barrier::arrive`]; the clock starts when every robot of the scenario has arrived.
    pub fn arrive(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.mark_moment();
        self.barrier.arrive(robot, incarnation);
        self.barrier.start_if_all_here();
        self.moment += self.barrier.take_came();
        if self.barrier.presence(robot) == Presence::Present {
            self.conclude_if(robot, &[ProcessAct::Start]);
        }
    }

    /// See [`Barrier::start_without`].
    pub fn start_without(&mut self, robot: RobotId) {
        self.barrier.start_without(robot);
        self.barrier.start_if_all_here();
    }

    /// See [`Barrier::gone`].
    pub fn gone(&mut self, robot: RobotId, incarnation: Incarnation) {
        let was_invited = self.barrier.presence(robot) == Presence::Invited;
        self.mark_moment();
        let asked_for = self.is_killing(robot);
        self.barrier.gone(robot, incarnation, asked_for);
        self.moment += self.barrier.take_came();
        self.left(robot, was_invited, "its process ended before it joined");
    }

    /// See [`Barrier::give_up`].
    pub fn give_up(&mut self, robot: RobotId, incarnation: Incarnation) {
        let was_invited = self.barrier.presence(robot) == Presence::Invited;
        self.barrier.give_up(robot, incarnation);
        self.left(robot, was_invited, "it was welcomed and did not join");
    }

    /// An agent may have left its place.
    fn left(&mut self, robot: RobotId, was_invited: bool, why: &str) {
        let at_once = self.barrier.presence(robot) == Presence::Empty;
        if at_once {
            self.let_go(robot);
        }
        if self.barrier.is_gone(robot) || at_once {
            self.conclude_if(robot, &[ProcessAct::Kill, ProcessAct::Terminate]);
        }
        if at_once && was_invited {
            self.fail_start_of(robot, why);
        }
        self.settle();
    }

    /// What a robot carries falls before the current tick is sensed.
    fn let_go(&mut self, robot: RobotId) {
        self.active[robot.index()] = None;
        self.keep_figures();
        self.events.extend(self.world.lose(robot));
    }

    /// In a replay: see [`Barrier::skip_to`].
    pub fn skip_to(&mut self, robot: RobotId, incarnation: Incarnation) {
        self.barrier.skip_to(robot, incarnation);
    }

    /// Reports of different robots may come in any order while they are gathered; of everything else the order is kept.
    fn mark_moment(&mut self) {
        let gathers = self.opened && !self.settled;
        self.barrier.set_moment((!gathers).then_some(self.moment));
    }

    /// In a replay: whether what came from outside at some moment of the current tick is due now.
    #[must_use]
    pub fn feeds(&self, input: &Input) -> bool {
        input.moment().is_none_or(|moment| moment <= self.moment)
    }

    /// In a replay: see [`Barrier::admit`].
    pub fn admit(&mut self, robot: RobotId, incarnation: Incarnation, at_once: bool) {
        self.mark_moment();
        self.barrier.admit(robot, incarnation, at_once);
        self.barrier.start_if_all_here();
        self.moment += self.barrier.take_came();
    }

    /// See [`Barrier::stall`]. The scenario did not ask for it.
    pub fn stall(&mut self, robot: RobotId) {
        if self.barrier.is_awaited(robot) {
            self.unscripted = true;
            self.barrier.stall(robot);
            self.settle();
        }
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

    /// An agent's report.
    pub fn report(&mut self, report: &Report) -> Verdict {
        if !self.is_well_formed(report) {
            return Verdict::Malformed;
        }
        self.mark_moment();
        let verdict = self.barrier.report(report);
        self.moment += self.barrier.take_came();
        if verdict == Verdict::Counted {
            debug_assert!(self.ended.at.is_none(), "the tick before is not recorded");
            let robot = report.robot;
            let told = &self.messages[robot.index()];
            self.answers.take(&told.readings, report);
            // Before the next robot is asked, and hears of it.
            if self.steps_in_order() && self.schedule.waiting().next().is_some() {
                self.trigger_by_report(report);
            }
            self.settle();
        }
        verdict
    }

    /// Whether the robot's mind is a program of its own.
    #[must_use]
    pub fn is_foreign(&self, robot: RobotId) -> bool {
        self.foreign.get(robot.index()).is_some_and(|is| *is)
    }

    /// A broadcast of a robot whose mind is a program of its own, before the report that lists it: it is kept for the log. Nothing
    /// else becomes of it here.
    pub fn overhear(&mut self, broadcast: Broadcast) {
        let robots = self.foreign.iter().filter(|is| **is).count();
        let has_room = self.said.len() < robots * usize::from(MAX_BROADCASTS);
        if has_room && self.is_foreign(broadcast.sender) && broadcast.tick == self.tick() {
            self.said.push(broadcast);
        }
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

    /// What robots are at, for faults of the next tick that befall a role. It follows from what is logged of this tick alone.
    fn note_reported(&mut self, answers: &[Answer], inputs: &[Input]) {
        self.reported.fill(None);
        for answer in answers.iter().filter(|answer| answer.counts) {
            let report = &answer.report;
            let has_died = inputs.iter().any(|input| match input {
                Input::Gone {
                    robot, incarnation, ..
                } => {
                    *incarnation == report.incarnation
                        && self.robot_named(robot) == Some(report.robot)
                }
                _ => false,
            });
            self.reported[report.robot.index()] = (!has_died).then_some(report.active);
        }
    }

    /// What the run remembers of the answers that count.
    fn take_note(&mut self, now: SimTime, answers: &[Answer], inputs: &mut Vec<Input>) {
        let mut hits: Vec<FaultIndex> = Vec::new();
        for answer in answers.iter().filter(|answer| answer.counts) {
            let report = &answer.report;
            self.active[report.robot.index()] = report.active;
            self.memories.remember(now, report, &self.setup);
            if !answer.deliveries.are_usual() {
                self.note_losses(report, inputs);
                self.note_hits(report, &mut hits);
            }
        }
        for fault in hits {
            self.hit(fault, 1);
        }
        if !inputs.is_empty() {
            tracing::debug!(tick = self.barrier.tick() - 1, ?inputs, "inputs");
        }
    }

    /// What link faults have done to messages.
    fn note_hits(&self, report: &Report, hits: &mut Vec<FaultIndex>) {
        for reception in &report.receptions {
            if reception.delivery != Delivery::Heard {
                hits.extend(self.links.causes(report.robot, reception));
            }
        }
    }

    /// Losses that nobody asked for are inputs: a replay repeats them.
    fn note_losses(&mut self, report: &Report, inputs: &mut Vec<Input>) {
        let mut index = 0;
        let mut before = None;
        for reception in &report.receptions {
            // Receptions come by (sender, tick, index): the index starts again with each sender and tick.
            let from = Some((reception.sender, reception.sent));
            index = if from == before { index + 1 } else { 0 };
            before = from;
            if reception.delivery == Delivery::Lost {
                self.unscripted = true;
                inputs.push(Input::Lost {
                    receiver: self.name(report.robot).to_owned(),
                    sender: self.name(reception.sender).to_owned(),
                    sent_tick: reception.sent.0 / self.setup.scenario.step_ms,
                    index,
                });
            }
        }
    }

    /// Whether ids and numbers of a report are such as an agent of this run would send.
    fn is_well_formed(&self, report: &Report) -> bool {
        let robots = self.setup.scenario.robots.len();
        let (sets, tasks) = (
            self.setup.catalog.sets.len(),
            self.setup.catalog.tasks.len(),
        );
        let threshold = self.setup.alliance.threshold;
        report.robot.index() < robots
            && report.active.is_none_or(|active| active.index() < sets)
            && report.motivations.len() <= sets
            && report.allocation.len() <= sets
            && report.allocation.iter().all(|row| {
                row.task.index() < tasks
                    && row.behavior.index() < sets
                    && row.utility.is_finite()
                    && row.holder.is_none_or(|holder| holder.index() < robots)
            })
            && report.changes.len() <= 8 * sets
            && report.motivations.iter().all(|motivation| {
                motivation.set.index() < sets
                    && (0.0..=threshold).contains(&motivation.motivation)
                    && motivation.impatience.is_finite()
            })
            && report
                .changes
                .iter()
                .all(|change| change.set.index() < sets)
            && report.receptions.iter().all(|reception| {
                reception.sender.index() < robots
                    && reception.said.is_none_or(|said| {
                        said.set.is_none_or(|set| set.index() < sets)
                            && said.task.is_none_or(|task| task.index() < tasks)
                    })
            })
    }

    fn decide_outcome(&self) -> Option<Outcome> {
        let limit = SimTime::from_secs_f64(self.setup.scenario.limit_s);
        let end = self.world.mission().end(self.world.now());
        end.or_else(|| (self.world.now() >= limit).then_some(Outcome::TimeLimit))
    }

    /// Before anything changes the mission between two ticks: its figures are those of the tick that has ended, as all that is
    /// in the log.
    fn keep_figures(&mut self) {
        if self.ended.figures.is_none() {
            self.ended.figures = Some(Box::new(self.figures()));
        }
    }

    /// Those that the mission tells, how far it has come if it does not say so itself, and what energy all robots have used, if that is
    /// simulated.
    fn figures(&self) -> TeamFigures {
        let mut figures = TeamFigures::new(self.setup.scenario.robots.len());
        self.world.mission().figures(&mut figures);
        for column in self.mission_columns() {
            let counts = matches!(column.kind, ColumnKind::Done | ColumnKind::Left);
            if counts && figures.mission.column(&column.name).is_none() {
                figures.mission.add(&column.name, column.value);
            }
        }
        if let Some(energy) = &self.setup.scenario.energy {
            let left = self
                .barrier
                .robots()
                .filter_map(|it| self.world.energy_j(it));
            let used = left.map(|left_j| f64::from(energy.capacity_j - left_j));
            figures.mission.add("energy_used_j", used.sum::<f64>());
        }
        figures
    }

    /// The values of mission.csv now, in the order of its columns.
    #[must_use]
    pub fn mission_row(&self) -> Vec<Value> {
        let mut row = Vec::new();
        self.world.mission().row(&mut row);
        row
    }

    /// The same with their columns.
    #[must_use]
    pub fn mission_columns(&self) -> Vec<ColumnValue> {
        let columns = self.setup.catalog.mission.terms().columns.iter();
        let columns = columns.zip(self.mission_row());
        columns.map(|(column, value)| column.with(value)).collect()
    }

    /// What the end of the log tells of the run.
    #[must_use]
    pub fn ending(&self) -> Ending {
        let kept = self.ended.figures.as_deref().cloned();
        Ending {
            unscripted: self.unscripted,
            faults: self.faults(),
            figures: kept.unwrap_or_else(|| self.figures()),
        }
    }
}

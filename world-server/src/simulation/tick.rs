//! The steps of a tick, in the order in which they run.
//!
//! 1. [`Simulation::begin`]: faults, handlers and commands that are due take effect.
//! 2. [`Simulation::gather`]: external bodies get their poses, and the faults of links, devices and skills are fixed for the tick.
//! 3. [`Simulation::next_recipient`]: each robot gets its readings and its manifest.
//! 4. [`Simulation::report`]: the answers arrive.
//! 5. `settle`: after the last answer, triggers are evaluated and the kills of the tick begin.
//! 6. [`Simulation::finish`]: the counting reports move the world.
//! 7. [`Simulation::record`]: the log gets the tick.

use run_log::recorder::{Answers, BodyRecord};
use scenario::ids::RobotId;

use super::Simulation;
use super::ended_tick::EndedTick;
use crate::faults::schedule::Transition;
use crate::faults::skills::impairments;
use crate::world::Impairment;

/// The part of the current tick that runs. No part starts before the previous one is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TickPhase {
    /// Faults, handlers and commands take effect. No robot may be sent the tick yet.
    Changes { handlers_have_run: bool },
    /// Robots are sent the tick and report. New commands take effect in the next tick.
    Reports,
    /// All reports are here. The kills of the tick are carried out.
    Kills,
}

impl Default for TickPhase {
    fn default() -> Self {
        Self::Changes {
            handlers_have_run: false,
        }
    }
}

impl TickPhase {
    /// Checks whether changes can still take effect in this tick.
    #[inline]
    pub fn admits_changes(self) -> bool {
        matches!(self, Self::Changes { .. })
    }
}

impl Simulation {
    /// Applies everything that is due before the tick messages of the current tick are sent. Repeated calls are allowed.
    ///
    /// Due faults, handlers and commands run one after the other, each with its process actions. So the arrival time of a command
    /// before the tick has no effect, and a replay has the same result.
    #[inline]
    pub fn begin(&mut self) {
        // The rest is skipped for each robot after the first.
        if self.phase.admits_changes() && self.outcome.is_none() && self.barrier.started() {
            self.run_due_changes();
        }
    }

    fn run_due_changes(&mut self) {
        while self.acts.is_empty() {
            if let Some(transition) = self.next_transition() {
                self.order_index += 1;
                match transition {
                    Transition::Apply(fault) => self.apply(fault),
                    Transition::Heal(fault) => self.heal(fault),
                }
            } else if self.phase == TickPhase::default() {
                self.phase = TickPhase::Changes {
                    handlers_have_run: true,
                };
                self.run_handlers();
            } else if let Some(command) = self.commands.pop_front() {
                self.execute_command(command);
            } else {
                break;
            }
        }
        self.barrier
            .set_runs_without_participants(self.schedule.will_return_robots());
    }

    /// Starts to collect reports if any robot takes part. Otherwise the tick and its commands wait.
    #[inline]
    pub fn gather(&mut self) {
        if self.phase.admits_changes() && self.barrier.started() && !self.barrier.is_idle() {
            self.fix_faults();
        }
    }

    /// Fixes the link, sensor, actuator and skill faults of the tick.
    #[inline(never)]
    fn fix_faults(&mut self) {
        self.phase = TickPhase::Reports;
        self.order_index += 1;
        self.place_bodies();
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

    /// Returns the next robot that needs its tick message, which [`Simulation::message`] then returns.
    pub fn next_recipient(&mut self) -> Option<RobotId> {
        if !self.is_ready_to_send() {
            return None;
        }
        let Some(robot) = self.barrier.next_recipient(&*self.world) else {
            // There may be no robots at all.
            self.settle();
            return None;
        };
        self.prepare(robot);
        Some(robot)
    }

    /// Applies everything that is due before the tick is sent. Returns whether it may be sent now.
    pub(super) fn is_ready_to_send(&mut self) -> bool {
        self.begin();
        let is_ready = self.outcome.is_none() && self.acts.is_empty();
        if is_ready {
            self.gather();
        }
        is_ready
    }

    /// Evaluates triggers and kills if the tick's last report has been counted.
    #[inline]
    pub fn settle(&mut self) {
        // This runs after each report of a process, and after the reports of a team in one process.
        if self.phase == TickPhase::Reports && self.barrier.is_complete() {
            self.begin_kills();
        }
    }

    fn begin_kills(&mut self) {
        self.phase = TickPhase::Kills;
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
        self.outcome.is_none()
            && self.phase == TickPhase::Kills
            && self.barrier.is_complete()
            && self.acts.is_empty()
    }

    /// Ends the tick: the counting reports move the world. Call [`Simulation::record`] before the next report; it may run
    /// after the next tick messages are sent.
    pub fn finish(&mut self) {
        let mut ended = std::mem::take(&mut self.ended);
        let mut answers = std::mem::take(&mut self.answers);
        self.count_reports(&mut answers, &mut ended);
        self.apply_reports(&answers, &mut ended);
        self.move_bodies(&answers, &mut ended);
        self.undecodable.clear();
        let messages = self.allocation_messages.as_mut();
        ended.take_broadcasts(answers.all(), &mut self.broadcasts, messages);
        ended.figures = None;
        if answers.are_hashed() {
            ended.read_mission(self.world.mission());
        }
        self.answers = answers;
        self.ended = ended;
        self.schedule.end_tick();
        self.outcome = self.decide_outcome();
    }

    /// Decides which reports count, and begins the next tick of the barrier.
    fn count_reports(&mut self, answers: &mut Answers, ended: &mut EndedTick) {
        ended.at = Some((self.barrier.tick(), self.world.now()));
        self.barrier.finish(&*self.world, &mut ended.gathered);
        self.phase = TickPhase::default();
        self.order_index = 0;
        self.acts.end_tick();
        answers.count(&ended.gathered.counted);
    }

    /// Updates the run's state by the counting reports, and collects the inputs of the tick.
    fn apply_reports(&mut self, answers: &Answers, ended: &mut EndedTick) {
        ended.inputs.clear();
        ended.inputs.append(&mut self.inputs);
        ended.inputs.append(&mut ended.gathered.inputs);
        ended.inputs.append(&mut self.failures);
        self.update_from_answers(answers.all(), &mut ended.inputs);
        for robot in &ended.gathered.dead {
            self.active[robot.index()] = None;
        }
        self.record_reported(answers.all(), &ended.inputs);
    }

    /// Moves the bodies by the commands of the counting reports, and collects the events of the tick.
    fn move_bodies(&mut self, answers: &Answers, ended: &mut EndedTick) {
        ended.bodies.clear();
        if answers.are_hashed() {
            ended.bodies.extend(self.bodies());
        }
        let commands = &mut ended.commands;
        commands.clear();
        let reported = answers.all().iter();
        commands.extend(reported.map(|answer| answer.counts.then_some(answer.report.actuation)));
        for (robot, command) in self.barrier.robots().zip(&mut *commands) {
            let mission = self.world.mission();
            for fault in self.actuators.apply_to(mission, robot, command) {
                self.hit(fault, "");
            }
        }
        let mut happened = self.world.step(commands);
        self.count_impairment_hits();
        for robot in &ended.gathered.dead {
            happened.append(&mut self.world.release_load(*robot));
        }
        self.trigger_by_world(&happened, &ended.inputs);
        ended.events.clear();
        ended.events.append(&mut self.events);
        ended.hits.clear();
        ended.hits.append(&mut self.hits);
        ended.events.append(&mut happened);
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

    /// Counts hits of the faults that impaired a skill in the last step.
    fn count_impairment_hits(&mut self) {
        let acted = |impairment: &Impairment| impairment.was_used;
        if !self.world.impairments().iter().any(acted) {
            // Most runs have no impairments.
            return;
        }
        // No fault has begun or ended since the faults of the tick were fixed.
        let faults = impairments(self.schedule.in_force(), &self.setup.roster);
        let pairs = faults.zip(self.world.impairments());
        let hits =
            pairs.filter_map(|((fault, _), impairment)| impairment.was_used.then_some(fault));
        for fault in hits.collect::<Vec<_>>() {
            self.hit(fault, "");
        }
    }
}

//! The part of a tick that concerns one robot: its message, its readings, and the check and hash of its report. All robots
//! share [`TickContext`], which no robot changes, so several threads may run this part for different robots.

use proto::tick::{Report, TickMessage};
use run_log::recorder::{Answer, SectionHash};
use scenario::Setup;
use scenario::ids::RobotId;

use super::Simulation;
use super::ground_truth::GroundTruth;
use crate::barrier::{MAX_BROADCASTS, Verdict, sort_manifest};
use crate::faults::links::LinkFaults;
use crate::world::World;

/// The data of a tick that all robots read.
#[derive(Clone, Copy)]
pub struct TickContext<'a> {
    setup: &'a Setup,
    world: &'a World,
    links: &'a LinkFaults,
    ground_truth: &'a GroundTruth,
}

impl TickContext<'_> {
    /// Completes the message of a robot that [`Simulation::next_unprepared`] returned: links, ground truth and readings.
    pub fn prepare(&self, robot: RobotId, message: &mut TickMessage, answer: &mut Answer) {
        self.complete(robot, message);
        self.write_readings(robot, message, answer);
    }

    fn complete(&self, robot: RobotId, message: &mut TickMessage) {
        sort_manifest(&mut message.manifest);
        for entry in &mut message.manifest {
            let channel = self.world.channel(entry.sender, robot);
            let faults = self.links.state(entry.sender, robot);
            let state = faults.map_or(channel, |faults| faults.and(channel));
            entry.link = (!state.is_clear()).then(|| Box::new(state));
        }
        self.links.write_held_senders(robot, &mut message.held);
        self.ground_truth
            .write_offers(robot, &mut message.ground_truth);
    }

    /// Writes the readings of intact sensors, unless the latest ones hold.
    fn write_readings(&self, robot: RobotId, message: &mut TickMessage, answer: &mut Answer) {
        if !self.world.readings_are_valid(robot) {
            answer.mark_readings_changed();
            self.world.write_readings(robot, &mut message.readings);
        }
    }

    /// Checks the report of a robot that was sent this message, and stores and hashes it. Returns `false` for a malformed
    /// report, which is not stored. [`Simulation::count_stored`] follows in order of rank.
    pub fn store(
        &self,
        message: &TickMessage,
        report: &Report,
        answer: &mut Answer,
        hash: &mut SectionHash,
    ) -> bool {
        let is_valid = is_well_formed(report, self.setup) && report.broadcasts <= MAX_BROADCASTS;
        if is_valid {
            answer.update(hash, &message.readings, report);
        }
        is_valid
    }
}

/// Checks whether the ids and numbers of a report are valid in a run.
pub(super) fn is_well_formed(report: &Report, setup: &Setup) -> bool {
    let robots = setup.scenario.robots.len();
    let (sets, tasks) = (setup.catalog.sets.len(), setup.catalog.tasks.len());
    let threshold = setup.alliance.threshold;
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
            // The content of a received message is the sender's.
            reception.sender.index() < robots
        })
}

impl Simulation {
    /// Returns the next robot that needs its tick message, like [`Simulation::next_recipient`]. [`TickContext::prepare`] must
    /// complete the message, unless [`Simulation::readings_are_intact`] is false: then the message is complete.
    pub fn next_unprepared(&mut self) -> Option<RobotId> {
        let robot = self.next_asked()?;
        if !self.readings_are_intact() {
            self.prepare(robot);
        }
        Some(robot)
    }

    /// Returns whether no sensor has been broken so far. The readings of robots then depend on the world alone.
    #[must_use]
    pub fn readings_are_intact(&self) -> bool {
        self.sensors.never_broken()
    }

    /// Returns the data that all robots of the tick share, and the messages and answers by rank.
    pub fn split(&mut self) -> (TickContext<'_>, &mut [TickMessage], &mut [Answer]) {
        let context = TickContext {
            setup: &self.setup,
            world: &self.world,
            links: &self.links,
            ground_truth: &self.ground_truth,
        };
        (context, &mut self.messages, self.answers.all_mut())
    }

    /// Completes the message of a robot.
    pub(super) fn prepare(&mut self, robot: RobotId) {
        let is_intact = self.readings_are_intact();
        let (context, messages, answers) = self.split();
        let (message, answer) = (&mut messages[robot.index()], &mut answers[robot.index()]);
        if is_intact {
            context.prepare(robot, message, answer);
            return;
        }
        context.complete(robot, message);
        // Distorted readings differ from the sensed ones, which therefore never hold.
        answer.mark_readings_changed();
        context.world.write_readings(robot, &mut message.readings);
        let message = &mut self.messages[robot.index()];
        let hits = self.sensors.distort(
            self.world.mission(),
            robot,
            message.tick,
            &mut message.readings,
        );
        for fault in hits {
            self.hit(fault, "");
        }
    }

    /// Counts a report that [`TickContext::store`] has stored. The robot must not be in a team that steps in order, and no
    /// robot of the team has an external controller.
    pub fn count_stored(&mut self, robot: RobotId) {
        self.set_order_index();
        let verdict = self.barrier.report(self.answers.report(robot));
        debug_assert_eq!(verdict, Verdict::Counted, "{robot} was sent the tick");
        self.order_index += self.barrier.take_external_count();
        self.settle();
    }
}

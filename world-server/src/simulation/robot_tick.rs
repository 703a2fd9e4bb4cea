//! The part of a tick that concerns one robot: its message, its readings, and the check and hash of its report. All robots
//! share [`TickContext`], which no robot changes, so several threads may run this part for different robots.

use proto::tick::{Report, TickMessage};
use run_log::recorder::{Answer, SectionHash};
use scenario::Setup;
use scenario::ids::{RobotId, Tick};

use super::Simulation;
use super::ground_truth::GroundTruth;
use crate::barrier::{MAX_BROADCASTS, RobotSlot, sort_manifest};
use crate::faults::links::LinkFaults;
use crate::world::World;

/// The data of a tick that all robots read.
#[derive(Clone, Copy)]
pub struct TickContext<'a> {
    setup: &'a Setup,
    world: &'a World,
    links: &'a LinkFaults,
    ground_truth: &'a GroundTruth,
    tick: Tick,
}

/// The data of a tick that belong to robots with adjacent ranks. Threads may use different parts at the same time.
pub struct TeamPart<'a> {
    first: usize,
    places: &'a mut [RobotSlot],
    messages: &'a mut [TickMessage],
    answers: &'a mut [Answer],
}

impl<'a> TeamPart<'a> {
    /// Splits the part into parts of `size` robots; the last one may be smaller.
    pub fn chunks(self, size: usize) -> impl Iterator<Item = TeamPart<'a>> + Send {
        let parts = self
            .places
            .chunks_mut(size)
            .zip(self.messages.chunks_mut(size));
        let parts = parts.zip(self.answers.chunks_mut(size)).enumerate();
        parts.map(move |(index, ((places, messages), answers))| TeamPart {
            first: self.first + index * size,
            places,
            messages,
            answers,
        })
    }

    /// Returns the index of a robot of this part in it.
    #[must_use]
    pub fn index_of(&self, robot: RobotId) -> usize {
        robot.index() - self.first
    }

    /// Returns the robots of this part among `robots`, which are in order of rank.
    #[must_use]
    pub fn among<'r>(&self, robots: &'r [RobotId]) -> &'r [RobotId] {
        let end = self.first + self.places.len();
        let from = robots.partition_point(|robot| robot.index() < self.first);
        let to = robots.partition_point(|robot| robot.index() < end);
        &robots[from..to]
    }

    /// Returns the message of a robot of this part.
    #[must_use]
    pub fn message(&self, robot: RobotId) -> &TickMessage {
        &self.messages[self.index_of(robot)]
    }

    /// Writes the message of a robot that [`Simulation::take_recipients`] returned: manifest, links, ground truth and
    /// readings. Not if a sensor was ever broken: then the message is complete.
    pub fn prepare(&mut self, context: &TickContext<'_>, robot: RobotId) {
        let place = self.index_of(robot);
        let (message, answer) = (&mut self.messages[place], &mut self.answers[place]);
        context.address(&mut self.places[place], message);
        context.complete(robot, message);
        context.write_readings(robot, message, answer);
    }

    /// Checks the report of a robot that was sent this tick, and stores, hashes and counts it. Returns `false` for a malformed
    /// report, which is not stored. No robot of the team has an external controller, and the team does not step in order.
    pub fn store(
        &mut self,
        context: &TickContext<'_>,
        report: &Report,
        hash: &mut SectionHash,
    ) -> bool {
        let place = self.index_of(report.robot);
        let is_valid = is_well_formed(report, context.setup) && report.broadcasts <= MAX_BROADCASTS;
        if is_valid {
            self.answers[place].update(hash, &self.messages[place].readings, report);
            self.places[place].count(report);
        }
        is_valid
    }
}

impl TickContext<'_> {
    fn address(&self, place: &mut RobotSlot, message: &mut TickMessage) {
        place.address(self.tick, message);
        message.now = self.world.now();
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
    /// Moves all robots that need the tick's message into `recipients`, like [`Simulation::next_recipient`].
    /// [`TeamPart::prepare`] must write their messages if [`Simulation::readings_are_intact`]; otherwise they are complete.
    pub fn take_recipients(&mut self, recipients: &mut Vec<RobotId>) {
        recipients.clear();
        if self.is_ready_to_send() {
            self.barrier.take_recipients(&*self.world, recipients);
        }
        if !self.readings_are_intact() {
            for robot in &*recipients {
                self.prepare(*robot);
            }
        }
    }

    /// Returns whether no sensor has been broken so far. The readings of robots then depend on the world alone.
    #[must_use]
    pub fn readings_are_intact(&self) -> bool {
        self.sensors.never_broken()
    }

    /// Returns the data that all robots of the tick share, and the data of each.
    pub fn split(&mut self) -> (TickContext<'_>, TeamPart<'_>) {
        let context = TickContext {
            setup: &self.setup,
            world: &self.world,
            links: &self.links,
            ground_truth: &self.ground_truth,
            tick: self.barrier.tick(),
        };
        let team = TeamPart {
            first: 0,
            places: self.barrier.places_mut(),
            messages: &mut self.messages,
            answers: self.answers.all_mut(),
        };
        (context, team)
    }

    /// Writes the message of a robot.
    pub(super) fn prepare(&mut self, robot: RobotId) {
        let is_intact = self.readings_are_intact();
        let (context, mut team) = self.split();
        if is_intact {
            team.prepare(&context, robot);
            return;
        }
        let index = robot.index();
        let (message, answer) = (&mut team.messages[index], &mut team.answers[index]);
        context.address(&mut team.places[index], message);
        context.complete(robot, message);
        // Distorted readings differ from the sensed ones, which therefore never hold.
        answer.mark_readings_changed();
        context.world.write_readings(robot, &mut message.readings);
        let message = &mut self.messages[index];
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
}

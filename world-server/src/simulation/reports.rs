//! Reports of robots: their check, the faults that they trigger and the state that the run keeps.

use proto::codec::{LIMIT_BYTES, encoded_len};
use proto::team::{Broadcast, BroadcastContent};
use proto::telemetry::Delivery;
use proto::tick::Report;
use run_log::Input;
use scenario::ids::{Incarnation, RobotId};

use super::Simulation;
use super::robot_tick::is_well_formed;
use crate::barrier::{MAX_BROADCASTS, Verdict};
use crate::faults::schedule::FaultIndex;
use run_log::recorder::Answer;

/// The limit of an external controller's answers in foreign.bin, bytes before compression. A controller that exceeds it
/// is dismissed. Usual answers of a few hundred bytes reach it after days of simulated time.
pub(super) const ANSWER_BYTES_MAX: u64 = 1024 * 1024 * 1024;

impl Simulation {
    /// Processes an agent's report.
    pub fn report(&mut self, report: &Report) -> Verdict {
        if self.check(report).is_err() {
            return Verdict::Malformed;
        }
        self.set_order_index();
        let verdict = self.barrier.report(report);
        self.order_index += self.barrier.take_external_count();
        if verdict == Verdict::Counted {
            debug_assert!(self.ended.at.is_none(), "the tick before is not recorded");
            let robot = report.robot;
            if self.has_external_controller(robot) {
                self.answer_bytes[robot.index()] += self.answer_len(report);
            }
            let message = &self.messages[robot.index()];
            self.answers.store(&message.readings, report);
            // This precedes the next robot's tick message, which lists the broadcasts of this robot.
            if self.steps_in_order() && self.schedule.waiting().next().is_some() {
                self.trigger_by_report(report);
            }
            self.settle();
        }
        verdict
    }

    /// Checks whether the robot has an external controller.
    #[must_use]
    pub fn has_external_controller(&self, robot: RobotId) -> bool {
        self.external
            .get(robot.index())
            .is_some_and(|external| *external)
    }

    /// Keeps a broadcast of an external controller before the report that lists it, for the check of that report and for the log.
    pub fn keep_broadcast(&mut self, broadcast: Broadcast) {
        // Each index is kept once, so that no broadcast displaces another one.
        let is_same =
            |kept: &Broadcast| (kept.sender, kept.index) == (broadcast.sender, broadcast.index);
        if self.has_external_controller(broadcast.sender)
            && self.barrier.incarnation(broadcast.sender) == Some(broadcast.incarnation)
            && broadcast.tick == self.tick()
            && broadcast.index < MAX_BROADCASTS
            && !self.broadcasts.iter().any(is_same)
        {
            self.broadcasts.push(broadcast);
        }
    }

    /// Records the contents of allocators' messages from now on. [`Simulation::keep_allocation_message`] adds them.
    pub fn record_allocation_messages(&mut self) {
        self.allocation_messages = Some(vec![Vec::new(); self.setup.scenario.robots.len()]);
    }

    /// Leaves out from now on what only a recorder needs: hashes of reports, states of bodies and the mission's values.
    pub fn omit_records(&mut self) {
        self.answers.omit_hashes();
    }

    /// Returns whether the contents of allocators' messages are recorded.
    #[must_use]
    pub fn records_allocation_messages(&self) -> bool {
        self.allocation_messages.is_some()
    }

    /// Keeps a broadcast for the log if it is a message of an allocator, before the report that lists it. A repeated answer
    /// sends its messages again. Each sender has its own limit, so that none displaces the messages of another one.
    pub fn keep_allocation_message(&mut self, broadcast: &Broadcast) {
        let tick = self.tick();
        let sender = broadcast.sender.index();
        let messages = self.allocation_messages.as_mut();
        let identity = |broadcast: &Broadcast| (broadcast.incarnation, broadcast.index);
        if let Some(kept) = messages.and_then(|messages| messages.get_mut(sender))
            && matches!(broadcast.body, BroadcastContent::Allocation(_))
            && broadcast.tick == tick
            && kept.len() < usize::from(MAX_BROADCASTS)
            && !kept
                .iter()
                .any(|kept| identity(kept) == identity(broadcast))
        {
            kept.push(broadcast.clone());
        }
    }

    /// Marks the next report of an external controller as malformed, because a broadcast that it sent before cannot be decoded.
    pub fn refuse_broadcast(&mut self, sender: RobotId, why: String) {
        if self.has_external_controller(sender)
            && self.undecodable.iter().all(|(known, _)| *known != sender)
        {
            self.undecodable.push((sender, why));
        }
    }

    /// Checks the contents of a report, and the broadcasts that an external controller has sent before it. The senders of
    /// received messages are responsible for the contents of these messages, so the report may repeat any of them.
    ///
    /// # Errors
    /// Returns the first problem.
    pub fn check(&self, report: &Report) -> Result<(), String> {
        if !is_well_formed(report, &self.setup) {
            return Err("impossible contents".to_owned());
        }
        let undecodable = self
            .undecodable
            .iter()
            .find(|(sender, _)| *sender == report.robot);
        if let Some((_, why)) = undecodable {
            return Err(format!("a broadcast that cannot be decoded: {why}"));
        }
        if self.answer_bytes[report.robot.index()] > ANSWER_BYTES_MAX {
            let mib = ANSWER_BYTES_MAX / (1024 * 1024);
            return Err(format!("its answers exceed {mib} MiB, the limit of a run"));
        }
        let catalog = &self.setup.catalog;
        let (sets, tasks) = (catalog.sets.len(), catalog.tasks.len());
        let sent = self.sent_before(report);
        let unknown = |broadcast: &Broadcast| {
            let number = broadcast.unknown_number(sets, tasks)?;
            Some(format!("broadcast {}: {number}", broadcast.index))
        };
        sent.map(unknown)
            .find_map(|problem| problem)
            .map_or(Ok(()), Err)
    }

    /// Returns the broadcasts of an external controller that belong to a report.
    fn sent_before(&self, report: &Report) -> impl Iterator<Item = &Broadcast> {
        let sender = (report.robot, report.incarnation);
        let broadcasts = self.broadcasts.iter();
        broadcasts.filter(move |broadcast| (broadcast.sender, broadcast.incarnation) == sender)
    }

    /// Returns the size of an external controller's answer in foreign.bin before compression, bytes.
    fn answer_len(&self, report: &Report) -> u64 {
        let broadcasts = self.sent_before(report).map(encoded_len);
        let lengths = broadcasts.chain([encoded_len(report)]);
        // A message above the limit of the codec ends the log with an error.
        lengths
            .map(|length| length.unwrap_or(LIMIT_BYTES) as u64)
            .sum()
    }

    /// Updates the run's state by the answers that count.
    pub(super) fn update_from_answers(&mut self, answers: &[Answer], inputs: &mut Vec<Input>) {
        let now = self.world.now();
        let mut hits: Vec<FaultIndex> = Vec::new();
        for answer in answers.iter().filter(|answer| answer.counts) {
            let report = &answer.report;
            self.active[report.robot.index()] = report.active;
            self.memories.remember(now, report, &self.setup);
            if !answer.deliveries.all_in_time() {
                self.record_losses(report, inputs);
                self.collect_hits(report, &mut hits);
            }
        }
        for fault in hits {
            self.hit(fault, "");
        }
        if !inputs.is_empty() {
            tracing::debug!(tick = self.barrier.tick() - 1, ?inputs, "inputs");
        }
    }

    /// Records the active behavior sets for faults of roles in the next tick. They follow from the log of this tick alone.
    pub(super) fn record_reported(&mut self, answers: &[Answer], inputs: &[Input]) {
        self.reported.fill(None);
        let gone = inputs.iter().filter_map(|input| match input {
            Input::Gone {
                robot, incarnation, ..
            } => Some((self.robot_named(robot)?, *incarnation)),
            _ => None,
        });
        let gone: Vec<(RobotId, Incarnation)> = gone.collect();
        for answer in answers.iter().filter(|answer| answer.counts) {
            let report = &answer.report;
            let has_died = gone.contains(&(report.robot, report.incarnation));
            self.reported[report.robot.index()] = (!has_died).then_some(report.active);
        }
    }

    /// Collects the faults that changed the delivery of messages.
    fn collect_hits(&self, report: &Report, hits: &mut Vec<FaultIndex>) {
        for reception in &report.receptions {
            if reception.delivery != Delivery::Received {
                hits.extend(self.links.causes(report.robot, reception));
            }
        }
    }

    /// Counts missed messages, and adds losses outside the scenario to the inputs, so that a replay repeats them.
    fn record_losses(&mut self, report: &Report, inputs: &mut Vec<Input>) {
        let mut index = 0;
        let mut before = None;
        for reception in &report.receptions {
            // Receptions are ordered by (sender, tick, index); the index restarts with each sender and tick.
            let from = Some((reception.sender, reception.sent));
            index = if from == before { index + 1 } else { 0 };
            before = from;
            self.messages_dropped += u64::from(reception.delivery.is_missed());
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
}

//! Repeated ticks. The bus drops messages if a queue is full, and world and agent would then wait for each other.

use std::time::Duration;

use proto::tick::{TICK_LIMIT_BYTES, ToAgent};
use scenario::ids::{RobotId, Tick};
use tokio::time::Instant;
use zenoh::Wait;
use zenoh::bytes::ZBytes;

use super::Server;
use crate::barrier::Presence;

/// The time without an answer after which a tick is sent again. It is longer than a step on a busy machine, and shorter than the
/// default stall deadline.
const PATIENCE: Duration = Duration::from_secs(2);

pub(super) struct SentTick {
    tick: Tick,
    sealed: ZBytes,
    sent: Instant,
    again: bool,
}

impl Server {
    /// Sends the current tick to a robot and stores the message for repetitions.
    pub(super) fn send_tick(&mut self, robot: RobotId, now: Instant) {
        let tick = self.simulation.message(robot);
        let message = ToAgent::Tick {
            tick,
            ground_truth: tick.ground_truth.clone(),
            broadcasts: self.broadcasts.encoded(&tick.manifest),
        };
        let peer = &mut self.peers[robot.index()];
        let (secret, key) = (self.seals.robot(robot), peer.ticks.key_expr());
        match secret.seal_within::<_, TICK_LIMIT_BYTES>(key, &message) {
            Ok(bytes) => {
                peer.question = Some(SentTick {
                    tick: self.simulation.tick(),
                    sealed: bytes.into(),
                    sent: now,
                    again: false,
                });
                self.put(robot);
            }
            Err(error) => tracing::error!(%error, robot = peer.name, "not published"),
        }
    }

    /// Sends the latest tick again to robots that have not answered for a long time but may still do so. A robot that has already
    /// stepped in that tick repeats its report.
    pub(super) fn resend_ticks(&mut self, now: Instant) {
        let barrier = self.simulation.barrier();
        let may_answer = |robot: RobotId| {
            barrier.is_awaited(robot) || barrier.presence(robot) == Presence::Silent
        };
        let mut due = Vec::new();
        for (robot, peer) in barrier.robots().zip(&self.peers) {
            if let Some(question) = &peer.question
                && now - question.sent > PATIENCE
                && may_answer(robot)
                && !peer.stopped
            {
                due.push(robot);
            }
        }
        for robot in due {
            self.send_again(robot, now);
        }
    }

    /// Notes that the process of a robot continues. If the robot was silent, it is asked again, because a report from before the
    /// stop did not count.
    pub(super) fn continue_agent(&mut self, robot: RobotId) {
        self.peers[robot.index()].stopped = false;
        if self.simulation.barrier().presence(robot) == Presence::Silent {
            self.send_again(robot, Instant::now());
        }
    }

    /// Sends the latest tick to a robot again. The robot then repeats its answer.
    pub(super) fn send_again(&mut self, robot: RobotId, now: Instant) {
        if let Some(question) = &mut self.peers[robot.index()].question {
            question.sent = now;
            question.again = true;
        }
        self.put(robot);
    }

    /// Returns `true` if a report of that tick may be the answer to a repeated message.
    pub(super) fn was_resent(&self, robot: RobotId, tick: Tick) -> bool {
        let question = &self.peers[robot.index()].question;
        question
            .as_ref()
            .is_some_and(|question| question.again && tick <= question.tick)
    }

    fn put(&self, robot: RobotId) {
        let peer = &self.peers[robot.index()];
        if let Some(question) = &peer.question
            && let Err(error) = peer.ticks.put(question.sealed.clone()).wait()
        {
            tracing::error!(%error, robot = peer.name, "not published");
        }
    }
}

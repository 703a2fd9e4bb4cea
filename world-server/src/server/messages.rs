//! Messages of robots and of their hosts' launchers: reports, broadcasts and process states.

use proto::keys::KeyExpressions;
use proto::process::{ProcessNews, ProcessState};
use proto::secret::OpenError;
use proto::team::Broadcast;
use proto::tick::{Report, ToAgent};
use scenario::ids::{Incarnation, RobotId, Tick};
use tokio::time::Instant;

use super::Server;
use crate::barrier::{MAX_BROADCASTS, Presence, Verdict};

impl Server {
    /// Handles a report, or an invalid message, that arrived on this key.
    pub fn report(&mut self, key: &str, report: Result<Report, OpenError>) {
        let mut report = match report {
            Ok(report) => report,
            Err(error) => return self.refuse("report", &error),
        };
        let name = self.keys.parse_robot(key).unwrap_or_default().to_owned();
        if self.robot_named(&name) != Some(report.robot) {
            return self.refuse("report", &"on another robot's key");
        }
        let (robot, incarnation) = (report.robot, report.incarnation);
        let is_external = self.simulation.has_external_controller(robot);
        let mut checked = None;
        // Only a report for the current tick can count.
        if is_external && self.simulation.barrier().is_awaited(robot) {
            let (message, setup) = (self.simulation.message(robot), self.simulation.setup());
            let broadcasts = &self.broadcasts;
            match self
                .delivery_check
                .check(message, broadcasts, &report, setup)
            {
                Ok(deliveries) => checked = Some(deliveries),
                Err(why) => return self.dismiss(robot, &report, &why),
            }
        }
        if self.waits_for_broadcasts(&mut report) || self.may_precede_stop(&report) {
            return;
        }
        match self.simulation.report(&report) {
            Verdict::Counted => {
                self.peers[robot.index()].asked = None;
                if let Some(checked) = checked {
                    self.delivery_check.store_links(&report, checked);
                }
            }
            Verdict::SilenceEnded => {
                tracing::info!(robot = name, "agent answers again");
            }
            Verdict::Superseded => {
                self.send(robot, &ToAgent::Dismissed(incarnation));
                return self.refuse("report", &"from a superseded incarnation");
            }
            Verdict::Stale if self.was_resent(robot, report.tick) => return,
            Verdict::Stale => return self.refuse("report", &"stale"),
            Verdict::Malformed => {
                let why = self.simulation.check(&report).err();
                let why = why.unwrap_or_else(|| "impossible contents".to_owned());
                if is_external {
                    return self.dismiss(robot, &report, &why);
                }
                return self.refuse("report", &why);
            }
        }
        self.advance();
    }

    /// Returns `true` if an agent whose process is stopped may have sent the report before the stop. Such a report does
    /// not bring the robot back. When the process continues, the robot is asked again.
    fn may_precede_stop(&self, report: &Report) -> bool {
        self.peers[report.robot.index()].stopped
            && self.simulation.barrier().presence(report.robot) == Presence::Silent
    }

    /// Returns whether a message of a robot belongs to its answer to the current tick, which is not complete.
    fn is_due(&self, robot: RobotId, incarnation: Incarnation, tick: Tick) -> bool {
        let barrier = self.simulation.barrier();
        barrier.is_awaited(robot)
            && barrier.incarnation(robot) == Some(incarnation)
            && barrier.tick() == tick
    }

    /// Returns `true` if a robot is asked to repeat its answer, because its report lists broadcasts that have not arrived.
    /// If they are missing after the repetition, too, they are lost. The report of an external controller then lists
    /// only those before the first gap, because the log contains no others.
    fn waits_for_broadcasts(&mut self, report: &mut Report) -> bool {
        let is_due = self.is_due(report.robot, report.incarnation, report.tick);
        if !is_due || report.broadcasts > MAX_BROADCASTS {
            return false;
        }
        let arrived = self.broadcasts.arrived(report);
        if arrived == report.broadcasts {
            return false;
        }
        if !self.was_resent(report.robot, report.tick) {
            self.send_again(report.robot, Instant::now());
            return true;
        }
        self.refuse("broadcast", &"listed in a report, but not sent before it");
        if self.simulation.has_external_controller(report.robot) {
            report.broadcasts = arrived;
        }
        false
    }

    /// Handles a broadcast on this key. It is passed on with the ticks that list it. Messages of allocators are recorded
    /// for a full log, and broadcasts of external controllers until the check of their report.
    pub fn broadcast(&mut self, key: &str, broadcast: Result<Broadcast, OpenError>) {
        let name = self.keys.parse_robot(key).unwrap_or_default();
        let sender = self.robot_named(name);
        let broadcast = match broadcast {
            Ok(broadcast) if sender == Some(broadcast.sender) => broadcast,
            Ok(_) => return self.refuse("broadcast", &"on another robot's key"),
            Err(error) => {
                // Only a sealed broadcast is certainly the sender's.
                if let (OpenError::Codec(error), Some(sender)) = (&error, sender) {
                    self.simulation.refuse_broadcast(sender, error.to_string());
                }
                return self.refuse("broadcast", &error);
            }
        };
        let (robot, tick) = (broadcast.sender, broadcast.tick);
        let is_due = self.is_due(robot, broadcast.incarnation, tick);
        if !is_due || broadcast.index >= MAX_BROADCASTS {
            if !self.was_resent(robot, tick) {
                self.refuse("broadcast", &"not of the current tick");
            }
            return;
        }
        self.simulation.keep_allocation_message(&broadcast);
        if self.simulation.has_external_controller(robot) {
            self.simulation.keep_broadcast(broadcast.clone());
        }
        if let Err(error) = self.broadcasts.store(broadcast) {
            self.refuse("broadcast", &error);
        }
    }

    /// Dismisses a controller after an invalid report. The run continues without it.
    fn dismiss(&mut self, robot: RobotId, report: &Report, why: &dyn std::fmt::Display) {
        let peer = &self.peers[robot.index()];
        tracing::warn!(robot = peer.name, tick = report.tick, %why, "controller dismissed");
        self.send(robot, &ToAgent::Dismissed(report.incarnation));
        self.refuse("report", why);
    }

    /// Handles a message about the state of an agent's process from the launcher of a host.
    pub fn process(&mut self, key: &str, payload: &[u8]) {
        let host = KeyExpressions::parse_sender(key);
        let opened = match self.seals.host(host) {
            Some(secret) => secret.open(&self.keys.process(host), payload),
            None => Err(OpenError::Unsealed),
        };
        let news: ProcessNews = match opened {
            Ok(news) => news,
            Err(error) => return self.refuse("process", &error),
        };
        let latest = self
            .latest_process_report
            .entry(host.to_owned())
            .or_default();
        if news.number <= *latest {
            return self.refuse("process", &"stale");
        }
        *latest = news.number;
        let Some(robot) = self.robot_named(&news.robot) else {
            return self.refuse("process", &"unknown robot");
        };
        if self.seals.host_of(robot) != host {
            return self.refuse("process", &"for a robot of another host");
        }
        self.peers[robot.index()].lost = news.state != ProcessState::Continued;
        if news.state == ProcessState::Ended {
            // The token reports the death of an agent. A process that has not joined has no token.
            self.fail_start(news.pid);
            return self.advance();
        }
        let peer = &self.peers[robot.index()];
        if peer.pid != Some(news.pid) && !self.simulation.barrier().started() {
            // The process has not yet requested to join.
            return;
        }
        if peer.pid != Some(news.pid) {
            return self.refuse("process", &"unknown process");
        }
        match news.state {
            ProcessState::Stopped => {
                self.peers[robot.index()].stopped = true;
                self.stall(robot);
            }
            ProcessState::Continued => self.continue_agent(robot),
            ProcessState::Ended => {}
        }
        self.advance();
    }
}

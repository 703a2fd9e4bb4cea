//! A description of the cause when the clock stands still, with a remedy.

use std::collections::BTreeMap;
use std::time::Duration;

use proto::keys::LAUNCHER_HOST;
use proto::process::ProcessAction;
use scenario::ids::{RobotId, Tick};
use scenario::listed;
use tokio::time::Instant;

use super::{NAMES, Server};
use crate::barrier::Presence;

/// The time that the clock stands still before the cause is reported.
const PATIENCE: Duration = Duration::from_secs(5);

/// A due tick that does not end, and the time since when.
pub(super) type Standstill = Option<(Tick, Instant)>;

impl Server {
    /// Updates the standstill. A paused clock, or one whose tick is not due, does not stand still.
    pub(super) fn update_standstill(&mut self, now: Instant) {
        let tick = self.simulation.tick();
        let is_due = self.begun == Some(tick) || self.pace.is_due(now);
        self.standstill = match self.standstill {
            Some((at, since)) if at == tick && is_due => Some((at, since)),
            _ => is_due.then_some((tick, now)),
        };
    }

    /// Returns the cause of a standstill that has lasted for [`PATIENCE`].
    pub(super) fn standstill_cause(&self) -> Option<String> {
        let (tick, since) = self.standstill?;
        let is_long = tick == self.simulation.tick() && since.elapsed() >= PATIENCE;
        is_long.then(|| self.describe_wait())
    }

    fn describe_wait(&self) -> String {
        const REMEDY: &str =
            "`kill -CONT` resumes a stopped process, `alliance fault restart` restarts a robot";
        if let Some((robot, act, started)) = self.act_under_way() {
            let name = &self.peers[robot.index()].name;
            return match (act, started) {
                (ProcessAction::Start, Some(pid)) => {
                    format!("{name} (process {pid}) to join; {REMEDY}")
                }
                _ => {
                    let act = act.as_str();
                    format!("the launcher to {act} {name}; `kill -CONT` resumes a stopped launcher")
                }
            };
        }
        if !self.awaited.is_empty() {
            let awaited = self.awaited.iter();
            let names: Vec<&str> = awaited
                .map(|robot| self.peers[robot.index()].name.as_str())
                .collect();
            return format!("{} to repeat the run and join", listed(&names, NAMES));
        }
        let barrier = self.simulation.barrier();
        if !barrier.started() {
            return self.describe_missing();
        }
        let is_awaited = |robot: &RobotId| barrier.is_awaited(*robot);
        let is_silent = |robot: &RobotId| barrier.presence(*robot) == Presence::Silent;
        let mut waiting_for: Vec<RobotId> = barrier.robots().filter(is_awaited).collect();
        if waiting_for.is_empty() {
            waiting_for = barrier.robots().filter(is_silent).collect();
        }
        if waiting_for.is_empty() {
            return format!("an agent; {REMEDY}");
        }
        let names: Vec<String> = waiting_for
            .iter()
            .map(|robot| self.process_of(*robot))
            .collect();
        format!("{} to answer; {REMEDY}", listed(&names, NAMES))
    }

    /// Names the hosts that have not connected and the robots that have not joined, with remedies.
    fn describe_missing(&self) -> String {
        let mut by_host: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for name in self.missing() {
            let robot = self.seals.rank(name);
            let host = robot.map_or(LAUNCHER_HOST, |robot| self.seals.host_of(robot));
            by_host.entry(host).or_default().push(name);
        }
        let mut remedies = Vec::new();
        let waits = by_host.iter().map(|(host, missing)| {
            let robots = listed(missing, NAMES);
            if *host == LAUNCHER_HOST {
                let (robot, run) = (missing[0], &self.run);
                remedies.push(format!(
                    "`alliance cluster agent --robot {robot} --run {run}` starts the agent of {robot}"
                ));
                format!("{robots} to join")
            } else if self.connected_hosts.contains(*host) {
                format!("{robots} of host {host} to join")
            } else {
                // The folder of the keys there, and with a wildcard the address, are unknown here.
                remedies.push(format!(
                    "start the daemon of {host} there, with this world's address and the keys of host-{host}"
                ));
                format!("host {host} ({robots}) to connect")
            }
        });
        let waits: Vec<String> = waits.collect();
        let mut text = waits.join(" and ");
        for remedy in remedies {
            text += &format!("; {remedy}");
        }
        text
    }

    /// Returns a robot's name, with its process id if known.
    fn process_of(&self, robot: RobotId) -> String {
        let peer = &self.peers[robot.index()];
        match peer.pid {
            Some(pid) => format!("{} (process {pid})", peer.name),
            None => peer.name.clone(),
        }
    }
}

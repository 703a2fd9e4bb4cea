//! For whom a clock that stands still waits, and what would help, in words for people.

use std::time::Duration;

use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::process::ProcessAct;
use tokio::time::Instant;

use super::Server;
use crate::barrier::Presence;

/// How long the clock may stand still before it is said why.
const PATIENCE: Duration = Duration::from_secs(5);

/// A tick that is due and does not end, and since when.
pub(super) type Standstill = Option<(Tick, Instant)>;

impl Server {
    /// Takes note of whether the clock moves. One that is held, or is not due yet, does not stand still.
    pub(super) fn watch_the_clock(&mut self, now: Instant) {
        let tick = self.simulation.tick();
        let is_due = self.begun == Some(tick) || self.pace.is_due(now);
        self.standstill = match self.standstill {
            Some((at, since)) if at == tick && is_due => Some((at, since)),
            _ => is_due.then_some((tick, now)),
        };
    }

    /// For whom the clock waits, once it has stood still for [`PATIENCE`].
    pub(super) fn waits_for(&self) -> Option<String> {
        let (tick, since) = self.standstill?;
        let is_long = tick == self.simulation.tick() && since.elapsed() >= PATIENCE;
        is_long.then(|| self.whom())
    }

    fn whom(&self) -> String {
        const CURE: &str = "`kill -CONT` lets a stopped process go on, `alliance fault restart` starts a robot anew";
        if let Some((robot, act, started)) = self.act_under_way() {
            let name = &self.peers[robot.index()].name;
            return match (act, started) {
                (ProcessAct::Start, Some(pid)) => format!("{name} (process {pid}) to join; {CURE}"),
                _ => {
                    let act = act.as_str();
                    format!(
                        "the launcher to {act} {name}; `kill -CONT` lets a stopped launcher go on"
                    )
                }
            };
        }
        let barrier = self.simulation.barrier();
        if !barrier.started() {
            let missing = self.missing().join(", ");
            return format!(
                "{missing} to join; `alliance agent --robot NAME` starts an agent by hand"
            );
        }
        let is_awaited = |robot: &RobotId| barrier.is_awaited(*robot);
        let is_silent = |robot: &RobotId| barrier.presence(*robot) == Presence::Silent;
        let mut whom: Vec<RobotId> = barrier.robots().filter(is_awaited).collect();
        if whom.is_empty() {
            whom = barrier.robots().filter(is_silent).collect();
        }
        if whom.is_empty() {
            return format!("an agent; {CURE}");
        }
        let names: Vec<String> = whom.iter().map(|robot| self.process_of(*robot)).collect();
        format!("{} to answer; {CURE}", names.join(", "))
    }

    /// A robot's name, and its process where that is known.
    fn process_of(&self, robot: RobotId) -> String {
        let peer = &self.peers[robot.index()];
        match peer.pid {
            Some(pid) => format!("{} (process {pid})", peer.name),
            None => peer.name.clone(),
        }
    }
}

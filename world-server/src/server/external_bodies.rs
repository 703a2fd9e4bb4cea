//! Bodies that move in another world: their newest poses and scans, and the commands for them.

use proto::control::{ClockCommand, ControlCommand};
use run_log::{BodyInput, ScanInput};
use scenario::Problem;
use scenario::ids::{RobotId, Tick};
use tokio::sync::watch;

use super::Server;
use crate::external_bodies::{BodyCommands, BridgeMessage, ExternalPose, ExternalScan, Velocity};

pub(super) struct ExternalBodies {
    /// The newest pose of each body, by rank.
    poses: Vec<Option<Newest<ExternalPose>>>,
    /// The newest scan of each body that has a scanner, by rank.
    scans: Vec<Option<Newest<ExternalScan>>>,
    commands: watch::Sender<BodyCommands>,
}

/// The newest message of a body on one topic.
#[derive(Clone)]
struct Newest<M> {
    message: M,
    /// The tick that used the message first.
    used: Option<Tick>,
}

impl<M> Newest<M> {
    fn store(places: &mut [Option<Self>], robot: RobotId, message: M) -> bool {
        let Some(place) = places.get_mut(robot.index()) else {
            return false;
        };
        *place = Some(Self {
            message,
            used: None,
        });
        true
    }

    /// Marks the message as used in a tick. Returns `true` if an earlier tick has used it.
    fn is_late(&mut self, tick: Tick) -> bool {
        *self.used.get_or_insert(tick) != tick
    }
}

impl Server {
    /// Takes the poses of all bodies from another world from now on. Their commands go to `commands`.
    pub fn connect_bodies(&mut self, commands: watch::Sender<BodyCommands>) {
        self.external_bodies = Some(ExternalBodies {
            poses: vec![None; self.peers.len()],
            scans: vec![None; self.peers.len()],
            commands,
        });
    }

    /// Handles a message of the bridge, or an invalid one.
    pub fn bridge_message(&mut self, message: serde_json::Result<BridgeMessage>) {
        let Some(bodies) = &mut self.external_bodies else {
            return;
        };
        let is_stored = match message {
            Ok(BridgeMessage::Pose(pose)) => Newest::store(&mut bodies.poses, pose.robot, pose),
            Ok(BridgeMessage::Scan(scan)) => Newest::store(&mut bodies.scans, scan.robot, scan),
            Ok(BridgeMessage::Ready | BridgeMessage::Refused(_)) => return,
            Err(error) => return self.refuse("pose", &error),
        };
        if is_stored {
            self.advance();
        }
    }

    /// Ends the run, because the bridge has ended and the bodies receive no more commands.
    pub fn lose_bodies(&mut self) {
        if self.ended.is_some() {
            tracing::error!("the bridge to the other world has ended; the run ends");
            self.interrupt();
        }
    }

    /// Returns `true` if the run waits for the first pose of an external body.
    pub(super) fn awaits_bodies(&self) -> bool {
        let bodies = self.external_bodies.iter();
        bodies.flat_map(|bodies| &bodies.poses).any(Option::is_none)
    }

    /// Sets the poses of external bodies for a tick that is about to begin.
    pub(super) fn place_bodies(&mut self, tick: Tick) {
        let Some(bodies) = &mut self.external_bodies else {
            return;
        };
        let messages = bodies.poses.iter_mut().zip(&mut bodies.scans);
        for ((pose, scan), peer) in messages.zip(&self.peers) {
            let Some(pose) = pose else { continue };
            let scan = scan.as_mut().map(|scan| ScanInput {
                stamp_ns: scan.message.stamp_ns,
                late: scan.is_late(tick),
                beams: scan.message.beams,
            });
            let late = pose.is_late(tick);
            let pose = &pose.message;
            self.simulation.place_body(BodyInput {
                robot: peer.name.clone(),
                x_m: pose.x_m,
                y_m: pose.y_m,
                heading_rad: pose.heading_rad,
                stamp_ns: pose.stamp_ns,
                late,
                scan,
            });
        }
    }

    /// Sends the commands of the last ended tick to the other world.
    pub(super) fn send_body_commands(&self) {
        let Some(bodies) = &self.external_bodies else {
            return;
        };
        let robots = self.simulation.barrier().robots();
        let velocities = robots.map(|robot| {
            let command = self.simulation.executed_command(robot);
            Velocity {
                speed_m_s: command.speed_m_s,
                turn_rad_s: command.turn_rad_s,
            }
        });
        bodies.commands.send_replace(BodyCommands {
            tick: self.simulation.tick() - 1,
            velocities: velocities.collect(),
        });
    }

    /// Refuses another speed of a run whose bodies move in real time.
    pub(super) fn check_for_bodies(&self, command: &ControlCommand) -> Result<(), Problem> {
        match command {
            ControlCommand::Clock(ClockCommand::Speed(_)) if self.external_bodies.is_some() => {
                let what = "the bodies move in another world, which cannot change its speed";
                Err(Problem::at(["speed"], what, "pause the clock instead"))
            }
            _ => Ok(()),
        }
    }
}

//! Bodies that move in another world: their newest poses, and the commands for them.

use proto::control::{ClockCommand, ControlCommand};
use run_log::BodyInput;
use scenario::Problem;
use scenario::ids::Tick;
use tokio::sync::watch;

use super::Server;
use crate::external_bodies::{BodyCommands, BridgeMessage, ExternalPose, Velocity};

pub(super) struct ExternalBodies {
    /// The newest pose of each body and the tick that used it first, by rank.
    poses: Vec<Option<(ExternalPose, Option<Tick>)>>,
    commands: watch::Sender<BodyCommands>,
}

impl Server {
    /// Takes the poses of all bodies from another world from now on. Their commands go to `commands`.
    pub fn connect_bodies(&mut self, commands: watch::Sender<BodyCommands>) {
        self.external_bodies = Some(ExternalBodies {
            poses: vec![None; self.peers.len()],
            commands,
        });
    }

    /// Handles a message of the bridge, or an invalid one.
    pub fn bridge_message(&mut self, message: serde_json::Result<BridgeMessage>) {
        let pose = match message {
            Ok(BridgeMessage::Pose(pose)) => pose,
            Ok(BridgeMessage::Ready | BridgeMessage::Refused(_)) => return,
            Err(error) => return self.refuse("pose", &error),
        };
        let bodies = self.external_bodies.as_mut();
        if let Some(place) = bodies.and_then(|bodies| bodies.poses.get_mut(pose.robot.index())) {
            *place = Some((pose, None));
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
        for (place, peer) in bodies.poses.iter_mut().zip(&self.peers) {
            let Some((pose, used)) = place else { continue };
            self.simulation.place_body(BodyInput {
                robot: peer.name.clone(),
                x_m: pose.x_m,
                y_m: pose.y_m,
                heading_rad: pose.heading_rad,
                stamp_ns: pose.stamp_ns,
                late: *used.get_or_insert(tick) != tick,
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

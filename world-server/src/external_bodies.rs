//! The messages of the bridge to another world, in which the bodies move: poses and scans come in, commands go out.
//!
//! The world's standard input is a socket to the bridge, which the launcher creates. Each message is one line of JSON.

use std::io;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream as StdUnixStream;

use proto::readings::Proximity;
use scenario::ids::{RobotId, Tick};
use serde::{Deserialize, Serialize};
use tokio::net::UnixStream;

/// A message of the bridge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BridgeMessage {
    /// All bodies have sent a pose. The run may start.
    Ready,
    /// The run cannot start, for this reason.
    Refused(String),
    /// The newest pose of a body.
    Pose(ExternalPose),
    /// The newest scan of a body.
    Scan(ExternalScan),
}

/// A pose of a body in the frame of the room.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExternalPose {
    /// The robot, as its rank.
    pub robot: RobotId,
    pub x_m: f32,
    pub y_m: f32,
    pub heading_rad: f32,
    /// The time of the pose by the clock of the other world, ns.
    pub stamp_ns: i64,
}

/// A scan around a body, as the reading of its collision avoidance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExternalScan {
    /// The robot, as its rank.
    pub robot: RobotId,
    pub beams: Proximity,
    /// The time of the scan by the clock of the other world, ns.
    pub stamp_ns: i64,
}

/// The commands of all bodies after a tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BodyCommands {
    /// The tick that decided the commands.
    pub tick: Tick,
    /// The commands, by rank.
    pub velocities: Vec<Velocity>,
}

/// The command of one body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Velocity {
    /// The speed ahead, m/s.
    pub speed_m_s: f32,
    /// The turn rate, positive to the left, rad/s.
    pub turn_rad_s: f32,
}

/// Returns the socket that this process has as its standard input.
///
/// # Errors
/// If the standard input is closed.
pub fn inherited() -> io::Result<UnixStream> {
    let socket = StdUnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
    socket.set_nonblocking(true)?;
    UnixStream::from_std(socket)
}

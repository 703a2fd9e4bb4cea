//! The handshake of an agent with the world (key `join`).

use serde::{Deserialize, Serialize};

use scenario::ids::{Incarnation, RobotId, Tick};

/// The version of all messages on the bus. Every incompatible change increases it.
pub const PROTOCOL_VERSION: u32 = 14;

/// Agent → world: a request to control a robot.
///
/// The version is the first field. If it differs, the rest is not decoded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinRequest {
    pub version: u32,
    pub robot: String,
    /// The process id of the agent, for people and for the launcher. The simulation does not use it.
    pub pid: u32,
    /// A random number. The world ignores repetitions of a request, and the answer is sealed for this request only.
    pub nonce: u128,
}

/// World → agent: the answer to a [`JoinRequest`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JoinReply {
    Welcome(Welcome),
    Refused(Refusal),
}

/// The data that an agent needs to start.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    pub robot: RobotId,
    pub incarnation: Incarnation,
    /// The earliest tick in which the agent may take part.
    pub first_tick: Tick,
    /// The [briefing](scenario::Setup::for_robots) of the run as JSON. Of the robots' ALLIANCE parameters and
    /// profiles it contains only those of this robot.
    pub setup: String,
}

/// The reason why an agent may not join.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    #[error("the scenario has no robot '{robot}'; its robots are {}", known.join(", "))]
    UnknownRobot { robot: String, known: Vec<String> },
    #[error("robot '{robot}' already has a live agent (incarnation {incarnation})")]
    Taken {
        robot: String,
        incarnation: Incarnation,
    },
    #[error(
        "the agent uses protocol version {agent}, the world uses {world}: start both from the same build"
    )]
    Version { agent: u32, world: u32 },
    /// The robot has not joined the mission yet, or has left it.
    #[error("robot '{robot}' is not in the mission; add it with `alliance fault add {robot}`")]
    Absent { robot: String },
    #[error("malformed join request")]
    Malformed,
    #[error("the run is over")]
    Over,
}

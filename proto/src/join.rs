//! The handshake of an agent with the world (DESIGN §3, key `join`).

use serde::{Deserialize, Serialize};

use crate::ids::{Incarnation, RobotId, Tick};

/// Version of everything that crosses the bus; raised with every incompatible change.
pub const PROTOCOL_VERSION: u32 = 10;

/// Agent → world: "I want to be this robot."
///
/// The version comes first and alone decides whether the rest is understood.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JoinRequest {
    /// [`PROTOCOL_VERSION`] of the agent.
    pub version: u32,
    /// Name of the robot.
    pub robot: String,
    /// Process id of the agent, for people and for the launcher; no part of the simulation.
    pub pid: u32,
    /// Random: a request that is put again is not a second one, and the answer is sealed for this one alone.
    pub nonce: u128,
}

/// World → agent.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum JoinReply {
    /// The robot is yours.
    Welcome(Welcome),
    /// It is not, for this reason.
    Refused(Refusal),
}

/// What an agent needs to start.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Welcome {
    /// Rank of the robot.
    pub robot: RobotId,
    /// This agent's incarnation.
    pub incarnation: Incarnation,
    /// Earliest tick that it may take part in.
    pub first_tick: Tick,
    /// The [briefing](crate::scenario::Setup::briefing) of the run as JSON, with the ALLIANCE parameters and the profile of this robot alone.
    pub setup: String,
    /// In a run over a network: the keys of its [`crate::secret::Pairs`], by rank, the world's last.
    pub pairs: Option<Vec<u128>>,
}

/// Why an agent may not join.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum Refusal {
    /// The scenario has no robot of that name.
    #[error("the scenario has no robot '{robot}'; its robots are {}", known.join(", "))]
    UnknownRobot {
        /// What was asked for.
        robot: String,
        /// What there is.
        known: Vec<String>,
    },
    /// Another agent has the robot.
    #[error("robot '{robot}' already has a live agent (incarnation {incarnation})")]
    Taken {
        /// The robot.
        robot: String,
        /// The incarnation of the agent that has it.
        incarnation: Incarnation,
    },
    /// Agent and world speak different versions.
    #[error(
        "the agent speaks protocol version {agent}, the world {world}: start both from the same build"
    )]
    Version {
        /// The agent's.
        agent: u32,
        /// The world's.
        world: u32,
    },
    /// The robot is not in the mission yet, or no more.
    #[error("robot '{robot}' is not in the mission; `alliance fault add {robot}` brings it")]
    Absent {
        /// The robot.
        robot: String,
    },
    /// The request could not be read.
    #[error("malformed join request")]
    Malformed,
    /// The mission has ended.
    #[error("the run is over")]
    Over,
}

//! The handshake of a host with the world: which robots are its own (key `enlist/<host>`).

use serde::{Deserialize, Serialize};

/// Host → world: "which robots are mine?"
///
/// The version comes first and alone decides whether the rest is understood.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EnlistRequest {
    /// [`crate::join::PROTOCOL_VERSION`] of the host.
    pub version: u32,
    /// Random: the answer is sealed for this request alone.
    pub nonce: u128,
    /// The clock on the host's wall, ms since 1970: certificates hold from one time to another.
    pub unix_ms: u64,
}

/// World → host: the names of its robots that are in the mission from the beginning, and of the others; or why it may not take part.
pub type EnlistReply = Result<Enlisted, String>;

/// What a host is to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Enlisted {
    /// All robots of that host.
    pub robots: Vec<String>,
    /// Those that it starts at once.
    pub start: Vec<String>,
}

//! The handshake of a host with the world, which returns the robots of the host (key `enlist/<host>`).

use serde::{Deserialize, Serialize};

/// Host → world: a request for the robots of this host.
///
/// The version is the first field. If it differs, the rest is not decoded.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EnlistRequest {
    /// The [`crate::join::PROTOCOL_VERSION`] of the host.
    pub version: u32,
    /// A random number. The answer is sealed for this request only.
    pub nonce: u128,
    /// The wall clock of the host, ms since 1970. The world compares it with the validity period of certificates.
    pub unix_ms: u64,
}

/// World → host: the robots of the host, or the reason why it may not take part.
pub type EnlistReply = Result<HostRobots, String>;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostRobots {
    pub robots: Vec<String>,
    /// The robots that the host starts immediately. The others join later.
    pub start: Vec<String>,
}

//! The errors of a world.

use alliance_proto::rendezvous::RendezvousError;

use crate::recorder::RecordError;

#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    #[error("bus")]
    Bus(#[from] zenoh::Error),
    /// A network address that the world cannot listen on, with the cause.
    #[error("cannot listen at {0}: {1}")]
    Listen(String, std::io::Error),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Rendezvous(#[from] RendezvousError),
    /// A failure of signals, ports or the random number generator.
    #[error("system")]
    System(#[from] std::io::Error),
}

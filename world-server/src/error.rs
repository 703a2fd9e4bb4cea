//! Why a world could not do its work.

use alliance_proto::rendezvous::RendezvousError;

use crate::recorder::RecordError;

/// Why a world could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    /// The bus failed.
    #[error("bus")]
    Bus(#[from] zenoh::Error),
    /// There is no listening there.
    #[error("cannot listen at {0}: {1}")]
    Listen(String, std::io::Error),
    /// The log could not be written.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The run could not be announced.
    #[error(transparent)]
    Rendezvous(#[from] RendezvousError),
    /// Signals, ports or random numbers could not be had.
    #[error("system")]
    System(#[from] std::io::Error),
}

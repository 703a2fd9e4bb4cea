//! The errors of a world.

use cluster::rendezvous::RendezvousError;
use cluster::router::RouterError;
use run_log::recorder::RecordError;
use scenario::Problem;

#[derive(Debug, thiserror::Error)]
pub enum WorldError {
    #[error("bus")]
    Bus(#[from] zenoh::Error),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Rendezvous(#[from] RendezvousError),
    #[error(transparent)]
    Router(#[from] RouterError),
    /// An option that this machine refuses.
    #[error(transparent)]
    Option(#[from] Problem),
    /// A failure of signals, ports or the random number generator.
    #[error("system")]
    System(#[from] std::io::Error),
}

//! A run at the start of a tick, which a world process continues.

use proto::team::Broadcast;
use run_log::recorder::{Folder, Recorder};

use crate::simulation::Simulation;

pub struct RunState {
    pub simulation: Simulation,
    /// The log so far.
    pub recorder: Recorder<Folder>,
    /// The broadcasts of earlier ticks that a manifest can still list.
    pub broadcasts: Vec<Broadcast>,
}

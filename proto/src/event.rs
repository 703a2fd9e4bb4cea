//! What happened, for observers, on the key `event` (DESIGN §3): the rows of events.csv as they are made.

use serde::{Deserialize, Serialize};

use crate::ids::Tick;
use crate::time::SimTime;

/// The events of one tick.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventNews {
    /// The tick.
    pub tick: Tick,
    /// Its events, in order.
    pub events: Vec<EventLine>,
}

/// A row of events.csv, field by field as text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventLine {
    /// Simulated time.
    pub t_ms: SimTime,
    /// What happened.
    pub kind: String,
    /// To or by whom; empty: to the world.
    pub robot: String,
    /// What it is about.
    pub subject: String,
    /// Why.
    pub reason: String,
    /// Anything else.
    pub detail: String,
}

//! Events for observers on the key `event`: the rows of events.csv, sent tick by tick.

use serde::{Deserialize, Serialize};

use scenario::ids::Tick;
use scenario::time::SimTime;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TickEvents {
    pub tick: Tick,
    pub events: Vec<EventLine>,
}

/// A row of events.csv with every field as text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct EventLine {
    /// The simulated time of the event, ms.
    pub t_ms: SimTime,
    pub kind: String,
    /// The robot of the event; empty for an event of the world.
    pub robot: String,
    /// The object of the event.
    pub subject: String,
    pub reason: String,
    pub detail: String,
}

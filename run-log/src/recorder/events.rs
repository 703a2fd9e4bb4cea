//! The events of a run that is not recorded.

use proto::event::EventLine;
use scenario::Setup;

use super::encode;
use super::names::Names;
use super::{Record, RecordError, TickRecord};

/// The events of a run without log and hash.
#[derive(Clone, Debug)]
pub struct EventCollector {
    names: Names,
    events: Vec<EventLine>,
}

impl EventCollector {
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            names: Names::of(setup),
            events: Vec::new(),
        }
    }

    /// Returns the rows of events.csv since the last call.
    pub fn take_events(&mut self) -> Vec<EventLine> {
        std::mem::take(&mut self.events)
    }
}

impl Record for EventCollector {
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        self.events.append(&mut encode::events(&self.names, record));
        Ok(())
    }
}

//! Events that a step of the world produces.

use scenario::ids::RobotId;

use run_log::recorder::{Event, EventKind};

/// The events of one world step, in order.
#[derive(Debug, Default)]
pub struct StepEvents(Vec<Event>);

impl StepEvents {
    /// Adds a mission event with the `kind` of events.csv and returns it. Its subject, reason and detail are empty.
    pub fn push_mission_event(&mut self, kind: &'static str, robot: Option<RobotId>) -> &mut Event {
        self.add(Event::new(EventKind::Mission(kind), robot))
    }

    pub(crate) fn add(&mut self, event: Event) -> &mut Event {
        let last = self.0.len();
        self.0.push(event);
        &mut self.0[last]
    }

    /// Returns the events in the order in which they occurred.
    #[must_use]
    pub fn into_events(self) -> Vec<Event> {
        self.0
    }
}

//! What has happened in a step of the world.

use alliance_proto::ids::RobotId;

use crate::recorder::{Event, EventKind};

/// Events of the world, in order.
#[derive(Debug, Default)]
pub struct Happened(Vec<Event>);

impl Happened {
    /// An event of the mission, with its `kind` in events.csv. Subject, reason and detail are empty.
    pub fn tell(&mut self, kind: &'static str, robot: Option<RobotId>) -> &mut Event {
        self.add(Event::new(EventKind::Mission(kind), robot))
    }

    pub(crate) fn add(&mut self, event: Event) -> &mut Event {
        let last = self.0.len();
        self.0.push(event);
        &mut self.0[last]
    }

    /// All of them.
    #[must_use]
    pub fn into_events(self) -> Vec<Event> {
        self.0
    }
}

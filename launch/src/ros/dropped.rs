//! Commands from ROS without an effect. They are counted, and the first one of each kind is reported.

use std::sync::{Mutex, PoisonError};

use cluster::ignored::IgnoredMessages;
use tokio::time::Instant;

/// The reason why a message has no effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dropped {
    /// The kind under which the message is counted.
    pub kind: &'static str,
    pub why: String,
}

impl Dropped {
    pub fn new(kind: &'static str, why: impl ToString) -> Self {
        let why = why.to_string();
        Self { kind, why }
    }
}

/// The numbers of messages without an effect, by kind.
#[derive(Default)]
pub struct DroppedCommands(Mutex<IgnoredMessages>);

impl DroppedCommands {
    /// Counts a message, and reports the first one of its kind.
    pub fn count(&self, dropped: &Dropped) {
        let Dropped { kind, why } = dropped;
        let mut counts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if counts.count(kind, Instant::now().into_std()) == Some(1) {
            tracing::warn!(kind, %why, "command dropped; further ones are only counted");
        }
    }

    /// Reports the numbers of all kinds.
    pub fn report(&self) {
        let counts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for (kind, count) in counts.counts() {
            tracing::warn!(kind, count, "commands dropped in all");
        }
    }
}

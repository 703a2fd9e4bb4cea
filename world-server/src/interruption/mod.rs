//! Interruption handlers: changes of the world from outside (thesis §3.2.2.2 and §4.2.2). The code is pure.
//!
//! - [`InterruptionHandler`]: the trait for custom handlers; see `docs/examples/own-handler`.
//! - `handlers`: handlers triggered by time ([`Timed`]) and by a user ([`ObstacleHandler`]).
//! - `change`: faults of the world as changes ([`Interruption`]). The [schedule](crate::faults::schedule) sets the times.
//!
//! A handler receives the simulated time instead of the step length of the thesis.

mod change;
mod handlers;

use scenario::time::SimTime;

use crate::world::World;
use run_log::recorder::Event;

pub use change::Interruption;
pub use handlers::{ObstacleHandler, Timed};

/// A handler that may change the world at the beginning of a tick, before any sensing (thesis Fig. 3.3).
///
/// A run is repeatable to the byte only if its handlers depend on nothing but the time, the world and their own state.
pub trait InterruptionHandler: CloneHandler + Send {
    /// Changes the world now if the handler decides to. Returns the events for the log.
    ///
    /// The run calls it at the beginning of each tick, and repeatedly in one tick while the clock is stopped.
    fn trigger_event(&mut self, now: SimTime, world: &mut World) -> Vec<Event>;
}

/// A handler behind a pointer that can be copied. Every handler type with [`Clone`] implements it.
pub trait CloneHandler {
    /// Returns a copy with the same state.
    fn clone_box(&self) -> Box<dyn InterruptionHandler>;
}

impl<H: InterruptionHandler + Clone + 'static> CloneHandler for H {
    fn clone_box(&self) -> Box<dyn InterruptionHandler> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn InterruptionHandler> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

//! Interruption handlers: what changes the world from outside (thesis §3.2.2.2 and §4.2.2). Pure.
//!
//! - [`InterruptionHandler`]: the trait for handlers of one's own; `missions/examples/own_interruption.rs` has one.
//! - `handlers`: triggered by time, once or periodically ([`Timed`]), and by a user ([`ObstacleHandler`]).
//! - `change`: the world's own faults as changes that begin and end ([`Interruption`]); when they do is the
//!   [schedule's](crate::faults::schedule) business.
//!
//! Where the thesis has the length of a step, a handler here gets the simulated time: it tells both.

mod change;
mod handlers;

use alliance_proto::time::SimTime;

use crate::recorder::Event;
use crate::world::World;

pub use change::Interruption;
pub use handlers::{ObstacleHandler, Timed};

/// Something that may change the world at the beginning of a tick, before anything is sensed (thesis Fig. 3.3).
///
/// A run can be repeated to the byte only if its handlers depend on nothing but the time, the world and their own state.
pub trait InterruptionHandler: Send {
    /// Decides whether to change the world now, and does so. Returns what the log shall say of it.
    ///
    /// Called at the beginning of each tick; in one tick more than once if the clock stands still meanwhile.
    fn trigger_event(&mut self, now: SimTime, world: &mut World) -> Vec<Event>;
}

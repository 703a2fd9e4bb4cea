//! What tests of several crates need: a mission that nobody has to know, and a fault of each kind.

mod drill;
mod faults;

pub use drill::{DRILL, default_scenario, default_setup, unlike_robots, vocabulary};
pub use faults::one_of_each;

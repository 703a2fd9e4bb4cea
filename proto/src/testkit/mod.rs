//! Shared test data of several crates: a mission without dependencies, and a fault of each kind.

mod drill;
mod faults;

pub use drill::{DRILL, default_scenario, default_setup, unlike_robots, vocabulary};
pub use faults::one_of_each;

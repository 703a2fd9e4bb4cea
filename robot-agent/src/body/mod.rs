//! The robot's body control: reaching a goal in spite of what is in the way (thesis §4.2.1). Pure.
//!
//! - [`chassis`]: what the drive can do within a step.
//! - [`goal`]: a place to reach, or a direction to keep.
//! - [`surroundings`]: what is sensed of what is in the way.
//! - [`navigator`]: straight to the goal, giving way to teammates, and round whatever blocks the way.
//! - [`driver`]: all of that for a robot that goes to one place after another.
//! - `detour`: following the outline of an obstacle, with the memory that keeps it from circling for ever.

pub mod chassis;
mod detour;
pub mod driver;
pub mod goal;
pub mod navigator;
pub mod surroundings;

pub use chassis::Chassis;
pub use driver::Driver;
pub use goal::Goal;
pub use navigator::{Drive, Navigator, Status, Teammate};
pub use surroundings::{Side, Surroundings};

use std::f32::consts::{PI, TAU};

/// The same angle in [-π, π], rad.
#[inline]
#[must_use]
pub fn wrap(angle: f32) -> f32 {
    // The remainder of such an angle is the angle itself.
    if angle.abs() <= PI {
        angle
    } else {
        libm::remainderf(angle, TAU)
    }
}

#[cfg(test)]
mod tests;

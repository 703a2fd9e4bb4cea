//! The robot's body control: reaching a goal in spite of what is in the way (thesis §4.2.1). Pure.
//!
//! - [`chassis`]: what the drive can do within a step.
//! - [`goal`]: a place to reach, or a direction to keep.
//! - [`navigator`]: straight to the goal, giving way to teammates, and round whatever blocks the way.
//! - `detour`: following the outline of an obstacle, with the memory that keeps it from circling for ever.

pub mod chassis;
mod detour;
pub mod goal;
pub mod navigator;

pub use chassis::Chassis;
pub use detour::Side;
pub use goal::Goal;
pub use navigator::{Drive, Navigator, Status, Surroundings, Teammate};

use std::f32::consts::{PI, TAU};

/// The same angle in [-π, π], rad.
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

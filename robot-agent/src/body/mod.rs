//! Body control: driving to a goal around obstacles (Parker's thesis §4.2.1). Pure functions of readings and state.
//!
//! - [`chassis`]: the motion that the drive can make in one step.
//! - [`goal`]: a place to reach, or a direction to keep.
//! - [`surroundings`]: the readings of the avoidance sensors.
//! - [`navigator`]: straight to the goal, yielding to teammates, and around obstacles.
//! - [`driver`]: all of this for a robot that visits one place after another.
//! - [`failed_attempts`]: the suspension of places that were not reached.
//! - `detour`: following the outline of an obstacle, with the memory that prevents endless circling.

pub mod chassis;
mod detour;
pub mod driver;
pub mod failed_attempts;
pub mod goal;
pub mod navigator;
pub mod surroundings;

pub use chassis::Chassis;
pub use driver::Driver;
pub use failed_attempts::FailedAttempts;
pub use goal::Goal;
pub use navigator::{Drive, Navigator, Status, Teammate};
pub use surroundings::{Side, Surroundings};

use std::f32::consts::{PI, TAU};

#[inline]
#[must_use]
pub fn wrap(angle: f32) -> f32 {
    // In this range the remainder equals the angle.
    if angle.abs() <= PI {
        angle
    } else {
        libm::remainderf(angle, TAU)
    }
}

#[cfg(test)]
mod tests;

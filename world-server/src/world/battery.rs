//! The energy of a robot, an aspect of a component that evolves each step (thesis §3.2).

use scenario::Energy;
use scenario::time::SimTime;

/// A battery that idling and driving discharge.
#[derive(Clone, Copy, Debug)]
pub struct Battery {
    /// The charge. It needs f64: the change in a step of 1 ms is below the resolution of f32 at full charge.
    charge_j: f64,
    idle_w: f64,
    drive_w: f64,
}

impl Battery {
    pub fn full(energy: &Energy) -> Self {
        Self {
            charge_j: f64::from(energy.capacity_j),
            idle_w: f64::from(energy.idle_w),
            drive_w: f64::from(energy.drive_w),
        }
    }

    /// Returns the remaining energy, J, never below 0.
    pub fn charge_j(&self) -> f32 {
        self.charge_j as f32
    }

    pub fn is_empty(&self) -> bool {
        self.charge_j <= 0.0
    }

    /// Draws the energy of one step. `drive` is the robot's speed as a share of its top speed.
    pub fn draw(&mut self, drive: f32, step: SimTime) {
        let power_w = self.idle_w + self.drive_w * f64::from(drive);
        self.charge_j = (self.charge_j - power_w * step.as_secs_f64()).max(0.0);
    }
}

//! The energy of a robot, an aspect of a component that evolves each step (thesis §3.2).

use scenario::Energy;
use scenario::time::SimTime;

/// A battery that idling and driving discharge, and that a mission may charge.
#[derive(Clone, Copy, Debug)]
pub struct Battery {
    /// The charge. It needs f64: the change in a step of 1 ms is below the resolution of f32 at full charge.
    charge_j: f64,
    capacity_j: f64,
    /// The energy that the battery has received since the start, J.
    received_j: f64,
    idle_w: f64,
    drive_w: f64,
}

impl Battery {
    pub fn full(energy: &Energy) -> Self {
        Self {
            charge_j: f64::from(energy.capacity_j),
            capacity_j: f64::from(energy.capacity_j),
            received_j: 0.0,
            idle_w: f64::from(energy.idle_w),
            drive_w: f64::from(energy.drive_w),
        }
    }

    /// Returns the remaining energy, J, never below 0.
    pub fn charge_j(&self) -> f32 {
        self.charge_j as f32
    }

    /// Adds energy, at most up to the capacity. Returns the energy that the battery took, J.
    pub fn charge(&mut self, energy_j: f64) -> f64 {
        let taken_j = energy_j.min(self.capacity_j - self.charge_j).max(0.0);
        self.charge_j = (self.charge_j + taken_j).min(self.capacity_j);
        self.received_j += taken_j;
        taken_j
    }

    pub fn received_j(&self) -> f64 {
        self.received_j
    }

    pub fn is_full(&self) -> bool {
        self.charge_j >= self.capacity_j
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

//! Aspects: properties of a component that evolve each step (thesis §3.2).

use scenario::Energy;
use scenario::time::SimTime;

/// A property that evolves each step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aspect {
    /// The energy of a robot.
    Energy(Battery),
}

impl Aspect {
    /// Advances the property by one step. `drive` is the component's speed as a share of its top speed.
    pub fn evolve(&mut self, drive: f32, step: SimTime) {
        match self {
            Self::Energy(battery) => battery.draw(drive, step),
        }
    }

    /// Checks whether this aspect allows the component to act.
    #[must_use]
    pub fn is_powered(&self) -> bool {
        match self {
            Self::Energy(battery) => battery.charge_j > 0.0,
        }
    }
}

/// A battery that idling and driving discharge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Battery {
    /// The charge. It needs f64: the change in a step of 1 ms is below the resolution of f32 at full charge.
    charge_j: f64,
    idle_w: f64,
    drive_w: f64,
}

impl Battery {
    #[must_use]
    pub fn full(energy: &Energy) -> Self {
        Self {
            charge_j: f64::from(energy.capacity_j),
            idle_w: f64::from(energy.idle_w),
            drive_w: f64::from(energy.drive_w),
        }
    }

    /// Returns the remaining energy, J, never below 0.
    #[must_use]
    pub fn charge_j(&self) -> f32 {
        self.charge_j as f32
    }

    fn draw(&mut self, drive: f32, step: SimTime) {
        let power_w = self.idle_w + self.drive_w * f64::from(drive);
        self.charge_j = (self.charge_j - power_w * step.as_secs_f64()).max(0.0);
    }
}

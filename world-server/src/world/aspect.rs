//! Aspects: properties of a component that evolve each step (thesis §3.2).

use alliance_proto::scenario::Energy;
use alliance_proto::time::SimTime;

/// A property that evolves each step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Aspect {
    /// Energy of a robot.
    Energy(Battery),
}

impl Aspect {
    /// Evolves over one step in which the component moved at that multiple of its top speed.
    pub fn evolve(&mut self, drive: f32, step: SimTime) {
        match self {
            Self::Energy(battery) => battery.draw(drive, step),
        }
    }

    /// Whether the component can act as far as this aspect is concerned.
    #[must_use]
    pub fn is_powered(&self) -> bool {
        match self {
            Self::Energy(battery) => battery.charge_j > 0.0,
        }
    }
}

/// A battery that is drawn on by idling and by driving.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Battery {
    /// In f64: what a step of 1 ms takes is below the resolution of f32 at full charge.
    charge_j: f64,
    idle_w: f64,
    drive_w: f64,
}

impl Battery {
    /// A full battery.
    #[must_use]
    pub fn full(energy: &Energy) -> Self {
        Self {
            charge_j: f64::from(energy.capacity_j),
            idle_w: f64::from(energy.idle_w),
            drive_w: f64::from(energy.drive_w),
        }
    }

    /// Energy left, J, never below 0.
    #[must_use]
    pub fn charge_j(&self) -> f32 {
        self.charge_j as f32
    }

    fn draw(&mut self, drive: f32, step: SimTime) {
        let power_w = self.idle_w + self.drive_w * f64::from(drive);
        self.charge_j = (self.charge_j - power_w * step.as_secs_f64()).max(0.0);
    }
}

//! Properties that every run of a mission must have, for analysis from outside.

use glam::Vec2;

/// A circular area on the floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// The center of the area, m.
    pub center: Vec2,
    /// The radius of the area, m.
    pub radius_m: f32,
}

impl Disc {
    /// Returns true if the area contains a point.
    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        point.distance(self.center) <= self.radius_m
    }
}

/// The properties of every run of a scenario, with or without faults.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExpectedProperties {
    /// The number of items at the start. No item is lost, and only faults add items.
    pub items: usize,
    /// The areas that delivered items never leave.
    pub goals: Vec<Disc>,
    /// The areas that robots must reach, besides the items, to finish the mission.
    pub targets: Vec<Disc>,
    /// True if the mission ends whenever a sound robot can do all of it and can reach all remaining work.
    pub ends: bool,
}

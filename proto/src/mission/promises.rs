//! What holds of a mission for those who look at its runs from outside.

use glam::Vec2;

/// A round place, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Its center.
    pub center: Vec2,
    /// Its radius.
    pub radius_m: f32,
}

impl Place {
    /// Whether a point is in it.
    #[must_use]
    pub fn contains(&self, point: Vec2) -> bool {
        point.distance(self.center) <= self.radius_m
    }
}

/// What a scenario promises, whatever goes wrong.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Promises {
    /// Items at the start. None is ever lost, and only faults add any.
    pub items: usize,
    /// Where items stay once they have been brought there.
    pub goals: Vec<Place>,
    /// Where robots have to get beside the items, so that all can be done.
    pub targets: Vec<Place>,
    /// Whether it ends, if some sound robot can do all of it and all that is left is within its reach.
    pub ends: bool,
}

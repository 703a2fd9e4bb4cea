//! From where a robot looks a spill over.

use std::f32::consts::TAU;

use glam::Vec2;

/// Places all round a spill whose center cannot be reached, or does not overlook it.
const RING: usize = 6;
/// Their distance from the center, in radii of the spill: inside, so that the spill can be sensed there.
const RING_RADII: f32 = 0.75;

/// Places to look around from, in order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Views {
    center: Vec2,
    radius_m: f32,
    places: Vec<Vec2>,
    next: usize,
    reached: usize,
}

impl Views {
    /// Those of a spill. From its center alone where that `overlooks` all of it.
    pub fn new(center: Vec2, radius_m: f32, overlooks: bool) -> Self {
        let mut places = vec![center];
        if !overlooks {
            places.extend(ring(center, radius_m));
        }
        Self {
            center,
            radius_m,
            places,
            next: 0,
            reached: 0,
        }
    }

    /// Where to look around from next; `None` when all places are done.
    pub fn next(&self) -> Option<Vec2> {
        self.places.get(self.next).copied()
    }

    /// The robot is at the next place.
    pub fn reach(&mut self) {
        self.next += 1;
        self.reached += 1;
    }

    /// There is no way to the next place. For the center the ring takes its place, for good.
    pub fn block(&mut self) {
        if self.next() == Some(self.center) {
            self.places = ring(self.center, self.radius_m).collect();
            self.restart();
        } else {
            self.next += 1;
        }
    }

    /// Everything has to be looked over again.
    pub fn restart(&mut self) {
        self.next = 0;
        self.reached = 0;
    }

    /// Whether enough of the places were reached to have seen the spill.
    pub fn have_shown_all(&self) -> bool {
        self.next().is_none() && 2 * self.reached >= self.places.len()
    }
}

fn ring(center: Vec2, radius_m: f32) -> impl Iterator<Item = Vec2> {
    (0..RING).map(move |index| {
        let angle = TAU * index as f32 / RING as f32;
        center + Vec2::new(libm::cosf(angle), libm::sinf(angle)) * (radius_m * RING_RADII)
    })
}

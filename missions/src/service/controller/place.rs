//! The place of a known point, with the ways to and from it. They stay valid while the place is the same, because the
//! obstacles of a scenario never change.

use std::cell::OnceCell;
use std::sync::Arc;

use glam::Vec2;

use crate::service::data::{Destination, Paths};

/// A place with its ways, which are computed on first use. They follow from the place and change no result.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub at: Vec2,
    ways: OnceCell<Arc<Destination>>,
    delivery_m: OnceCell<Option<f32>>,
}

impl Place {
    pub fn new(at: Vec2) -> Self {
        Self {
            at,
            ways: OnceCell::new(),
            delivery_m: OnceCell::new(),
        }
    }

    /// Returns the ways to the place.
    pub fn ways(&self, paths: &Paths) -> &Destination {
        self.ways.get_or_init(|| paths.to(self.at))
    }

    /// Returns the length of the way from the place to that of the delivery, m; `None` without a way.
    pub fn delivery_m(&self, length_m: impl FnOnce() -> Option<f32>) -> Option<f32> {
        *self.delivery_m.get_or_init(length_m)
    }
}

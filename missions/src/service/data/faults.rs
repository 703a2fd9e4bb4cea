//! The fault of service: an additional point.

use scenario::fault::{FaultArgument, FaultRange, FaultSpec};

use super::MAX_KINDS;

pub const POINT: &str = "point";

pub(super) const ALL: &[FaultSpec] = &[FaultSpec {
    name: POINT,
    about: "a point of work arrives",
    arguments: &[
        FaultArgument::new("x_m", "place, m", FaultRange::X, None),
        FaultArgument::new("y_m", "place, m", FaultRange::Y, None),
        FaultArgument::new(
            "kind",
            "index of its kind in the scenario; the first is 0",
            FaultRange::Whole(0, MAX_KINDS as u32 - 1),
            Some(0.0),
        ),
    ],
}];

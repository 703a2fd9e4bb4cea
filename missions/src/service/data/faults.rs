//! Faults of service: a point that nobody has planned for.

use alliance_proto::fault::{FaultArgument, FaultRange, FaultSpec};

use super::MAX_KINDS;

/// Name of the fault that adds a point.
pub const POINT: &str = "point";

/// All of them.
pub(super) const ALL: &[FaultSpec] = &[FaultSpec {
    name: POINT,
    about: "a point of work arrives",
    arguments: &[
        FaultArgument::new("x_m", "where, m", FaultRange::X, None),
        FaultArgument::new("y_m", "where, m", FaultRange::Y, None),
        FaultArgument::new(
            "kind",
            "number of its kind in the scenario, the first is 0",
            FaultRange::Whole(0, MAX_KINDS as u32 - 1),
            Some(0.0),
        ),
    ],
}];

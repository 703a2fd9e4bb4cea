//! Faults of push: a bar that does not move.

use scenario::fault::{FaultArgument, FaultRange, FaultSpec};

pub const BAR_STUCK: &str = "bar-stuck";

/// The default duration of the fault, s.
pub const STUCK_S: f64 = 60.0;

pub(super) const ALL: &[FaultSpec] = &[FaultSpec {
    name: BAR_STUCK,
    about: "holds the bar nearest to a place for a while, so that no robot can push it",
    arguments: &[
        FaultArgument::new("x_m", "x of the place, m", FaultRange::X, Some(0.0)),
        FaultArgument::new("y_m", "y of the place, m", FaultRange::Y, Some(0.0)),
        FaultArgument::new(
            "stuck_s",
            "duration, s",
            FaultRange::Within(0.0, 1e6),
            Some(STUCK_S),
        ),
    ],
}];

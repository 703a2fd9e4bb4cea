//! Faults of push: a bar that gives way to nobody.

use alliance_proto::fault::{FaultArgument, FaultRange, FaultSpec};

/// Name of the fault that holds a bar.
pub const BAR_STUCK: &str = "bar-stuck";

/// How long it holds where that is not said, s.
pub const STUCK_S: f64 = 60.0;

/// All of them.
pub(super) const ALL: &[FaultSpec] = &[FaultSpec {
    name: BAR_STUCK,
    about: "the bar that is nearest to a place gives way to nobody for a while",
    arguments: &[
        FaultArgument::new("x_m", "the place, m", FaultRange::X, Some(0.0)),
        FaultArgument::new("y_m", "the place, m", FaultRange::Y, Some(0.0)),
        FaultArgument::new(
            "stuck_s",
            "for how long, s",
            FaultRange::Within(0.0, 1e6),
            Some(STUCK_S),
        ),
    ],
}];

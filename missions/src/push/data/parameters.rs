//! The parameters of `[push]`, for documentation and for checks.

use scenario::mission::prelude::ParameterDefault::{Number, Required};
use scenario::mission::prelude::ParameterRange::{Above, List, X, Y};
use scenario::mission::prelude::ParameterSpec;

use super::MAX_BARS;

pub(super) fn all() -> Vec<ParameterSpec> {
    let number = |key, default, about, most| {
        ParameterSpec::new(key, "m", Number(default), about, Above(0.0, most))
    };
    vec![
        number("length_m", 2.4, "length of each bar's axis", 100.0),
        number("half_width_m", 0.1, "half of a bar's thickness", 10.0),
        number("stroke_m", 0.4, "motion of an end in one stroke", 10.0),
        number(
            "skew_m",
            0.8,
            "largest lead of one end of a bar over the other toward the goal",
            100.0,
        ),
        number(
            "sight_m",
            1.5,
            "distance from which a robot sees a bar",
            1e3,
        ),
        ParameterSpec::new(
            "bars",
            "",
            Required,
            "the bars, parallel to y at the start",
            List(1, MAX_BARS),
        ),
        ParameterSpec::new("bars.x_m", "m", Required, "x of the bar's middle", X),
        ParameterSpec::new("bars.y_m", "m", Required, "y of the bar's middle", Y),
        ParameterSpec::new(
            "bars.goal_x_m",
            "m",
            Required,
            "x of the line that both ends must cross",
            X,
        ),
    ]
}

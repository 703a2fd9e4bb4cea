//! The keys of `[push]`, for people and for checks.

use alliance_proto::mission::prelude::ParameterDefault::{Number, Required};
use alliance_proto::mission::prelude::ParameterRange::{Above, List, X, Y};
use alliance_proto::mission::prelude::ParameterSpec;

use super::MAX_BARS;

pub(super) fn all() -> Vec<ParameterSpec> {
    let number = |key, default, about, most| {
        ParameterSpec::new(key, "m", Number(default), about, Above(0.0, most))
    };
    vec![
        number("length_m", 2.4, "length of each bar's axis", 100.0),
        number("half_width_m", 0.1, "half of its thickness", 10.0),
        number(
            "stroke_m",
            0.4,
            "how far an end comes forward in a stroke",
            10.0,
        ),
        number(
            "skew_m",
            0.8,
            "how far the ends of a bar may be apart toward the goal",
            100.0,
        ),
        number("sight_m", 1.5, "from how far a robot sees a bar", 1e3),
        ParameterSpec::new(
            "bars",
            "",
            Required,
            "the bars, upright at first",
            List(1, MAX_BARS),
        ),
        ParameterSpec::new("bars.x_m", "m", Required, "where its middle is", X),
        ParameterSpec::new("bars.y_m", "m", Required, "where its middle is", Y),
        ParameterSpec::new(
            "bars.goal_x_m",
            "m",
            Required,
            "the line that both ends are to cross",
            X,
        ),
    ]
}

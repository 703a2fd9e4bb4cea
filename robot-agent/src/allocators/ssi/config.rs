//! The parameters of SSI.

use scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use serde::Deserialize;

use super::path::Objective;

/// The parameters in `[allocators.ssi]`.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    pub objective: Objective,
    pub bid_window_s: f64,
    pub path_max: usize,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            objective: Objective::Max,
            bid_window_s: 0.5,
            path_max: 32,
        }
    }
}

/// Returns the parameters with unit, default, meaning and range.
pub fn parameters() -> Vec<ParameterSpec> {
    let default = Config::default();
    vec![
        ParameterSpec {
            key: "objective",
            unit: "",
            default: ParameterDefault::Text("minimax"),
            about: "team objective: the sum of the path costs (minisum), the largest one (minimax), or the mean time at which a task is done (miniave) (the papers have all three, the default is decided here)",
            range: ParameterRange::Choice(&["minisum", "minimax", "miniave"]),
        },
        ParameterSpec {
            key: "bid_window_s",
            unit: "s",
            default: ParameterDefault::Number(default.bid_window_s),
            about: "time after which an auction ends without the bids of all robots; at least three steps; larger: fewer wrong awards with message loss, but longer waits (decided here)",
            range: ParameterRange::Above(0.0, 1e6),
        },
        ParameterSpec {
            key: "path_max",
            unit: "",
            default: ParameterDefault::Whole(default.path_max as i64),
            about: "maximum number of tasks that a robot holds at once; larger: a longer plan, but more computation (the papers have no limit)",
            range: ParameterRange::Whole(1, 10_000),
        },
    ]
}

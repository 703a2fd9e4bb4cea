//! The parameters of SSI.

use scenario::ParameterRange::{Above, Choice, Whole};

use super::path::Objective;
use crate::allocator::parameters;

parameters! {
    /// The parameters in `[allocators.ssi]`.
    pub struct Config {
        objective: Objective = Objective::Max => "minimax", "", Choice(&["minisum", "minimax", "miniave"]),
            "team objective: the sum of the path costs (minisum), the largest one (minimax), or the mean time at which a task is done (miniave) (the papers have all three, the default is decided here)";
        bid_window_s: f64 = 0.5, "s", Above(0.0, 1e6),
            "time after which an auction ends without the bids of all robots; at least three steps; larger: fewer wrong awards with message loss, but longer waits (decided here)";
        path_max: usize = 32, "", Whole(1, 10_000),
            "maximum number of tasks that a robot holds at once; larger: a longer plan, but more computation (the papers have no limit)";
    }
}

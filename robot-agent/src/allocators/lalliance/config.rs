//! The parameters of L-ALLIANCE, `[allocators.l-alliance]`.

use scenario::ParameterRange::{Above, Choice, Whole, Within};
use serde::Deserialize;

use crate::allocator::parameters;

parameters! {
    /// The parameters in `[allocators.l-alliance]`.
    pub struct Config {
        strategy: Strategy = Strategy::IV => "IV", "", Choice(&["I", "II", "III", "IV"]),
            "times that determine patience and yielding: I the robot's own, II the best, III each robot's own, IV as III with its own ordering (Parker 1995)";
        ordering: Ordering = Ordering::LongestFirst => "longest-first", "", Choice(&["longest-first", "shortest-first", "random"]),
            "order in which a robot prefers tasks, with strategies I to III (Parker 1995)";
        trials: usize = 7, "", Whole(1, 100),
            "μ: number of trials stored per robot and task (Parker 1995: 5 to 10)";
        min_delay_s: f64 = 2.0, "s", Above(0.0, 1e6),
            "shortest time in which a motivation rises to θ while no robot executes the task (decided here)";
        max_delay_s: f64 = 8.0, "s", Above(0.0, 1e6),
            "longest time in which a motivation rises to θ while no robot executes the task; at least min_delay_s (decided here)";
        boredom_threshold: f64 = 1.0, "", Within(0.0, 1e6),
            "boredom at which a robot considers tasks that others are better at (decided here)";
        boredom_rate: f64 = 0.2, "1/s", Above(0.0, 1e6),
            "growth of boredom while the robot has no task (decided here)";
        prior_units: f64 = 2.0, "", Above(0.0, 1e6),
            "assumed time before the first trial, in units of the task's work (decided here)";
        learning_trials: usize = 0, "", Whole(0, 100),
            "number of trials of each task before active learning ends; 0 disables it (decided here)";
        learning_limit_s: f64 = 300.0, "s", Above(0.0, 1e6),
            "maximum duration of active learning (decided here)";
    }
}

/// The source of the times that determine patience and yielding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Strategy {
    /// Distrust performance knowledge about teammates: the robot's own time for all.
    I,
    /// Let the best robot win: the best time for all.
    II,
    /// Give robots a fighting chance: the time of each robot for itself.
    III,
    /// The same as III, with its own order: the longest first where the robot is best, else the shortest.
    IV,
}

/// The order in which a robot prefers tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ordering {
    /// The longest task first, independent of the best robot.
    LongestFirst,
    /// Tasks at which the robot is best, then the rest; in each group the shortest first.
    ShortestFirst,
    /// Tasks at which the robot is best, then the rest; in each group in random order.
    Random,
}

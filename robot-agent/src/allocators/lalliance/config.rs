//! The parameters of L-ALLIANCE, `[allocators.l-alliance]`.

use scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use serde::Deserialize;

/// The parameters in `[allocators.l-alliance]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The source of the times that determine patience and yielding.
    pub strategy: Strategy,
    pub ordering: Ordering,
    pub trials: usize,
    pub min_delay_s: f64,
    pub max_delay_s: f64,
    pub boredom_threshold: f64,
    pub boredom_rate: f64,
    pub prior_units: f64,
    pub learning_trials: u32,
    pub learning_limit_s: f64,
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

impl Default for Config {
    fn default() -> Self {
        Self {
            strategy: Strategy::IV,
            ordering: Ordering::LongestFirst,
            trials: 7,
            min_delay_s: 2.0,
            max_delay_s: 8.0,
            boredom_threshold: 1.0,
            boredom_rate: 0.2,
            prior_units: 2.0,
            learning_trials: 0,
            learning_limit_s: 300.0,
        }
    }
}

impl Config {
    pub(super) fn parameters() -> Vec<ParameterSpec> {
        let default = Self::default();
        let number = |key, unit, value, about, range| ParameterSpec {
            key,
            unit,
            default: ParameterDefault::Number(value),
            about,
            range,
        };
        let spec = |key, default, about, range| ParameterSpec {
            key,
            unit: "",
            default,
            about,
            range,
        };
        let (above, within) = (ParameterRange::Above, ParameterRange::Within);
        vec![
            spec(
                "strategy",
                ParameterDefault::Text("IV"),
                "times that determine patience and yielding: I the robot's own, II the best, III each robot's own, IV as III with its own ordering (Parker 1995)",
                ParameterRange::Choice(&["I", "II", "III", "IV"]),
            ),
            spec(
                "ordering",
                ParameterDefault::Text("longest-first"),
                "order in which a robot prefers tasks, with strategies I to III (Parker 1995)",
                ParameterRange::Choice(&["longest-first", "shortest-first", "random"]),
            ),
            spec(
                "trials",
                ParameterDefault::Whole(default.trials as i64),
                "μ: number of trials stored per robot and task (Parker 1995: 5 to 10)",
                ParameterRange::Whole(1, 100),
            ),
            number(
                "min_delay_s",
                "s",
                default.min_delay_s,
                "shortest time in which a motivation rises to θ while no robot executes the task (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "max_delay_s",
                "s",
                default.max_delay_s,
                "longest time in which a motivation rises to θ while no robot executes the task; at least min_delay_s (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "boredom_threshold",
                "",
                default.boredom_threshold,
                "boredom at which a robot considers tasks that others are better at (decided here)",
                within(0.0, 1e6),
            ),
            number(
                "boredom_rate",
                "1/s",
                default.boredom_rate,
                "growth of boredom while the robot has no task (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "prior_units",
                "",
                default.prior_units,
                "assumed time before the first trial, in units of the task's work (decided here)",
                above(0.0, 1e6),
            ),
            spec(
                "learning_trials",
                ParameterDefault::Whole(i64::from(default.learning_trials)),
                "number of trials of each task before active learning ends; 0 disables it (decided here)",
                ParameterRange::Whole(0, 100),
            ),
            number(
                "learning_limit_s",
                "s",
                default.learning_limit_s,
                "maximum duration of active learning (decided here)",
                above(0.0, 1e6),
            ),
        ]
    }
}

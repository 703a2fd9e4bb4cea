//! The parameters of L-ALLIANCE, `[allocators.l-alliance]`.

use alliance_proto::scenario::{ParameterDefault, ParameterRange, ParameterSpec};
use serde::Deserialize;

/// `[allocators.l-alliance]`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// By whose times robots are patient and yield.
    pub strategy: Strategy,
    /// Which task a robot is drawn to first; of strategies I to III.
    pub ordering: Ordering,
    /// μ: number of trials that are remembered of each robot and task.
    pub trials: usize,
    /// Shortest time in which a motivation grows to θ while nobody is at the task, s.
    pub min_delay_s: f64,
    /// The longest, s; at least the shortest.
    pub max_delay_s: f64,
    /// Boredom from which on a robot looks at tasks that others are better at.
    pub boredom_threshold: f64,
    /// How fast boredom grows while the robot has nothing to do, 1/s.
    pub boredom_rate: f64,
    /// What a robot is believed to need before its first trial, in units of the task's work.
    pub prior_units: f64,
    /// Active learning goes on until there are so many trials of each own task; 0: there is none.
    pub learning_trials: u32,
    /// Its longest time, s.
    pub learning_limit_s: f64,
}

/// By whose times robots are patient and yield.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum Strategy {
    /// Distrust performance knowledge about teammates: all by one's own time.
    I,
    /// Let the best robot win: all by the best time.
    II,
    /// Give robots a fighting chance: each by its own time.
    III,
    /// As III, with an order of its own: what the robot is best at longest first, else shortest first.
    IV,
}

/// Which task a robot is drawn to first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ordering {
    /// The longest first, whoever is best at it.
    LongestFirst,
    /// What the robot is best at before the rest; of each the shortest first.
    ShortestFirst,
    /// What the robot is best at before the rest; of each any.
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
    /// Its keys.
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
                "by whose times robots are patient and yield: I own, II best, III each by its own, IV as III with its own ordering (Parker 1995)",
                ParameterRange::Choice(&["I", "II", "III", "IV"]),
            ),
            spec(
                "ordering",
                ParameterDefault::Text("longest-first"),
                "which task a robot is drawn to first, with strategies I to III (Parker 1995)",
                ParameterRange::Choice(&["longest-first", "shortest-first", "random"]),
            ),
            spec(
                "trials",
                ParameterDefault::Whole(default.trials as i64),
                "μ: trials that are remembered of each robot and task (Parker 1995: 5 to 10)",
                ParameterRange::Whole(1, 100),
            ),
            number(
                "min_delay_s",
                "s",
                default.min_delay_s,
                "shortest time in which a motivation grows to θ while nobody is at the task (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "max_delay_s",
                "s",
                default.max_delay_s,
                "the longest; min_delay_s at least (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "boredom_threshold",
                "",
                default.boredom_threshold,
                "boredom from which on a robot looks at tasks that others are better at (decided here)",
                within(0.0, 1e6),
            ),
            number(
                "boredom_rate",
                "1/s",
                default.boredom_rate,
                "how fast boredom grows while the robot has nothing to do (decided here)",
                above(0.0, 1e6),
            ),
            number(
                "prior_units",
                "",
                default.prior_units,
                "what a robot is believed to need before its first trial, in units of the task's work (decided here)",
                above(0.0, 1e6),
            ),
            spec(
                "learning_trials",
                ParameterDefault::Whole(i64::from(default.learning_trials)),
                "active learning goes on until there are so many trials of each own task; 0: there is none (decided here)",
                ParameterRange::Whole(0, 100),
            ),
            number(
                "learning_limit_s",
                "s",
                default.learning_limit_s,
                "longest time of active learning (decided here)",
                above(0.0, 1e6),
            ),
        ]
    }
}

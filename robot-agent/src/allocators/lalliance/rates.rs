//! The parameters of ALLIANCE computed from measured times: strategies, orderings and categories
//! (docs/allocators/l-alliance.md).

use scenario::ids::RobotId;

use super::config::{Config, Ordering, Strategy};

/// The limit of φ in units of the shortest known time of any robot. Without it, failed trials would extend the patience
/// without limit.
pub(super) const PATIENCE_CAP: f64 = 3.0;

/// The value of λ in units of ψ.
pub(super) const LAMBDA_PER_PSI: f64 = 3.0;

/// The limit of a delay as a share of the shortest φ, so that δ_slow < δ_fast.
const SLOWEST: f64 = 0.9;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Category {
    /// The robot is the best of those present, and the task has a free place.
    BestHere,
    Others,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct TaskTimes {
    pub own_s: f64,
    /// The shortest time of the present robots that can do the task, this one included, s.
    pub best_s: f64,
    /// The shortest time of any robot with a trial, or of this robot, s.
    pub shortest_s: f64,
    pub category: Category,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rates {
    /// The time in which the motivation rises to θ while no robot executes the task, s, before the clamp.
    pub delay_s: f64,
    /// The time active before yielding, ψ, s.
    pub psi_s: f64,
    /// The time active before giving up, λ, s.
    pub lambda_s: f64,
}

/// Returns whether the first of two robots is better at a task; of equal times the lower rank is better.
pub(super) fn is_better(one: (f64, RobotId), other: (f64, RobotId)) -> bool {
    one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)).is_lt()
}

/// Computes the delay, ψ and λ. `span_s` contains the shortest and the longest time of any robot on any task; `draw` is
/// in [0, 1).
pub(super) fn rates(
    config: &Config,
    knowledge: &TaskTimes,
    span_s: (f64, f64),
    draw: f64,
) -> Rates {
    let (low_s, high_s) = span_s;
    let max_delay_s = config.max_delay_s.max(config.min_delay_s);
    let range_s = max_delay_s - config.min_delay_s;
    let share = if high_s > low_s {
        (knowledge.own_s - low_s) / (high_s - low_s)
    } else {
        0.0
    };
    let longest_first = max_delay_s - share * range_s;
    let shortest_first = config.min_delay_s + share * range_s;
    let delay_s = match (config.strategy, config.ordering) {
        (Strategy::IV, _) => match knowledge.category {
            Category::BestHere => longest_first,
            Category::Others => shortest_first,
        },
        (_, Ordering::LongestFirst) => longest_first,
        (_, Ordering::ShortestFirst) => shortest_first,
        (_, Ordering::Random) => config.min_delay_s + draw * range_s,
    };
    let psi_s = match config.strategy {
        Strategy::II => knowledge.best_s,
        _ => knowledge.own_s,
    };
    Rates {
        delay_s,
        psi_s,
        lambda_s: LAMBDA_PER_PSI * psi_s,
    }
}

/// Returns φ toward a teammate with the time `theirs_s`, s.
pub(super) fn patience_s(strategy: Strategy, knowledge: &TaskTimes, theirs_s: f64) -> f64 {
    let by_strategy = match strategy {
        Strategy::I => knowledge.own_s,
        Strategy::II => knowledge.best_s,
        Strategy::III | Strategy::IV => theirs_s,
    };
    by_strategy.min(PATIENCE_CAP * knowledge.shortest_s)
}

/// Limits a delay to a share of the shortest patience.
pub(super) fn clamp_delay_s(delay_s: f64, shortest_patience_s: f64) -> f64 {
    delay_s.min(SLOWEST * shortest_patience_s)
}

/// Returns whether tasks that others are better at must wait until the robot is bored.
pub(super) fn has_categories(config: &Config) -> bool {
    config.strategy == Strategy::IV || config.ordering != Ordering::LongestFirst
}

//! From learned times to the values of ALLIANCE: strategies, orderings, categories (ALLOCATORS.md §3).

use alliance_proto::ids::RobotId;

use super::config::{Config, Ordering, Strategy};

/// φ is at most so many times the shortest time that is known of any robot: else the failed trials of a robot that only talks would buy
/// it patience without end.
pub(super) const PATIENCE_CAP: f64 = 3.0;

/// λ in units of ψ.
pub(super) const GIVING_UP: f64 = 3.0;

/// A delay is at most this part of the shortest φ, so that δ_slow < δ_fast.
const SLOWEST: f64 = 0.9;

/// Who is best at a task and whether somebody is at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Category {
    /// The robot is the best one of those present, and nobody is at it.
    Mine,
    /// All other tasks.
    Others,
}

/// What a robot knows of one of its own tasks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knowledge {
    /// What the robot itself needs, s.
    pub own_s: f64,
    /// The shortest time of those present who can do it, itself included, s.
    pub best_s: f64,
    /// The shortest time of any robot that has made a trial, or of the robot itself, s.
    pub shortest_s: f64,
    pub category: Category,
}

/// What follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rates {
    /// Time in which the motivation grows to θ while nobody is at the task, s, before it is clamped.
    pub delay_s: f64,
    /// ψ, s.
    pub psi_s: f64,
    /// λ, s.
    pub lambda_s: f64,
}

/// Whether the first of two robots is better at a task: of equal times the lower rank.
pub(super) fn goes_before(one: (f64, RobotId), other: (f64, RobotId)) -> bool {
    one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)).is_lt()
}

/// Delay, ψ and λ. `span_s` are the shortest and the longest time of any robot on any task, `draw` is from [0, 1).
pub(super) fn rates(
    config: &Config,
    knowledge: &Knowledge,
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
            Category::Mine => longest_first,
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
        lambda_s: GIVING_UP * psi_s,
    }
}

/// φ toward a teammate that needs `theirs_s`, s.
pub(super) fn patience_s(strategy: Strategy, knowledge: &Knowledge, theirs_s: f64) -> f64 {
    let by_strategy = match strategy {
        Strategy::I => knowledge.own_s,
        Strategy::II => knowledge.best_s,
        Strategy::III | Strategy::IV => theirs_s,
    };
    by_strategy.min(PATIENCE_CAP * knowledge.shortest_s)
}

/// A delay that is in keeping with the shortest patience.
pub(super) fn clamped_s(delay_s: f64, shortest_patience_s: f64) -> f64 {
    delay_s.min(SLOWEST * shortest_patience_s)
}

/// Whether tasks that others are better at have to wait until the robot is bored.
pub(super) fn has_categories(config: &Config) -> bool {
    config.strategy == Strategy::IV || config.ordering != Ordering::LongestFirst
}

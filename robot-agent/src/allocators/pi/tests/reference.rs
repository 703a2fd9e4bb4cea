//! The cost of lists and the best assignment, computed in another way than the rule does.

use crate::allocators::consensus::team::best_distribution;
use crate::allocators::team::Situation;

/// Computes Σ r·t over the tasks of a list.
pub fn cost(situation: &Situation, rank: usize, list: &[usize]) -> f64 {
    let times = situation.times(rank, list).into_iter().zip(list);
    times
        .map(|(time_s, &task)| situation.tasks[task].reward * time_s)
        .sum()
}

/// Computes the least cost of all lists that contain each task once, with at most `most` tasks per robot.
pub fn optimum(situation: &Situation, most: usize) -> f64 {
    let cost = |rank: usize, list: &[usize]| cost(situation, rank, list);
    best_distribution(situation, most, false, cost, f64::min)
}

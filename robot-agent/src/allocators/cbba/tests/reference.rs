//! The expected results of CBBA, computed in other ways.

use crate::allocators::consensus::team::best_distribution;
use crate::allocators::team::Situation;

/// The tasks of each robot in the order of assignment, with the bids.
pub type Assignment = Vec<Vec<(usize, f32)>>;

/// Computes the sequential greedy assignment with warped scores: repeats the best pair of all, by priority, bid, rank
/// and task.
pub fn greedy(situation: &Situation, most: usize) -> Assignment {
    let robots = situation.cost_s.len();
    let mut assigned: Assignment = vec![Vec::new(); robots];
    let mut paths: Vec<Vec<usize>> = vec![Vec::new(); robots];
    let places = situation.tasks.iter().map(|task| task.max_robots);
    let mut places: Vec<usize> = places.collect();
    let priority = |task: usize| situation.tasks[task].priority;
    loop {
        let mut best: Option<(i32, f32, usize, usize, usize)> = None;
        for robot in 0..robots {
            for (task, &left) in places.iter().enumerate() {
                let is_out = assigned[robot].len() >= most || paths[robot].contains(&task);
                if is_out || left == 0 {
                    continue;
                }
                let before = situation.score(robot, &paths[robot]);
                let mut gains = (0..=paths[robot].len()).map(|at| {
                    let mut path = paths[robot].clone();
                    path.insert(at, task);
                    (at, situation.score(robot, &path) - before)
                });
                let first = gains.next().unwrap();
                let (at, gain) = gains.fold(first, |a, b| if b.1 > a.1 { b } else { a });
                let earlier = assigned[robot].iter();
                let same = earlier.filter(|other| priority(other.0) == priority(task));
                let bid = same.fold(gain.max(0.0) as f32, |least, other| least.min(other.1));
                let priority = priority(task);
                if best.is_none_or(|(other, most, ..)| (priority, bid) > (other, most)) {
                    best = Some((priority, bid, robot, task, at));
                }
            }
        }
        let Some((_, bid, robot, task, at)) = best else {
            return assigned;
        };
        places[task] -= 1;
        assigned[robot].push((task, bid));
        paths[robot].insert(at, task);
    }
}

/// Computes the largest sum of scores with at most `most` tasks per robot.
pub fn optimum(situation: &Situation, most: usize) -> f64 {
    let score = |rank: usize, path: &[usize]| situation.score(rank, path);
    best_distribution(situation, most, true, score, f64::max)
}

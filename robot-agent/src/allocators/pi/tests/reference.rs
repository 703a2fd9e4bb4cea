//! The cost of lists and the best assignment, computed in another way than the rule does.

use crate::allocators::consensus::team::Work;

/// Computes Σ r·t over the tasks of a list.
pub fn cost(work: &Work, robot: usize, list: &[usize]) -> f64 {
    let times = work.times(robot, list).into_iter().zip(list);
    times
        .map(|(time_s, &task)| work.reward[task] * time_s)
        .sum()
}

/// Computes the least cost of all lists that contain each task once, with at most `most` tasks per robot. Tries all
/// ways to distribute the tasks, and all orders of each share.
pub fn optimum(work: &Work, most: usize) -> f64 {
    let (robots, tasks) = (work.robots(), work.tasks());
    let mut best = f64::INFINITY;
    for mut code in 0..robots.pow(tasks as u32) {
        let mut shares = vec![Vec::new(); robots];
        for task in 0..tasks {
            shares[code % robots].push(task);
            code /= robots;
        }
        if shares.iter().all(|share| share.len() <= most) {
            let costs = shares
                .iter()
                .enumerate()
                .map(|(robot, share)| best_order(work, robot, &mut Vec::new(), share));
            best = best.min(costs.sum());
        }
    }
    best
}

fn best_order(work: &Work, robot: usize, list: &mut Vec<usize>, left: &[usize]) -> f64 {
    if left.is_empty() {
        return cost(work, robot, list);
    }
    let mut best = f64::INFINITY;
    for &next in left {
        let rest: Vec<usize> = left.iter().copied().filter(|task| *task != next).collect();
        list.push(next);
        best = best.min(best_order(work, robot, list, &rest));
        list.pop();
    }
    best
}

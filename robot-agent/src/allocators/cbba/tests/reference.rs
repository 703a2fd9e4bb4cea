//! The expected results of CBBA, computed in other ways.

use crate::allocators::consensus::team::Work;

/// The tasks of each robot in the order of assignment, with the bids.
pub type Assignment = Vec<Vec<(usize, f32)>>;

/// Computes the sequential greedy assignment with warped scores: repeats the best pair of all, by priority, bid, rank
/// and task.
pub fn greedy(work: &Work, most: usize) -> Assignment {
    let mut assigned: Assignment = vec![Vec::new(); work.robots()];
    let mut paths: Vec<Vec<usize>> = vec![Vec::new(); work.robots()];
    let mut places = work.max_robots.clone();
    loop {
        let mut best: Option<(i32, f32, usize, usize, usize)> = None;
        for robot in 0..work.robots() {
            for (task, &left) in places.iter().enumerate() {
                let is_out = assigned[robot].len() >= most || paths[robot].contains(&task);
                if is_out || left == 0 {
                    continue;
                }
                let before = work.score(robot, &paths[robot]);
                let mut gains = (0..=paths[robot].len()).map(|at| {
                    let mut path = paths[robot].clone();
                    path.insert(at, task);
                    (at, work.score(robot, &path) - before)
                });
                let first = gains.next().unwrap();
                let (at, gain) = gains.fold(first, |a, b| if b.1 > a.1 { b } else { a });
                let earlier = assigned[robot].iter();
                let same = earlier.filter(|other| work.priority[other.0] == work.priority[task]);
                let bid = same.fold(gain.max(0.0) as f32, |least, other| least.min(other.1));
                let priority = work.priority[task];
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

/// Computes the largest sum of scores with at most `most` tasks per robot. Tries all ways to distribute exclusive tasks
/// and all orders of each share.
pub fn optimum(work: &Work, most: usize) -> f64 {
    let (robots, tasks) = (work.robots(), work.tasks());
    let mut best = 0.0_f64;
    for mut code in 0..(robots + 1).pow(tasks as u32) {
        let mut shares = vec![Vec::new(); robots + 1];
        for task in 0..tasks {
            shares[code % (robots + 1)].push(task);
            code /= robots + 1;
        }
        if shares[..robots].iter().all(|share| share.len() <= most) {
            let scores =
                (0..robots).map(|robot| best_order(work, robot, &mut Vec::new(), &shares[robot]));
            best = best.max(scores.sum());
        }
    }
    best
}

fn best_order(work: &Work, robot: usize, path: &mut Vec<usize>, left: &[usize]) -> f64 {
    if left.is_empty() {
        return work.score(robot, path);
    }
    let mut best = 0.0_f64;
    for &next in left {
        let rest: Vec<usize> = left.iter().copied().filter(|task| *task != next).collect();
        path.push(next);
        best = best.max(best_order(work, robot, path, &rest));
        path.pop();
    }
    best
}

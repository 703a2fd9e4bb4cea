//! What CBBA should come to, worked out in other ways.

use super::team::Work;

/// What each robot gets: its tasks in the order in which they were given, with the bids.
pub type Assignment = Vec<Vec<(usize, f32)>>;

/// Sequential greedy assignment with warped scores: again and again the best pair of all, by priority, bid, rank and task.
pub fn greedy(work: &Work, most: usize) -> Assignment {
    let mut given: Assignment = vec![Vec::new(); work.robots()];
    let mut paths: Vec<Vec<usize>> = vec![Vec::new(); work.robots()];
    let mut places = work.max_robots.clone();
    loop {
        let mut best: Option<(i32, f32, usize, usize, usize)> = None;
        for robot in 0..work.robots() {
            for (task, &left) in places.iter().enumerate() {
                let is_out = given[robot].len() >= most || paths[robot].contains(&task);
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
                let earlier = given[robot].iter();
                let same = earlier.filter(|it| work.priority[it.0] == work.priority[task]);
                let bid = same.fold(gain.max(0.0) as f32, |least, it| least.min(it.1));
                let priority = work.priority[task];
                if best.is_none_or(|(other, most, ..)| (priority, bid) > (other, most)) {
                    best = Some((priority, bid, robot, task, at));
                }
            }
        }
        let Some((_, bid, robot, task, at)) = best else {
            return given;
        };
        places[task] -= 1;
        given[robot].push((task, bid));
        paths[robot].insert(at, task);
    }
}

/// The largest sum of scores of all assignments in which nobody has more than `most` tasks: every way to deal out exclusive tasks, and
/// every order of each share.
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
        let rest: Vec<usize> = left.iter().copied().filter(|it| *it != next).collect();
        path.push(next);
        best = best.max(best_order(work, robot, path, &rest));
        path.pop();
    }
    best
}

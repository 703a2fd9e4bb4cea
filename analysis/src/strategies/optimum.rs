//! The optimum of an instance, computed with full information.

use super::instance::Instance;

/// Returns the least makespan over all assignments of tasks to capable robots, s, by branch and bound. A robot does its tasks
/// one after the other, in any order.
///
/// # Panics
/// Panics if no robot can do a task.
#[must_use]
pub fn makespan_s(instance: &Instance) -> u32 {
    let mut tasks: Vec<usize> = (0..instance.tasks()).collect();
    let fastest_s = |task: usize| {
        let times_s = instance.times_s.iter().filter_map(|times_s| times_s[task]);
        times_s.min().expect("at least one robot can do each task")
    };
    // Tasks with the longest minimum time come first.
    tasks.sort_by_key(|&task| std::cmp::Reverse(fastest_s(task)));
    let mut search = Search {
        instance,
        loads_s: vec![0; instance.times_s.len()],
        left_s: tasks.iter().map(|&task| fastest_s(task)).sum(),
        best_s: u32::MAX,
    };
    search.branch(&tasks);
    search.best_s
}

/// Returns the least energy, J: each task is done by the robot with the lowest energy for it.
#[must_use]
pub fn energy_j(instance: &Instance) -> f64 {
    let cost_j = |task: usize| {
        let robots = instance.times_s.iter().zip(&instance.powers_w);
        let costs_j =
            robots.filter_map(|(times_s, power_w)| Some(f64::from(times_s[task]?) * power_w));
        costs_j.fold(f64::INFINITY, f64::min)
    };
    (0..instance.tasks()).map(cost_j).sum()
}

struct Search<'i> {
    instance: &'i Instance,
    /// The time of the assigned tasks, by robot.
    loads_s: Vec<u32>,
    /// The time of the unassigned tasks, each by its fastest robot.
    left_s: u32,
    best_s: u32,
}

impl Search<'_> {
    fn branch(&mut self, tasks: &[usize]) {
        let longest_s = self.loads_s.iter().copied().max().unwrap_or(0);
        let Some((&task, rest)) = tasks.split_first() else {
            self.best_s = self.best_s.min(longest_s);
            return;
        };
        // All robots together have at least this much work.
        let robots = self.loads_s.len() as u32;
        let even_s = (self.loads_s.iter().sum::<u32>() + self.left_s).div_ceil(robots);
        if longest_s.max(even_s) >= self.best_s {
            return;
        }
        let mut able: Vec<(u32, usize)> = (0..)
            .zip(&self.instance.times_s)
            .filter_map(|(robot, times_s)| Some((self.loads_s[robot] + times_s[task]?, robot)))
            .collect();
        // Robots that would finish first are tried first, which gives a good bound early.
        able.sort_unstable();
        let fastest_s = able
            .iter()
            .map(|&(end_s, robot)| end_s - self.loads_s[robot])
            .min();
        let fastest_s = fastest_s.unwrap_or(0);
        self.left_s -= fastest_s;
        for (end_s, robot) in able {
            if end_s >= self.best_s {
                break;
            }
            let before_s = std::mem::replace(&mut self.loads_s[robot], end_s);
            self.branch(rest);
            self.loads_s[robot] = before_s;
        }
        self.left_s += fastest_s;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns the least makespan over all assignments by exhaustive search.
    fn exhaustive_s(instance: &Instance) -> u32 {
        let robots = instance.times_s.len();
        let assignments = (0..robots.pow(instance.tasks() as u32)).map(|number| {
            let mut rest = number;
            let mut loads_s = vec![0; robots];
            for task in 0..instance.tasks() {
                loads_s[rest % robots] += instance.times_s[rest % robots][task]?;
                rest /= robots;
            }
            loads_s.into_iter().max()
        });
        assignments.flatten().min().unwrap()
    }

    /// Optimum by hand: one robot takes the tasks of 5 and 4 s, the other that of 6 s; one robot never takes all three.
    #[test]
    fn the_optimum_matches_hand_calculation() {
        let instance = Instance {
            times_s: vec![
                vec![Some(5), Some(4), Some(6)],
                vec![Some(9), None, Some(8)],
            ],
            powers_w: vec![1.0, 0.5],
        };
        assert_eq!(makespan_s(&instance), 9);
        // 4.5 of 5, 4, and 4 of 6 J.
        assert_eq!(energy_j(&instance), 12.5);
    }

    fn instances() -> impl Strategy<Value = Instance> {
        (1..=4_usize, 1..=6_usize).prop_flat_map(|(robots, tasks)| {
            let times = prop::collection::vec(prop::option::of(1..=50_u32), tasks);
            let sure = prop::collection::vec((0..robots, 1..=50_u32), tasks);
            (prop::collection::vec(times, robots), sure).prop_map(move |(mut times_s, sure)| {
                for (task, (robot, time_s)) in sure.into_iter().enumerate() {
                    times_s[robot][task] = Some(time_s);
                }
                Instance {
                    powers_w: vec![1.0; robots],
                    times_s,
                }
            })
        })
    }

    proptest! {
        #[test]
        fn no_assignment_is_better(instance in instances()) {
            prop_assert_eq!(makespan_s(&instance), exhaustive_s(&instance));
        }
    }
}

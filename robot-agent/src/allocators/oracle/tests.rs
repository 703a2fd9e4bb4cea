//! The properties of the oracle (docs/allocators/oracle.md).

use proptest::prelude::*;
use proto::tick::TaskOffer;
use scenario::ids::{BehaviorId, RobotId, TaskId};

use super::Oracle;
use super::plan::Plan;
use crate::allocator::{NoParameters, TaskBrief};
use crate::allocators::team::{Situation, Team};
use crate::testkit;

#[test]
fn the_oracle_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Oracle>(&NoParameters {});
}

/// The value of a plan: the sum of its priority ranks, then the sum of its utilities.
type Worth = (usize, f64);

fn briefs(tasks: &[(usize, i32)]) -> Vec<TaskBrief> {
    let brief = |&(max_robots, priority): &(usize, i32)| TaskBrief {
        max_robots,
        priority,
        unit_s: 0.0,
        robots: Vec::new(),
        coalition: None,
    };
    tasks.iter().map(brief).collect()
}

/// Returns the best value by trying all assignments.
fn exhaustive_best(rows: &[Vec<Option<f64>>], left: &mut [usize], rank: &[usize]) -> Worth {
    let Some((row, rest)) = rows.split_first() else {
        return (0, 0.0);
    };
    let mut best = exhaustive_best(rest, left, rank);
    for (task, utility) in row.iter().enumerate() {
        if let (Some(utility), 1..) = (utility, left[task]) {
            left[task] -= 1;
            let (ranks, sum) = exhaustive_best(rest, left, rank);
            left[task] += 1;
            let worth = (ranks + rank[task], sum + utility);
            if worth > best {
                best = worth;
            }
        }
    }
    best
}

fn best(offers: &[TaskOffer], briefs: &[TaskBrief]) -> Vec<TaskOffer> {
    let mut plan = Plan::default();
    plan.compute(offers, briefs);
    plan.assigned(offers).copied().collect()
}

fn offer(robot: usize, task: usize, utility: f64) -> TaskOffer {
    TaskOffer {
        robot: RobotId(robot as u32),
        behavior: BehaviorId(task as u32),
        task: TaskId(task as u32),
        utility,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    /// Compares the plan with all assignments. No robot has two tasks, and no task exceeds its limit.
    #[test]
    fn no_assignment_is_worth_more(
        tasks in prop::collection::vec((1..3_usize, prop_oneof![Just(0), -1..2_i32]), 1..5),
        rows in prop::collection::vec(
            prop::collection::vec(prop::option::weighted(0.8, 0.001..6.0_f64), 5), 1..5,
        ),
    ) {
        let rows: Vec<Vec<Option<f64>>> =
            rows.into_iter().map(|row| row[..tasks.len()].to_vec()).collect();
        let offers: Vec<TaskOffer> = rows
            .iter()
            .enumerate()
            .flat_map(|(robot, row)| {
                let cells = row.iter().enumerate();
                cells.filter_map(move |(task, utility)| Some(offer(robot, task, (*utility)?)))
            })
            .collect();
        let plan = best(&offers, &briefs(&tasks));
        // Only offered tasks count.
        let on_offer = |task: usize| rows.iter().any(|row| row[task].is_some());
        let mut priorities: Vec<i32> =
            (0..tasks.len()).filter(|&task| on_offer(task)).map(|task| tasks[task].1).collect();
        priorities.sort_unstable();
        priorities.dedup();
        let rank: Vec<usize> =
            tasks.iter().map(|(_, priority)| priorities.partition_point(|lower| lower < priority)).collect();
        let mut left: Vec<usize> = tasks.iter().map(|task| task.0).collect();
        let (ranks, most) = exhaustive_best(&rows, &mut left, &rank);
        for offer in &plan {
            prop_assert!(offers.contains(offer));
            prop_assert_eq!(plan.iter().filter(|other| other.robot == offer.robot).count(), 1);
            left[offer.task.index()] = left[offer.task.index()].checked_sub(1).expect("the task has a free place");
        }
        let sum: f64 = plan.iter().map(|offer| offer.utility).sum();
        prop_assert_eq!(plan.iter().map(|offer| rank[offer.task.index()]).sum::<usize>(), ranks);
        prop_assert!((sum - most).abs() < 1e-6, "{} {}", sum, most);
    }

    /// All robots compute the same plan without messages. A robot that cannot work has no task from the next step on,
    /// and a returning robot gets one again.
    #[test]
    fn all_robots_compute_the_same_plan(situation in Situation::arbitrary(4, 4), victim in 0..4_usize, dies: bool) {
        let robots = situation.cost_s.len();
        let victim = victim % robots;
        let most: Vec<usize> = situation.tasks.iter().map(|task| task.max_robots).collect();
        let mut team = Team::<Oracle>::new(situation, NoParameters {});
        for step in 0..90 {
            match step {
                30 if dies => team.kill(victim),
                30 => team.robots[victim].makes_progress = false,
                60 if dies => team.restart(victim),
                60 => team.robots[victim].makes_progress = true,
                _ => {}
            }
            team.step_with(|_, _| false);
            for (task, most) in most.iter().enumerate() {
                prop_assert!(team.executors(task).len() <= *most, "step {step}, task {task}");
            }
            if (30..60).contains(&step) {
                prop_assert_eq!(team.robots[victim].active, None);
            }
        }
        // The complete team keeps its best plan.
        let now: Vec<_> = team.robots.iter().map(|robot| robot.active).collect();
        team.run(3);
        prop_assert_eq!(now, team.robots.iter().map(|robot| robot.active).collect::<Vec<_>>());
    }
}

/// Each robot takes its second best task if the sum is then larger.
#[test]
fn the_sum_counts_and_not_the_best_pair() {
    let offers = [
        offer(0, 0, 0.9),
        offer(0, 1, 0.8),
        offer(1, 0, 0.7),
        offer(1, 1, 0.1),
    ];
    let plan = best(&offers, &briefs(&[(1, 0), (1, 0)]));
    let pairs: Vec<_> = plan
        .iter()
        .map(|offer| (offer.robot.0, offer.task.0))
        .collect();
    assert_eq!(pairs, [(0, 1), (1, 0)]);
    assert_eq!(best(&[], &briefs(&[(1, 0)])), []);
}

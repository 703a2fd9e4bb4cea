//! The properties of BLE (docs/allocators/ble.md), and those of all allocators.

use std::collections::BTreeMap;

use proptest::prelude::*;
use proto::allocation::AllocationMessage;
use proto::allocation::ble::{Eligibility, EligibleTask};
use proto::telemetry::Reason;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::table::{Table, Update};
use super::{Ble, Config};
use crate::allocator::utility::{Bid, DISCOUNT_PER_S};
use crate::allocators::team::{PERIOD, STEP, Situation, TAU, Task, Team, allocator_messages};
use crate::testkit;

type Rows = BTreeMap<RobotId, Vec<EligibleTask>>;

fn team(cost_s: &[&[f64]]) -> Team<Ble> {
    Team::new(Situation::from_costs(cost_s), Config::default())
}

fn opportunist() -> Config {
    Config {
        commit: false,
        ..Config::default()
    }
}

#[test]
fn ble_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Ble>(&Config::default());
    testkit::check_allocator::<Ble>(&opportunist());
}

/// Computes the central greedy assignment directly: takes the best of all pairs, removes both, repeats.
fn greedy(rows: &Rows, tasks: &[Task]) -> BTreeMap<RobotId, TaskId> {
    let mut free: Vec<usize> = tasks.iter().map(|task| task.max_robots).collect();
    let mut assigned = BTreeMap::new();
    loop {
        let pairs = rows.iter().flat_map(|(&robot, row)| {
            row.iter().map(move |entry| Bid {
                priority: tasks[entry.task.index()].priority,
                utility: f64::from(entry.utility),
                robot,
                task: entry.task,
            })
        });
        let left =
            pairs.filter(|bid| free[bid.task.index()] > 0 && !assigned.contains_key(&bid.robot));
        let Some(best) = left.max_by(Bid::order) else {
            return assigned;
        };
        free[best.task.index()] -= 1;
        assigned.insert(best.robot, best.task);
    }
}

/// Updates `rows` with the broadcasts of the latest step. Returns whether they changed.
fn note(rows: &mut Rows, team: &Team<Ble>) -> bool {
    let before = rows.clone();
    for (robot, message) in allocator_messages(&team.in_flight) {
        if let AllocationMessage::Ble(eligibility) = message {
            rows.insert(robot, eligibility.entries.to_vec());
        }
    }
    *rows != before
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// B1: robots with the same rows compute the central greedy assignment, so that an exclusive task has one executor.
    #[test]
    fn b1_the_same_rows_give_the_central_greedy_assignment(
        situation in Situation::arbitrary(5, 5),
        commit in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let config = Config { commit, ..Config::default() };
        let mut team = Team::<Ble>::new(situation, config);
        let (mut rows, mut changed) = (Rows::new(), 0);
        let mut settled = 0;
        for step in 0..300_u64 {
            if chance.random_bool(0.04) {
                team.situation.change(&mut chance, 100.0, 0.2);
            }
            team.step();
            if note(&mut rows, &team) {
                changed = step;
            }
            if step > changed {
                settled += 1;
                let assigned = greedy(&rows, &team.situation.tasks);
                for (rank, robot) in team.robots.iter().enumerate() {
                    prop_assert_eq!(robot.active, assigned.get(&RobotId(rank as u32)).copied());
                }
            }
        }
        prop_assert!(settled > 100);
    }

    /// B2: with equal priorities the sum of utilities is at least half of the optimum.
    #[test]
    fn b2_the_utility_is_at_least_half_of_the_optimum(mut situation in Situation::arbitrary(4, 4)) {
        for task in &mut situation.tasks {
            task.priority = 0;
        }
        let mut team = Team::<Ble>::new(situation.clone(), opportunist());
        team.run(5);
        let utility = |rank: usize, task: usize| {
            let reward = situation.tasks[task].reward;
            situation.cost_s[rank][task].map(|cost_s| reward * DISCOUNT_PER_S.powf(cost_s))
        };
        let total = |assigned: &mut dyn Iterator<Item = (usize, Option<usize>)>| {
            assigned.map(|(rank, task)| task.and_then(|task| utility(rank, task)).unwrap_or(0.0)).sum::<f64>()
        };
        let ours = team.robots.iter().map(|robot| robot.active.map(|task| task.index()));
        let ours = total(&mut ours.enumerate());
        let (robots, tasks) = (situation.cost_s.len(), situation.tasks.len());
        let mut best = 0.0_f64;
        for code in 0..(tasks + 1).pow(robots as u32) {
            let task = |rank: usize| Some(code / (tasks + 1).pow(rank as u32) % (tasks + 1)).filter(|task| *task < tasks);
            let fits = |id: usize| (0..robots).filter(|&rank| task(rank) == Some(id)).count() <= situation.tasks[id].max_robots;
            if (0..tasks).all(fits) {
                best = best.max(total(&mut (0..robots).map(|rank| (rank, task(rank)))));
            }
        }
        prop_assert!(ours >= 0.5 * best - 1e-6, "{ours} of {best}");
    }

    /// B3: robots with the same rows never exceed a task's limit, for any message loss.
    #[test]
    fn b3_robots_with_the_same_rows_do_not_exceed_a_limit(
        situation in Situation::arbitrary(4, 3),
        seed in any::<u64>(),
        loss in 0.0..0.9_f64,
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut team = Team::<Ble>::new(situation, Config::default());
        let robots = team.robots.len();
        // The row of each robot at each robot, itself included, and its receive time.
        let mut known = vec![vec![(Vec::<EligibleTask>::new(), SimTime::ZERO); robots]; robots];
        let mut compared = 0;
        for _ in 0..400 {
            if chance.random_bool(0.02) {
                team.situation.change(&mut chance, 100.0, 0.2);
            }
            let now = team.now();
            team.step_with(|broadcast, receiver| {
                let passes = !chance.random_bool(loss);
                if passes && let Some((sender, AllocationMessage::Ble(eligibility))) = allocator_messages(&[broadcast.clone().into()]).next() {
                    known[receiver.index()][sender.index()] = (eligibility.entries.to_vec(), now);
                }
                passes
            });
            for (sender, message) in allocator_messages(&team.in_flight) {
                if let AllocationMessage::Ble(eligibility) = message {
                    known[sender.index()][sender.index()] = (eligibility.entries.to_vec(), now);
                }
            }
            let table = |rank: usize| -> Vec<_> {
                let rows = known[rank].iter().enumerate();
                rows.map(|(sender, (row, received))| {
                    let counts = sender == rank || now.since(*received) < TAU;
                    if counts { row.clone() } else { Vec::new() }
                })
                .collect()
            };
            for one in 0..robots {
                let like: Vec<usize> = (0..robots).filter(|&other| table(other) == table(one)).collect();
                compared += like.len() - 1;
                for (id, task) in team.situation.tasks.iter().enumerate() {
                    let executors = team.executors(id).into_iter().filter(|rank| like.contains(rank)).count();
                    prop_assert!(executors <= task.max_robots);
                }
            }
        }
        prop_assert!(compared > 0 || robots == 1 || loss > 0.5);
    }

    /// B4: an idle, able robot claims the task of a silent robot within τ + 2δt of its last message.
    #[test]
    fn b4_the_tasks_of_the_silent_are_claimed(
        situation in Situation::arbitrary(5, 3),
        victim in any::<prop::sample::Index>(),
        at in 3..60_u64,
    ) {
        let mut team = Team::<Ble>::new(situation, Config::default());
        let mut last_message = SimTime::ZERO;
        let victim = victim.index(team.robots.len());
        for _ in 0..at {
            let now = team.now();
            team.step();
            if allocator_messages(&team.in_flight).any(|(sender, _)| sender.index() == victim) {
                last_message = now;
            }
        }
        let Some(task) = team.robots[victim].active else { return Ok(()) };
        let can = |rank: usize| team.situation.cost_s[rank][task.index()].is_some();
        let is_idle = |rank: usize| team.robots[rank].active.is_none();
        let others = || (0..team.robots.len()).filter(|&rank| rank != victim);
        prop_assume!(others().any(|rank| is_idle(rank) && can(rank)));
        prop_assume!(team.executors(task.index()) == [victim]);
        team.kill(victim);
        while team.now() < last_message + TAU + STEP + STEP {
            team.step();
        }
        prop_assert!(!team.executors(task.index()).is_empty());
    }

    /// B5: a robot that raises its utility for its task keeps it.
    #[test]
    fn b5_more_utility_loses_no_task(
        situation in Situation::arbitrary(5, 5),
        raised_robot in any::<prop::sample::Index>(),
        more in 0.0..10.0_f32,
    ) {
        let briefs = Team::<Ble>::new(situation.clone(), Config::default()).briefs();
        let me = RobotId(raised_robot.index(situation.cost_s.len()) as u32);
        let table = |raised: Option<TaskId>| {
            let mut table = Table::default();
            for (costs, rank) in situation.cost_s.iter().zip(0..) {
                let entries = costs.iter().zip(0..).filter_map(|(cost_s, task)| {
                    let raise = if raised == Some(TaskId(task)) && me == RobotId(rank) { more } else { 0.0 };
                    Some(EligibleTask { task: TaskId(task), round: SimTime::ZERO, utility: 1.0 / (*cost_s)? as f32 + raise })
                });
                table.set_row_of(RobotId(rank), entries);
            }
            table.assign(&briefs);
            table
        };
        if let Some(task) = table(None).task_of(me) {
            prop_assert_eq!(table(Some(task)).task_of(me), Some(task));
        }
    }

    /// G5: without any messages, a robot that can do all tasks completes them.
    #[test]
    fn g5_all_tasks_are_done_with_all_links_cut(
        robots in 1..4_usize,
        costs in prop::collection::vec(1..8_u32, 1..5),
    ) {
        let mut team = Team::<Ble>::with_work(robots, &costs, Config::default());
        let limit_s = f64::from(2 * costs.iter().sum::<u32>() + 1);
        while team.now().as_secs_f64() < limit_s {
            team.step_with(|_, _| false);
        }
        prop_assert!(team.is_done());
    }
}

/// Two robots start the same task in the same step. The nearer one keeps it, independent of rank; the other takes its
/// next best task one step later.
#[test]
fn the_nearer_of_two_that_start_at_once_stays() {
    let mut team = team(&[&[20.0, 30.0], &[10.0, 80.0]]);
    team.step();
    assert_eq!(team.executors(0), [0, 1]);
    team.step();
    assert_eq!((team.executors(0), team.executors(1)), (vec![1], vec![0]));
    assert_eq!(team.robots[0].outcome.changes[0].reason, Reason::Outbid);
    assert_eq!(team.robots[1].outcome.changes, []);
    // From here on the task under way is worth more than any nearer one.
    team.situation.cost_s[0][0] = Some(1.0);
    team.run(3 * PERIOD.0 / STEP.0);
    assert_eq!((team.executors(0), team.executors(1)), (vec![1], vec![0]));
}

/// A row is received one step after it was sent and is valid for τ; checked to the step.
#[test]
fn the_task_of_a_crashed_robot_is_claimed_exactly_after_tau() {
    let mut team = team(&[&[80.0], &[90.0]]);
    // Both robots have answered each other's first rows, and broadcast again after 1/ρ.
    team.run(2 + PERIOD.0 / STEP.0);
    let last_message = team.now() - STEP;
    assert!(allocator_messages(&team.in_flight).any(|(sender, _)| sender == RobotId(0)));
    team.run(7);
    team.kill(0);
    while team.executors(0).is_empty() {
        team.step();
    }
    assert_eq!(team.now() - STEP, last_message + TAU + STEP);
    assert_eq!(team.robots[1].outcome.changes[0].reason, Reason::Claimed);
    team.run(5);
    // The restarted robot starts without rows. Two steps later it has received the better one.
    team.restart(0);
    team.step();
    assert_eq!(team.executors(0), [0, 1]);
    team.run(2);
    assert_eq!(team.executors(0), [1]);
}

/// Entries with an invalid number, a future round or an unknown task take no task away.
#[test]
fn forged_rows_change_nothing() {
    let mut team = team(&[&[80.0], &[90.0]]);
    team.run(5);
    let sound = EligibleTask {
        task: TaskId(0),
        round: SimTime::ZERO,
        utility: 9.0,
    };
    for entry in [
        EligibleTask {
            utility: f32::NAN,
            ..sound
        },
        EligibleTask {
            utility: f32::INFINITY,
            ..sound
        },
        EligibleTask {
            round: SimTime(u64::MAX),
            ..sound
        },
        EligibleTask {
            task: TaskId(7),
            ..sound
        },
    ] {
        let entries = [entry].into_iter().collect();
        team.inject(1, AllocationMessage::Ble(Eligibility { entries }));
        team.step();
        assert_eq!(team.executors(0), [0], "{entry:?}");
    }
    let entries = [sound].into_iter().collect();
    team.inject(1, AllocationMessage::Ble(Eligibility { entries }));
    team.step();
    assert!(
        team.executors(0).is_empty(),
        "a forged finite utility takes the task"
    );
}

/// A nearer newcomer takes a task over, as in the paper, unless a unit under way keeps its utility. That advantage ends
/// after a minute without progress.
#[test]
fn a_nearer_newcomer_takes_over_without_commitment() {
    for (commit, takes_over_s) in [(false, 0.0..1.2), (true, 60.0..61.2)] {
        let config = Config {
            commit,
            ..Config::default()
        };
        let mut team = Team::<Ble>::new(Situation::from_costs(&[&[90.0], &[100.0]]), config);
        team.run(60);
        assert_eq!(team.executors(0), [0]);
        team.situation.cost_s[1][0] = Some(1.0);
        let since = if commit { SimTime(100) } else { team.now() };
        while team.executors(0) == [0] {
            team.step();
        }
        let took_s = team.now().since(since).as_secs_f64();
        assert!(
            takes_over_s.contains(&took_s),
            "{took_s} s, commit {commit}"
        );
        team.step();
        assert_eq!(team.executors(0), [1]);
    }
}

/// Two robots with equal rows of each other can still conflict if only one of them has a third row. B3 requires equal
/// tables.
#[test]
fn a_third_row_received_by_one_robot_breaks_an_agreement_of_two() {
    // The second robot is best at both tasks. The third is better still at the second task, but the first robot does
    // not receive it.
    let situation = Situation::from_costs(&[&[50.0, 90.0], &[20.0, 10.0], &[99.0, 1.0]]);
    let mut team = Team::<Ble>::new(situation, opportunist());
    for _ in 0..200 {
        team.step_with(|broadcast, receiver| {
            !(broadcast.sender == RobotId(2) && receiver == RobotId(0))
        });
    }
    assert_eq!(team.executors(0), [0, 1]);
    team.run(2 + PERIOD.0 / STEP.0);
    assert_eq!(team.executors(0), [1]);
}

/// Entries of an older round are void, in the robot's own row too. A repeated message, an older one and one of an older
/// incarnation change nothing.
#[test]
fn older_rounds_and_messages_are_ignored() {
    let briefs = Team::<Ble>::new(Situation::from_costs(&[&[1.0]]), Config::default()).briefs();
    let entry = |round_ms, utility| EligibleTask {
        task: TaskId(0),
        round: SimTime(round_ms),
        utility,
    };
    let (me, other) = (RobotId(1), RobotId(0));
    let mut table = Table::default();
    table.set_row_of(me, [entry(1000, 0.9)].into_iter());
    let news = table.receive(other, (2, 7), [entry(2000, 0.1)].into_iter(), SimTime(5000));
    assert!(news.changed && news.is_newcomer);
    table.assign(&briefs);
    assert_eq!(
        (table.task_of(me), table.holder_of(TaskId(0))),
        (None, Some(other))
    );
    for stamp in [(2, 7), (2, 6), (1, 99)] {
        assert_eq!(
            table.receive(other, stamp, [].into_iter(), SimTime(6000)),
            Update::default()
        );
    }
    // An expired row has no entries, and older messages are still rejected.
    assert_eq!(table.drop_older(SimTime(5000), me), (true, None));
    let late = table.receive(other, (2, 5), [entry(2000, 0.1)].into_iter(), SimTime(6000));
    assert_eq!(late, Update::default());
    table.assign(&briefs);
    assert_eq!(table.task_of(me), Some(TaskId(0)));
}

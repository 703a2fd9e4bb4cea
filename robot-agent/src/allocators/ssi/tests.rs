//! The laws of SSI (docs/allocators/ssi.md).

use proptest::prelude::*;
use proto::allocation::AllocationMessage;
use proto::allocation::ssi::{AWARD_BLOCK_TASKS, AuctionBid, Award, CostBid};
use proto::codec::encoded_len;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use super::awards::{Awards, Holder};
use super::path::{Objective, Path, Stop};
use super::{Config, Ssi};
use crate::allocator::{Allocator, Decision, Input};
use crate::allocators::team::{STEP, Situation, TAU, Team, allocator_messages};
use crate::fixtures;
use crate::testkit;

const NEVER: SimTime = SimTime(1_000_000_000);
const OBJECTIVES: [Objective; 3] = [Objective::Sum, Objective::Max, Objective::Mean];

fn config(objective: Objective) -> Config {
    Config {
        objective,
        path_max: 100,
        ..Config::default()
    }
}

#[test]
fn ssi_keeps_the_properties_of_all_allocators() {
    for objective in OBJECTIVES {
        testkit::check_allocator::<Ssi>(&config(objective));
    }
    testkit::check_allocator::<Ssi>(&Config {
        path_max: 1,
        ..Config::default()
    });
}

/// Returns the cost of each robot's path by the objective, with independent arithmetic.
fn path_cost(situation: &Situation, robot: usize, path: &[usize], objective: Objective) -> f64 {
    let (mut end_s, mut sum_s) = (0.0, 0.0);
    for (at, &task) in path.iter().enumerate() {
        let after: Vec<TaskId> = path[..at].iter().map(|&task| TaskId(task as u32)).collect();
        end_s += situation
            .seconds(robot, &after, TaskId(task as u32))
            .unwrap();
        sum_s += end_s;
    }
    if objective == Objective::Mean {
        sum_s
    } else {
        end_s
    }
}

/// Runs the auctions in one place: in each, the least bid of all robots and free tasks wins, of equal bids the lower
/// task, then the lower robot. Returns the paths and the winning bids.
fn central(situation: &Situation, objective: Objective) -> (Vec<Vec<usize>>, Vec<f32>) {
    let robots = situation.cost_s.len();
    let mut paths = vec![Vec::new(); robots];
    let mut bids = Vec::new();
    let mut free: Vec<usize> = (0..situation.tasks.len()).collect();
    while !free.is_empty() {
        let mut all = Vec::new();
        for &task in &free {
            for (robot, path) in paths.iter().enumerate() {
                let before = path_cost(situation, robot, path, objective);
                let with = |at: usize| {
                    let mut path = path.clone();
                    path.insert(at, task);
                    (path_cost(situation, robot, &path, objective), at)
                };
                let (cost, at) = (0..=path.len())
                    .map(with)
                    .reduce(|best, other| if other.0 < best.0 { other } else { best })
                    .unwrap();
                let bid = match objective {
                    Objective::Max => cost,
                    Objective::Sum | Objective::Mean => cost - before,
                };
                all.push(((bid / situation.tasks[task].reward) as f32, task, robot, at));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let (bid, task, robot, at) = all[0];
        paths[robot].insert(at, task);
        bids.push(bid);
        free.retain(|other| *other != task);
    }
    (paths, bids)
}

fn paths(team: &Team<Ssi>) -> Vec<Vec<usize>> {
    let path = |rank| {
        let stops = team.allocator(rank).path.stops.iter();
        stops.map(|stop| stop.task.index()).collect()
    };
    (0..team.robots.len()).map(path).collect()
}

/// Without loss, the team has the paths of the central auction one step per task later, for each objective.
#[test]
fn without_loss_the_team_has_the_paths_of_a_central_auction() {
    for seed in 0..150 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(2..6), chance.random_range(1..9));
        let situation = Situation::on_grid(&mut chance, robots, tasks);
        for objective in OBJECTIVES {
            let mut team = Team::<Ssi>::still(seed, NEVER, situation.clone(), config(objective));
            let (expected, _) = central(&situation, objective);
            team.run(tasks as u64 + 1);
            assert_eq!(paths(&team), expected, "seed {seed}, {objective:?}");
            // Nothing changes later.
            team.run(100);
            assert_eq!(paths(&team), expected, "seed {seed}, {objective:?}");
        }
    }
}

/// The bids are the published values, computed by hand. The robots stand at 0 and 10 on a line, the tasks at 2, 4, 9
/// and −3.
#[test]
fn bids_have_the_values_computed_by_hand() {
    let at = [2.0_f64, 4.0, 9.0, -3.0];
    let seconds = |after: &[TaskId], task: TaskId| {
        let from = after.last().map_or(0.0, |last| at[last.index()]);
        Some((from - at[task.index()]).abs())
    };
    let stop = |task| Stop {
        task: TaskId(task),
        priority: 0,
        place: task as usize,
    };
    let bid = |path: &[u32], task: u32, objective| {
        let path = Path {
            stops: path.iter().map(|&task| stop(task)).collect(),
        };
        let found = path.insertion(objective, (TaskId(task), 0), 0, &seconds);
        found.map(|found| (found.at, found.cost_s)).unwrap()
    };
    for objective in OBJECTIVES {
        assert_eq!(bid(&[], 1, objective), (0, 4.0), "{objective:?}");
    }
    // 0 → 2 → 4 → 9: the task at 2 is on the way.
    assert_eq!(bid(&[1, 2], 0, Objective::Sum), (0, 0.0));
    assert_eq!(bid(&[1, 2], 0, Objective::Max), (0, 9.0));
    // The times 4, 9 become 2, 4, 9.
    assert_eq!(bid(&[1, 2], 0, Objective::Mean), (0, 2.0));
    // −3 costs 6 first (0 → −3 → 4 → 9: 15) and 12 last (21).
    assert_eq!(bid(&[1, 2], 3, Objective::Sum), (0, 6.0));
    assert_eq!(bid(&[1, 2], 3, Objective::Max), (0, 15.0));
    // First: 3, 10, 15 instead of 4, 9: 28 − 13. Last: 4, 9, 21: 34 − 13.
    assert_eq!(bid(&[1, 2], 3, Objective::Mean), (0, 15.0));
}

#[test]
fn a_path_is_in_the_order_of_priority_and_a_unit_under_way_stays_first() {
    let seconds = |_: &[TaskId], _: TaskId| Some(1.0);
    let stop = |task, priority| Stop {
        task: TaskId(task),
        priority,
        place: 0,
    };
    let path = Path {
        stops: vec![stop(0, 2), stop(1, 1), stop(2, 0)],
    };
    let at = |priority, fixed| {
        let found = path.insertion(Objective::Sum, (TaskId(9), priority), fixed, &seconds);
        found.unwrap().at
    };
    assert_eq!((at(3, 0), at(2, 0), at(1, 0), at(0, 0)), (0, 0, 1, 2));
    assert_eq!((at(-1, 0), at(3, 1)), (3, 1));
}

/// Returns the least sum of path costs, by trying each assignment and each order.
fn least_sum(situation: &Situation) -> f64 {
    let (robots, tasks) = (situation.cost_s.len(), situation.tasks.len());
    let assignments = (0..robots.pow(tasks as u32)).map(|code| {
        let mut sets = vec![Vec::new(); robots];
        for task in 0..tasks {
            sets[code / robots.pow(task as u32) % robots].push(task);
        }
        let shortest = |(robot, set): (usize, &Vec<usize>)| {
            let orders = orders(set).into_iter();
            orders
                .map(|path| path_cost(situation, robot, &path, Objective::Sum))
                .fold(f64::INFINITY, f64::min)
        };
        sets.iter().enumerate().map(shortest).sum::<f64>()
    });
    assignments.fold(f64::INFINITY, f64::min)
}

fn orders(set: &[usize]) -> Vec<Vec<usize>> {
    let Some((&first, rest)) = set.split_first() else {
        return vec![Vec::new()];
    };
    let mut all = Vec::new();
    for order in orders(rest) {
        for at in 0..=order.len() {
            let mut order = order.clone();
            order.insert(at, first);
            all.push(order);
        }
    }
    all
}

/// The proved bound of MiniSum: at most twice the optimum, on metric costs without windows.
#[test]
fn minisum_is_at_most_twice_the_optimum() {
    let mut worst: f64 = 1.0;
    for seed in 0..300 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(2..4), chance.random_range(1..6));
        let situation = Situation::at_places(&mut chance, robots, tasks);
        let least = least_sum(&situation);
        let mut team = Team::<Ssi>::still(seed, NEVER, situation, config(Objective::Sum));
        team.run(20);
        let cost = |(robot, path): (usize, &Vec<usize>)| {
            path_cost(&team.situation, robot, path, Objective::Sum)
        };
        let sum: f64 = paths(&team).iter().enumerate().map(cost).sum();
        assert!(sum <= 2.0 * least, "seed {seed}: {sum} > 2 · {least}");
        if least > 0.0 {
            worst = worst.max(sum / least);
        }
    }
    // The instances are hard enough for a difference.
    assert!(worst > 1.1, "{worst}");
}

/// Of equal bids, the lower task is awarded first, to the lower robot.
#[test]
fn ties_go_to_the_lower_task_and_robot() {
    let mut team = Team::<Ssi>::still(
        0,
        NEVER,
        Situation::from_costs(&[&[5.0, 5.0], &[5.0, 5.0]]),
        config(Objective::Max),
    );
    team.run(2);
    assert_eq!(paths(&team), [vec![0], vec![]]);
    team.run(1);
    assert_eq!(paths(&team), [vec![0], vec![1]]);
}

/// Each place of each task has one robot, and no robot has two places of a task.
#[track_caller]
fn check_places(team: &Team<Ssi>, tasks: impl Iterator<Item = usize>, context: &str) {
    let paths = paths(team);
    for task in tasks {
        let holders = paths.iter().flatten().filter(|held| **held == task).count();
        let places = team.situation.tasks[task].max_robots.min(paths.len());
        assert_eq!(holders, places, "{context}: task {task} in {paths:?}");
    }
    for path in &paths {
        let mut tasks = path.clone();
        tasks.sort_unstable();
        tasks.dedup();
        assert_eq!(tasks.len(), path.len(), "{context}: {paths:?}");
    }
}

/// After repeated messages, each place is held once, despite loss, random links and a late start of the links.
#[test]
fn each_task_is_held_once_despite_loss() {
    for loss in [0.3, 0.6] {
        for seed in 0..60 {
            let mut chance = ChaCha8Rng::seed_from_u64(seed);
            let (robots, tasks) = (chance.random_range(2..6), chance.random_range(1..7));
            let mut situation = Situation::on_grid(&mut chance, robots, tasks);
            for task in &mut situation.tasks {
                task.max_robots = chance.random_range(1..robots);
            }
            let objective = OBJECTIVES[seed as usize % 3];
            let mut team = Team::<Ssi>::still(seed, NEVER, situation, config(objective));
            team.loss = loss;
            team.run(1_100);
            check_places(&team, 0..tasks, &format!("seed {seed}, loss {loss}"));
        }
    }
}

/// After a partition, during which both sides hold all tasks, one robot keeps each.
#[test]
fn each_task_is_held_once_after_a_partition() {
    for seed in 0..40 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(2..6), chance.random_range(1..7));
        let situation = Situation::on_grid(&mut chance, robots, tasks);
        let mut team = Team::<Ssi>::still(seed, TAU, situation, Config::default());
        let side = |robot: usize| robot % 2;
        for from in 0..robots {
            for to in 0..robots {
                team.links[from][to] = side(from) == side(to);
            }
        }
        team.run(300);
        let held: usize = paths(&team).iter().map(Vec::len).sum();
        assert_eq!(held, 2 * tasks, "seed {seed}");
        team.links = vec![vec![true; robots]; robots];
        team.run(60);
        check_places(&team, 0..tasks, &format!("seed {seed}"));
    }
}

/// The tasks of a crashed robot are awarded again τ after its last message and two steps for the auction.
#[test]
fn tasks_of_a_crashed_robot_return() {
    let mut team = Team::<Ssi>::still(
        0,
        TAU,
        Situation::from_costs(&[&[1.0, 9.0], &[9.0, 9.0]]),
        config(Objective::Max),
    );
    let mut last = SimTime::ZERO;
    for _ in 0..40 {
        let now = team.now();
        team.step();
        if allocator_messages(&team.in_flight).any(|(sender, _)| sender == RobotId(0))
            || team.in_flight.iter().any(|sent| sent.sender == RobotId(0))
        {
            last = now;
        }
    }
    assert_eq!(paths(&team), [vec![0], vec![1]]);
    team.kill(0);
    while team.allocator(1).path.stops.len() < 2 {
        team.step();
        assert!(team.now() < SimTime(20_000));
    }
    assert_eq!(team.now() - STEP, last + TAU + STEP);
    // A restarted robot takes part again: the plan is auctioned again, except the task that is executed.
    team.restart(0);
    team.run(200);
    check_places(&team, 0..2, "after the restart");
    assert!(!paths(&team)[0].is_empty());
}

/// A robot without any received message holds and does all tasks.
#[test]
fn a_lone_robot_does_everything() {
    let mut team = Team::<Ssi>::with_work(3, &[2, 3, 4, 1, 2], Config::default());
    team.links = vec![vec![false; 3]; 3];
    team.run(1_200);
    assert!(team.is_done());
}

/// A newer task is auctioned when it appears, and one that ceases to be possible leaves the path.
#[test]
fn tasks_that_appear_are_auctioned() {
    let costs: [&[f64]; 2] = [&[1.0, 2.0, 7.0], &[5.0, 3.0, 2.0]];
    let mut team = Team::<Ssi>::still(0, TAU, Situation::from_costs(&costs), Config::default());
    for rank in 0..2 {
        team.applicable[rank][2] = false;
    }
    team.run(50);
    check_places(&team, 0..2, "before");
    assert!(!paths(&team).concat().contains(&2));
    for rank in 0..2 {
        team.applicable[rank] = vec![true, false, true];
    }
    team.run(4);
    assert_eq!(paths(&team), [vec![0], vec![2]]);
}

/// A task that can no longer be done in time after the earlier ones leaves the path, also while no task is free.
#[test]
fn a_task_that_becomes_late_is_auctioned_again() {
    let briefs = (0..2).map(|_| fixtures::brief(2, 1.0)).collect();
    let mut ssi = Ssi::new(
        &fixtures::self_state(RobotId(0), 2, briefs),
        &config(Objective::Max),
    );
    let choices = [fixtures::choice(0, 1.0), fixtures::choice(1, 2.0)];
    let mut decision = Decision::default();
    for tick in 0..=100 {
        let is_late = tick == 100;
        let input = Input {
            choices: &choices,
            // The robot chooses again.
            is_laden: is_late,
            seconds: &|_, _| (!is_late).then_some(1.0),
            ..fixtures::input(SimTime(tick * STEP.0), RobotId(0))
        };
        decision.say.clear();
        decision.rows.clear();
        ssi.step(&input, &mut decision);
        let path: Vec<TaskId> = ssi.path.stops.iter().map(|stop| stop.task).collect();
        match tick {
            99 => assert_eq!(path, [TaskId(0), TaskId(1)]),
            100 => assert_eq!(path, [TaskId(0)]),
            _ => {}
        }
    }
    let place = ssi.awards.find(TaskId(1), 0).unwrap();
    assert!(ssi.awards.place(place).holder.is_none());
}

/// A task appears for the distant robot one step earlier. The auction waits for the answer of the idle, near robot,
/// also if that robot repeats its awards in the step of the bid.
#[test]
fn an_auction_waits_for_the_answers_of_idle_robots() {
    let costs: [&[f64]; 2] = [&[9.0], &[1.0]];
    for idle in 40..60 {
        let mut team = Team::<Ssi>::still(0, TAU, Situation::from_costs(&costs), Config::default());
        team.applicable = vec![vec![false], vec![false]];
        team.run(idle);
        team.applicable[0][0] = true;
        team.step();
        team.applicable[1][0] = true;
        team.run(2);
        assert_eq!(paths(&team), [vec![], vec![0]], "after {idle} steps");
    }
}

/// A task whose robot makes no progress returns to the auctions 60 s after its estimated end, and goes to the robot
/// that is nearest by then.
#[test]
fn a_task_without_progress_is_auctioned_again() {
    let costs: [&[f64]; 2] = [&[5.0], &[9.0]];
    let mut team = Team::<Ssi>::still(0, TAU, Situation::from_costs(&costs), Config::default());
    let since = |team: &mut Team<Ssi>, robot: usize| {
        while team.allocator(robot).path.stops.is_empty() {
            team.step();
            assert!(team.now() < SimTime(100_000));
        }
        team.now() - STEP
    };
    let begun = since(&mut team, 0);
    team.situation.cost_s[1][0] = Some(1.0);
    let again = since(&mut team, 1);
    // The first auction lasts a step. In the second one the other robot answers a step later.
    assert_eq!(again, begun + SimTime(65_000) + STEP + STEP);
    assert_eq!(paths(&team), [vec![], vec![0]]);
}

/// Without an answer, an auction ends `bid_window_s` after the first step in which the robot has a bid.
#[test]
fn an_auction_ends_after_the_window() {
    let costs: [&[f64]; 2] = [&[1.0], &[2.0]];
    let mut team = Team::<Ssi>::still(0, TAU, Situation::from_costs(&costs), Config::default());
    team.links = vec![vec![false; 2]; 2];
    let window = SimTime(500);
    while team.now() < STEP + window {
        team.step();
        assert!(paths(&team).concat().is_empty());
    }
    team.step();
    assert_eq!(paths(&team), [vec![0], vec![0]]);
}

fn awards_of(team: usize, tasks: usize) -> Awards {
    let briefs = (0..tasks).map(|_| fixtures::brief(team, 1.0)).collect();
    Awards::new(&fixtures::self_state(RobotId(0), team, briefs))
}

fn award(task: u32, auction: u32, cost: f32) -> Award {
    Award {
        round: SimTime::ZERO,
        auction,
        bid: CostBid {
            task: TaskId(task),
            slot: 0,
            cost,
        },
    }
}

proptest! {
    /// Of the awards of a place, the one of the earliest auction, lowest bid and lowest robot stays, in any order of
    /// arrival and with repetitions.
    #[test]
    fn corrections_win_by_auction_bid_and_robot(
        claims in prop::collection::vec((1..6_u32, 0..3_u32, 0..3_u8), 1..12),
        order in any::<prop::sample::Index>(),
    ) {
        // Each robot has one award of the place.
        let mut claims: Vec<_> = claims;
        claims.sort_by_key(|claim| claim.0);
        claims.dedup_by_key(|claim| claim.0);
        let first = order.index(claims.len());
        claims.rotate_left(first);
        let mut awards = awards_of(7, 1);
        for &(robot, auction, cost) in claims.iter().chain(&claims) {
            let message = AuctionBid {
                auction: auction + 1,
                bid: None,
                block: 0,
                awards: vec![award(0, auction, f32::from(cost))],
            };
            awards.receive(RobotId(robot), &message, SimTime::ZERO);
        }
        let least = claims.iter().map(|&(robot, auction, cost)| (auction, cost, robot)).min();
        let (auction, cost, robot) = least.unwrap();
        let expected = Holder { robot: RobotId(robot), award: award(0, auction, f32::from(cost)) };
        prop_assert_eq!(awards.place(0).holder, Some(expected));
    }
}

#[test]
fn invalid_and_older_awards_change_nothing() {
    let now = SimTime(100);
    let receive = |awards: &mut Awards, message: &AuctionBid| {
        awards.receive(RobotId(1), message, now);
        awards.place(0).holder.map(|held| held.robot)
    };
    let message = |award: Award| AuctionBid {
        auction: 5,
        bid: None,
        block: 0,
        awards: vec![award],
    };
    let invalid: [fn(&mut AuctionBid); 7] = [
        |message| message.awards[0].bid.cost = f32::NAN,
        |message| message.awards[0].bid.cost = -1.0,
        |message| message.awards[0].bid.slot = 1,
        |message| message.awards[0].bid.task = TaskId(900),
        |message| message.awards[0].round = SimTime(101),
        |message| message.awards[0].auction = 6,
        |message| message.block = u32::MAX,
    ];
    for change in invalid {
        let mut bad = message(award(0, 3, 1.0));
        change(&mut bad);
        assert_eq!(receive(&mut awards_of(3, 1), &bad), None, "{bad:?}");
    }
    let mut awards = awards_of(3, 1);
    assert_eq!(
        receive(&mut awards, &message(award(0, 3, 1.0))),
        Some(RobotId(1))
    );
    // A message of the same auction or an earlier one does not withdraw the award; a later one does.
    for (auction, holder) in [(3, Some(RobotId(1))), (2, Some(RobotId(1))), (4, None)] {
        let without = AuctionBid {
            auction,
            ..AuctionBid::default()
        };
        assert_eq!(receive(&mut awards, &without), holder, "{auction}");
    }
}

#[test]
fn the_longest_message_is_below_the_limit() {
    let longest = AuctionBid {
        auction: u32::MAX,
        bid: Some(award(u32::MAX, 0, f32::MAX).bid),
        block: u32::MAX,
        awards: (0..AWARD_BLOCK_TASKS)
            .map(|_| Award {
                round: SimTime(u64::MAX),
                auction: u32::MAX,
                bid: CostBid {
                    task: TaskId(u32::MAX),
                    slot: u16::MAX,
                    cost: f32::MAX,
                },
            })
            .collect(),
    };
    let length = encoded_len(&AllocationMessage::Ssi(longest)).unwrap();
    assert!(length <= 1200, "{length}");
}

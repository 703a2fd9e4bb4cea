//! Teams of several robots: agreement, its quality, and the effect of message loss, crashes and restarts.

use proto::allocation::consensus::WinningBid;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::time::SimTime;

use super::reference::{cost, optimum};
use crate::allocators::consensus::team::{STEP_MS, Team, Work};
use crate::allocators::pi::{Pi, PiConfig};
use crate::testkit;

/// A τ after which no robot counts as lost within a test.
const NEVER: SimTime = SimTime(1_000_000_000);

/// The time between refreshes: none, or every round.
const REFRESHES: [f64; 2] = [1e6, STEP_MS as f64 / 1000.0];

fn config(tasks: usize, refresh_s: f64) -> PiConfig {
    PiConfig { tasks, refresh_s }
}

fn lists(team: &Team<Pi>) -> Vec<Vec<usize>> {
    let members = team.members.iter();
    members
        .map(|member| member.allocator.list.tasks(&member.allocator.beliefs))
        .collect()
}

fn claims(team: &Team<Pi>) -> Vec<Vec<Option<WinningBid>>> {
    let members = team.members.iter();
    let entries = members.map(|member| member.allocator.beliefs.entries());
    entries
        .map(|entries| entries.iter().map(|entry| entry.claim).collect())
        .collect()
}

fn global_cost(team: &Team<Pi>) -> f64 {
    let lists = lists(team).into_iter().enumerate();
    lists
        .map(|(robot, list)| cost(&team.work, robot, &list))
        .sum()
}

/// A robot holds exactly the places in its list.
#[track_caller]
fn check_claims(team: &Team<Pi>) {
    for member in &team.members {
        let Pi { beliefs, list, .. } = &member.allocator;
        for (place, entry) in beliefs.entries().iter().enumerate() {
            assert_eq!(beliefs.is_mine(place), list.contains(place));
            assert!(entry.claim.is_none_or(|claim| claim.value.is_finite()));
        }
    }
}

fn random_team(seed: u64, refresh_s: f64) -> Team<Pi> {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let (robots, tasks) = (chance.random_range(1..7), chance.random_range(1..9));
    let mut work = Work::random(&mut chance, robots, tasks);
    if chance.random_bool(0.3) {
        for task in 0..tasks {
            work.priority[task] = chance.random_range(0..2);
        }
    }
    if chance.random_bool(0.3) {
        for task in 0..tasks {
            work.max_robots[task] = chance.random_range(1..4);
        }
    }
    let config = config(chance.random_range(1..6), refresh_s);
    let mut team = Team::new(seed, work, &config, NEVER);
    if chance.random_bool(0.7) {
        team.connect_as_line(if chance.random_bool(0.5) { 0.3 } else { 0.0 });
    }
    team
}

#[test]
fn pi_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Pi>(&PiConfig::default());
    testkit::check_allocator::<Pi>(&config(1, 0.1));
    testkit::check_allocator::<Pi>(&config(16, 3.0));
}

/// After a bounded number of rounds nothing changes, all robots have the same claims, no task has more robots than
/// places, and no task that a robot has room for is left out.
#[test]
fn teams_agree_without_conflict() {
    let mut at_limit = 0;
    for seed in 0..600 {
        let mut team = random_team(seed, REFRESHES[seed as usize % 2]);
        let rounds = 20 * (team.work.tasks() + 2) * team.diameter().max(1);
        for _ in 0..rounds {
            team.step();
            check_claims(&team);
        }
        let (settled, agreed) = (lists(&team), claims(&team));
        for other in &agreed {
            assert_eq!(*other, agreed[0], "seed {seed}: {:?}", team.work);
        }
        for task in 0..team.work.tasks() {
            let holders = settled.iter().filter(|list| list.contains(&task)).count();
            let places = team.work.max_robots[task];
            // A task for all robots needs no agreement.
            assert!(holders <= places.max(if places >= team.work.robots() { 99 } else { 0 }));
            let has_room = settled.iter().any(|list| {
                let most = team.members[0].allocator.config.tasks;
                !list.contains(&task) && list.len() < most
            });
            assert!(holders >= places || !has_room, "seed {seed}: task {task}");
        }
        for _ in 0..20 {
            team.step();
        }
        assert_eq!(claims(&team), agreed, "seed {seed}");
        if seed % 2 == 0 {
            assert_eq!(team.in_flight(), 0, "messages remain, seed {seed}");
        }
        let mut members = team.members.iter();
        at_limit += u32::from(members.any(|member| member.allocator.list.is_at_limit()));
    }
    println!("at the limit of takes: {at_limit} of 600");
}

/// The shares of small cases with the optimum.
#[test]
fn most_small_cases_reach_the_optimum() {
    const CASES: u64 = 500;
    let (mut optimal, mut worst, mut sum) = (0, 1.0_f64, 0.0);
    let mut single = 0;
    for seed in 0..CASES {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(2..4), chance.random_range(2..6));
        let mut work = Work::random(&mut chance, robots, tasks);
        work.reward = vec![1.0; tasks];
        let mut team = Team::<Pi>::new(seed, work.clone(), &config(tasks, 1e6), NEVER);
        for _ in 0..100 {
            team.step();
        }
        let done: usize = lists(&team).iter().map(Vec::len).sum();
        assert_eq!(done, tasks, "seed {seed}");
        let share = global_cost(&team) / optimum(&work, tasks);
        optimal += u32::from(share < 1.0 + 1e-9);
        worst = worst.max(share);
        sum += share;
        single += u32::from(share < 1.05);
    }
    println!(
        "optimal {optimal} of {CASES}, within 5 %: {single}, mean {}, worst {worst}",
        sum / CASES as f64
    );
    assert!(optimal >= 300, "{optimal}");
}

/// The global cost of conflict-free states over time, while all messages arrive.
#[test]
fn the_global_cost_seldom_rises() {
    let (mut teams, mut risen, mut higher) = (0, 0, 0);
    for seed in 0..500 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(2..6), chance.random_range(2..9));
        let work = Work::random(&mut chance, robots, tasks);
        let mut team = Team::<Pi>::new(seed, work, &config(tasks, 1e6), NEVER);
        let mut costs = Vec::new();
        for _ in 0..200 {
            team.step();
            let lists = lists(&team);
            let held: usize = lists.iter().map(Vec::len).sum();
            let is_whole = (0..tasks).all(|task| lists.iter().any(|list| list.contains(&task)));
            if held == tasks && is_whole {
                costs.push(global_cost(&team));
            }
        }
        let rises = costs.windows(2).any(|pair| pair[1] > pair[0] + 1e-9);
        risen += u32::from(rises);
        higher += u32::from(costs.last().unwrap() > &(costs[0] + 1e-9));
        teams += 1;
    }
    println!("of {teams} teams, the cost rose in {risen}, and was higher at the end in {higher}");
}

/// Repeated broadcasts lead to an agreement despite message loss.
#[test]
fn teams_agree_despite_message_loss() {
    for loss in [0.3, 0.6] {
        for seed in 0..80 {
            let mut team = random_team(seed, REFRESHES[1]);
            team.loss = loss;
            for _ in 0..600 {
                team.step();
                check_claims(&team);
            }
            let agreed = claims(&team);
            for other in &agreed {
                assert_eq!(*other, agreed[0], "seed {seed}, loss {loss}");
            }
        }
    }
}

/// Message losses, cut links, crashes, restarts and new rounds occur in any order. Afterwards all robots agree, and no
/// task is held by a robot that is gone or does not have it in its list.
#[test]
fn teams_agree_after_trouble() {
    for seed in 0..200 {
        let mut team = random_team(seed, 1.0);
        let tau = SimTime(5000);
        let config = team.members[0].allocator.config;
        let robots = team.members.len();
        for robot in 0..robots {
            team.members[robot] = team.fresh_member(robot, 1, &config, tau);
        }
        let mut incarnations = vec![1; robots];
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..10 {
            team.loss = [0.0, 0.3, 0.9][chance.random_range(0..3)];
            for link in team.links.iter_mut().flatten() {
                *link = chance.random_bool(0.7);
            }
            let robot = chance.random_range(0..robots);
            match chance.random_range(0..4) {
                0 => team.crashed[robot] = true,
                1 => {
                    incarnations[robot] += 1;
                    team.members[robot] =
                        team.fresh_member(robot, incarnations[robot], &config, tau);
                    team.crashed[robot] = false;
                }
                2 => {
                    let task = chance.random_range(0..team.work.tasks());
                    team.round[task] = team.now();
                }
                _ => {}
            }
            for _ in 0..chance.random_range(1..150) {
                team.step();
                check_claims(&team);
            }
        }
        team.loss = 0.0;
        team.links
            .iter_mut()
            .flatten()
            .for_each(|link| *link = true);
        for _ in 0..300 {
            team.step();
        }
        let alive = (0..robots).filter(|robot| !team.crashed[*robot]);
        let (views, lists) = (claims(&team), lists(&team));
        let agreed = alive.clone().map(|robot| &views[robot]).next();
        for robot in alive {
            assert_eq!(Some(&views[robot]), agreed, "seed {seed}, robot {robot}");
        }
        let entries = team.members[0].allocator.beliefs.entries();
        for (entry, claim) in entries.iter().zip(agreed.into_iter().flatten()) {
            let Some(claim) = claim else { continue };
            let holder = claim.robot.index();
            let has_task = lists[holder].contains(&entry.task.index());
            assert!(!team.crashed[holder] && has_task, "seed {seed}: {claim:?}");
        }
    }
}

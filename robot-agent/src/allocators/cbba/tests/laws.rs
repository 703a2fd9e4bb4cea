//! Laws C1 to C5: consensus, what it comes to, and what loss does to it.

use alliance_proto::time::SimTime;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::reference::{Assignment, greedy, optimum};
use super::team::{STEP_MS, Team, Work};
use crate::allocators::cbba::{BundleConfig, Cbaa, Cbba, SingleConfig};
use crate::testkit;

/// Nobody is ever taken for dead.
const NEVER: SimTime = SimTime(1_000_000_000);

/// Tables go out on a change alone, or in every round.
const REFRESHES: [f64; 2] = [1e6, STEP_MS as f64 / 1000.0];

fn assignment(team: &Team<Cbba>) -> Assignment {
    let of = |robot: usize| {
        let bidder = &team.members[robot].allocator.0;
        let bids = bidder.bundle.bids(&bidder.beliefs).into_iter();
        bids.map(|(task, bid)| (task.index(), bid)).collect()
    };
    (0..team.members.len()).map(of).collect()
}

/// What everybody believes.
fn beliefs(team: &Team<Cbba>) -> Vec<Vec<super::super::beliefs::Entry>> {
    let members = team.members.iter();
    let entries = |entry: &super::super::beliefs::Entry| super::super::beliefs::Entry {
        is_unsaid: false,
        ..entry.clone()
    };
    members
        .map(|it| {
            it.allocator
                .0
                .beliefs
                .entries()
                .iter()
                .map(entries)
                .collect()
        })
        .collect()
}

/// C4: a robot believes to have what is in its bundle, and no bid is negative.
#[track_caller]
fn check_beliefs(team: &Team<Cbba>) {
    for member in &team.members {
        let bidder = &member.allocator.0;
        for (place, entry) in bidder.beliefs.entries().iter().enumerate() {
            assert_eq!(bidder.beliefs.is_mine(place), bidder.bundle.holds(place));
            assert!(entry.claim.is_none_or(|claim| claim.value >= 0.0));
        }
    }
}

fn random_team(seed: u64, refresh_s: f64) -> (Team<Cbba>, usize) {
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
    let bundle = chance.random_range(1..4);
    let config = BundleConfig { bundle, refresh_s };
    let mut team = Team::new(seed, work, &config, NEVER);
    if chance.random_bool(0.7) {
        team.connect_as_line(if chance.random_bool(0.5) { 0.3 } else { 0.0 });
    }
    (team, bundle)
}

#[test]
fn cbaa_and_cbba_keep_the_laws_of_all_allocators() {
    testkit::allocator::<Cbba>(&BundleConfig::default());
    testkit::allocator::<Cbba>(&BundleConfig {
        bundle: 4,
        refresh_s: 0.1,
    });
    testkit::allocator::<Cbaa>(&SingleConfig::default());
}

/// C1, C2 and C4: after min(m, L_t·n)·D rounds nothing changes; all believe the same, which is what sequential greedy comes to.
#[test]
fn without_loss_all_agree_on_what_greedy_comes_to() {
    for seed in 0..600 {
        let (mut team, bundle) = random_team(seed, REFRESHES[seed as usize % 2]);
        let work = team.work.clone();
        let places: usize = work.max_robots.iter().sum();
        let rounds = places.min(bundle * work.robots()) * team.diameter();
        for _ in 0..=rounds {
            team.step();
            check_beliefs(&team);
        }
        let (settled, agreed) = (assignment(&team), beliefs(&team));
        assert_eq!(settled, greedy(&work, bundle), "C2, seed {seed}: {work:?}");
        for other in &agreed {
            assert_eq!(*other, agreed[0], "C1, seed {seed}: {work:?}");
        }
        for _ in 0..20 {
            team.step();
        }
        assert_eq!(beliefs(&team), agreed, "C1, seed {seed}");
        if seed % 2 == 0 {
            assert_eq!(team.on_air(), 0, "nothing is left to say, seed {seed}");
        }
    }
}

/// C3: the sum of scores is at least half of the best one.
#[test]
fn it_is_at_least_half_as_good_as_the_optimum() {
    let mut worst = 1.0_f64;
    for seed in 0..300 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(1..4), chance.random_range(1..5));
        let bundle = chance.random_range(1..3);
        let config = BundleConfig {
            bundle,
            refresh_s: 1e6,
        };
        let work = Work::random(&mut chance, robots, tasks);
        let mut team = Team::<Cbba>::new(seed, work.clone(), &config, NEVER);
        for _ in 0..30 {
            team.step();
        }
        let score = |(robot, _): (usize, &Vec<_>)| {
            let bundle = &team.members[robot].allocator.0.bundle;
            let beliefs = &team.members[robot].allocator.0.beliefs;
            let path: Vec<usize> = bundle.path(beliefs).iter().map(|it| it.index()).collect();
            work.score(robot, &path)
        };
        let sum: f64 = assignment(&team).iter().enumerate().map(score).sum();
        let share = sum / optimum(&work, bundle);
        assert!(share >= 0.5, "C3, seed {seed}: {share}");
        worst = worst.min(share);
    }
    println!("worst share of the optimum: {worst:.3}");
}

/// C5: where messages are lost, repeating them leads to the same.
#[test]
fn with_loss_the_same_is_reached_in_the_end() {
    for (loss, most) in [(0.3, 200), (0.6, 400)] {
        let mut rounds_of_all = 0;
        for seed in 0..80 {
            let (mut team, bundle) = random_team(seed, REFRESHES[1]);
            team.loss = loss;
            let wanted = greedy(&team.work, bundle);
            let is_settled = |team: &Team<Cbba>| {
                let believed = beliefs(team);
                assignment(team) == wanted && believed.iter().all(|it| *it == believed[0])
            };
            let mut rounds = 0;
            while !is_settled(&team) {
                team.step();
                check_beliefs(&team);
                rounds += 1;
                assert!(
                    rounds < most,
                    "C5, seed {seed}, loss {loss}: {:?}",
                    team.work
                );
            }
            for _ in 0..50 {
                team.step();
                assert!(is_settled(&team), "C5, seed {seed}, loss {loss}");
            }
            rounds_of_all += rounds;
        }
        println!("loss {loss}: {:.1} rounds", f64::from(rounds_of_all) / 80.0);
    }
}

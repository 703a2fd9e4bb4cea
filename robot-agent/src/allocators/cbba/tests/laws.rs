//! The properties C1 to C5: consensus, its result, and the effect of message loss.

use proto::allocation::consensus::WinningBid;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::TaskId;
use scenario::time::SimTime;

use super::reference::{Assignment, greedy, optimum};
use crate::allocator::Allocator;
use crate::allocators::cbba::bundle::Bundle;
use crate::allocators::cbba::{Acbba, AcbbaConfig, Cbaa, CbaaConfig, Cbba, CbbaConfig};
use crate::allocators::consensus::team::{STEP_MS, Team, Work};
use crate::allocators::consensus::winners::{Entry, Winners};
use crate::testkit;

/// A τ after which no robot counts as lost within a test.
pub(crate) const NEVER: SimTime = SimTime(1_000_000_000);

/// The refresh times: broadcasts only on a change, or in every round.
pub(crate) const REFRESHES: [f64; 2] = [1e6, STEP_MS as f64 / 1000.0];

/// Access to the state of a bidder with any consensus method.
pub(crate) trait Open: Allocator {
    /// Returns the configuration for bundles of that size, with a broadcast of everything after that time.
    fn config(bundle: usize, refresh_s: f64) -> Self::Config;
    fn parts(&self) -> (&Winners, &Bundle);
}

impl Open for Cbba {
    fn config(bundle: usize, refresh_s: f64) -> CbbaConfig {
        CbbaConfig { bundle, refresh_s }
    }
    fn parts(&self) -> (&Winners, &Bundle) {
        (&self.0.beliefs, &self.0.bundle)
    }
}

impl Open for Acbba {
    fn config(bundle: usize, repeat_s: f64) -> AcbbaConfig {
        AcbbaConfig { bundle, repeat_s }
    }
    fn parts(&self) -> (&Winners, &Bundle) {
        (&self.0.beliefs, &self.0.bundle)
    }
}

pub(crate) fn assignment<A: Open>(team: &Team<A>) -> Assignment {
    let bids_of = |robot: usize| {
        let (beliefs, bundle) = team.members[robot].allocator.parts();
        let bids = bundle.bids(beliefs).into_iter();
        bids.map(|(task, bid)| (task.index(), bid)).collect()
    };
    (0..team.members.len()).map(bids_of).collect()
}

/// The claim to a place of a task: task, slot, round, claim.
pub(crate) type Believed = (TaskId, u16, SimTime, Option<WinningBid>);

/// Returns the entries of all robots.
pub(crate) fn beliefs<A: Open>(team: &Team<A>) -> Vec<Vec<Believed>> {
    let entry = |entry: &Entry| (entry.task, entry.slot, entry.round, entry.claim);
    let members = team.members.iter();
    let entries = members.map(|member| member.allocator.parts().0.entries());
    entries
        .map(|entries| entries.iter().map(entry).collect())
        .collect()
}

/// C4: a robot holds exactly the places in its bundle, and no bid is negative.
#[track_caller]
pub(crate) fn check_beliefs<A: Open>(team: &Team<A>) {
    for member in &team.members {
        let (beliefs, bundle) = member.allocator.parts();
        for (place, entry) in beliefs.entries().iter().enumerate() {
            assert_eq!(beliefs.is_mine(place), bundle.contains(place), "C4");
            assert!(entry.claim.is_none_or(|claim| claim.value >= 0.0));
        }
    }
}

pub(crate) fn random_team<A: Open>(seed: u64, refresh_s: f64) -> (Team<A>, usize) {
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
    let mut team = Team::new(seed, work, &A::config(bundle, refresh_s), NEVER);
    if chance.random_bool(0.7) {
        team.connect_as_line(if chance.random_bool(0.5) { 0.3 } else { 0.0 });
    }
    (team, bundle)
}

#[test]
fn bidders_keep_the_properties_of_all_allocators() {
    testkit::check_allocator::<Cbba>(&CbbaConfig::default());
    testkit::check_allocator::<Cbba>(&CbbaConfig {
        bundle: 4,
        refresh_s: 0.1,
    });
    testkit::check_allocator::<Cbaa>(&CbaaConfig::default());
    testkit::check_allocator::<Acbba>(&AcbbaConfig::default());
    testkit::check_allocator::<Acbba>(&AcbbaConfig {
        bundle: 4,
        repeat_s: 0.1,
    });
}

/// C1, C2 and C4: after min(m, L_t·n)·D rounds nothing changes, and all robots have the result of the sequential greedy
/// assignment.
#[test]
fn without_loss_all_robots_agree_on_the_greedy_assignment() {
    for seed in 0..600 {
        let (mut team, bundle) = random_team::<Cbba>(seed, REFRESHES[seed as usize % 2]);
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
            assert_eq!(team.in_flight(), 0, "messages remain, seed {seed}");
        }
    }
}

/// C3: the sum of scores is at least half of the optimum.
#[test]
fn the_score_is_at_least_half_of_the_optimum() {
    let mut worst = 1.0_f64;
    for seed in 0..300 {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let (robots, tasks) = (chance.random_range(1..4), chance.random_range(1..5));
        let bundle = chance.random_range(1..3);
        let config = CbbaConfig {
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
            let path: Vec<usize> = bundle
                .path(beliefs)
                .iter()
                .map(|task| task.index())
                .collect();
            work.score(robot, &path)
        };
        let sum: f64 = assignment(&team).iter().enumerate().map(score).sum();
        let share = sum / optimum(&work, bundle);
        assert!(share >= 0.5, "C3, seed {seed}: {share}");
        worst = worst.min(share);
    }
    // The worst of these cases stays above four fifths.
    assert!(worst > 0.8, "{worst}");
}

/// C5: repeated broadcasts lead to the same result despite message loss.
#[test]
fn repeated_messages_reach_the_same_result_despite_loss() {
    settles_with_loss::<Cbba>(0.3, 200);
    settles_with_loss::<Cbba>(0.6, 400);
}

#[track_caller]
pub(crate) fn settles_with_loss<A: Open>(loss: f64, most: u32) {
    let mut rounds_of_all = 0;
    for seed in 0..80 {
        let (mut team, bundle) = random_team::<A>(seed, REFRESHES[1]);
        team.loss = loss;
        let expected = greedy(&team.work, bundle);
        let is_settled = |team: &Team<A>| {
            let views = beliefs(team);
            assignment(team) == expected && views.iter().all(|view| *view == views[0])
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
    assert!(rounds_of_all < 80 * 12, "loss {loss}: {rounds_of_all}");
}

/// C1, C2, C4 and C5 for ACBBA, within twice the rounds, with and without repetition. Nothing changes afterwards.
#[test]
fn acbba_agrees_with_and_without_loss() {
    for seed in 0..600 {
        for repeat_s in REFRESHES {
            let (mut team, bundle) = random_team::<Acbba>(seed, repeat_s);
            let work = team.work.clone();
            let places: usize = work.max_robots.iter().sum();
            for _ in 0..=2 * places.min(bundle * work.robots()) * team.diameter() {
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
            if repeat_s == REFRESHES[0] {
                assert_eq!(team.in_flight(), 0, "messages remain, seed {seed}");
            }
        }
    }
    settles_with_loss::<Acbba>(0.3, 400);
    settles_with_loss::<Acbba>(0.6, 800);
}

/// Message losses, cut links, crashes, restarts and new rounds occur in any order. Afterwards all robots agree, and
/// each claim is a bid that a robot really makes.
pub(crate) fn agrees_after_trouble<A: Open>() {
    for seed in 0..200 {
        let (mut team, bundle) = random_team::<A>(seed, 1.0);
        let config = A::config(bundle, 1.0);
        team.go_through_trouble(seed, &config, SimTime(5000), check_beliefs);
        let robots = team.members.len();
        for _ in 0..200 {
            team.step();
        }
        let alive = (0..robots).filter(|robot| !team.crashed[*robot]);
        let views = beliefs(&team);
        let agreed = alive.clone().map(|robot| &views[robot]).next();
        for robot in alive {
            assert_eq!(Some(&views[robot]), agreed, "seed {seed}, robot {robot}");
        }
        let assignment = assignment(&team);
        for (task, _, _, claim) in agreed.into_iter().flatten() {
            let Some(claim) = claim else { continue };
            let holder = claim.robot.index();
            let is_made = assignment[holder].contains(&(task.index(), claim.value));
            assert!(!team.crashed[holder] && is_made, "seed {seed}: {claim:?}");
        }
    }
}

#[test]
fn cbba_agrees_after_trouble() {
    agrees_after_trouble::<Cbba>();
}

#[test]
fn acbba_agrees_after_trouble() {
    agrees_after_trouble::<Acbba>();
}

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
use crate::allocators::cbba::{Acbba, AcbbaConfig, Bidder, Cbaa, CbaaConfig, Cbba, CbbaConfig};
use crate::allocators::consensus::team::{NEVER, REFRESH_S, go_through_trouble, random_team};
use crate::allocators::consensus::winners::{Entry, Winners};
use crate::allocators::team::{Situation, TAU, Team, allocator_messages};
use crate::testkit;

/// The refresh times: broadcasts only on a change, or in every round.
pub(crate) const REFRESHES: [f64; 2] = [1e6, REFRESH_S];

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

/// Returns the bids of each robot for the tasks in its bundle; none of a crashed robot.
pub(crate) fn assignment<A: Open>(team: &Team<A>) -> Assignment {
    let mut assignment = vec![Vec::new(); team.robots.len()];
    for robot in team.running() {
        let (beliefs, bundle) = team.allocator(robot).parts();
        let bids = bundle.bids(beliefs).into_iter();
        assignment[robot] = bids.map(|(task, bid)| (task.index(), bid)).collect();
    }
    assignment
}

/// The claim to a place of a task: task, slot, round, claim.
pub(crate) type Believed = (TaskId, u16, SimTime, Option<WinningBid>);

/// Returns the entries of all running robots.
pub(crate) fn beliefs<A: Open>(team: &Team<A>) -> Vec<Vec<Believed>> {
    let entry = |entry: &Entry| (entry.task, entry.slot, entry.round, entry.claim);
    let entries = |robot| team.allocator(robot).parts().0.entries().iter();
    let of_robot = |robot| entries(robot).map(entry).collect();
    team.running().map(of_robot).collect()
}

/// C4: a robot holds exactly the places in its bundle, and no bid is negative.
#[track_caller]
pub(crate) fn check_beliefs<A: Open>(team: &Team<A>) {
    for robot in team.running() {
        let (beliefs, bundle) = team.allocator(robot).parts();
        for (place, entry) in beliefs.entries().iter().enumerate() {
            assert_eq!(beliefs.is_mine(place), bundle.contains(place), "C4");
            assert!(entry.claim.is_none_or(|claim| claim.value >= 0.0));
        }
    }
}

/// Returns a random team and the size of its bundles.
pub(crate) fn random_bidders<A: Open>(seed: u64, refresh_s: f64, tau: SimTime) -> (Team<A>, usize) {
    let mut bundle = 0;
    let team = random_team(seed, tau, |chance| {
        bundle = chance.random_range(1..4);
        A::config(bundle, refresh_s)
    });
    (team, bundle)
}

/// C1, C2 and C4: after a number of rounds nothing changes, and all robots have the result of the sequential greedy
/// assignment. The number is `factor` times min(m, L_t·n)·D.
fn agrees_without_loss<A: Open>(seed: u64, refresh_s: f64, factor: usize) {
    let (mut team, bundle) = random_bidders::<A>(seed, refresh_s, NEVER);
    let situation = team.situation.clone();
    let claims = situation.places().min(bundle * team.robots.len());
    for _ in 0..=factor * claims * team.diameter() {
        team.step();
        check_beliefs(&team);
    }
    let (settled, agreed) = (assignment(&team), beliefs(&team));
    let expected = greedy(&situation, bundle);
    assert_eq!(settled, expected, "C2, seed {seed}: {situation:?}");
    for other in &agreed {
        assert_eq!(*other, agreed[0], "C1, seed {seed}: {situation:?}");
    }
    team.run(20);
    assert_eq!(beliefs(&team), agreed, "C1, seed {seed}");
    if refresh_s == REFRESHES[0] {
        let messages = allocator_messages(&team.in_flight).count();
        assert_eq!(messages, 0, "messages remain, seed {seed}");
    }
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

#[test]
fn without_loss_all_robots_agree_on_the_greedy_assignment() {
    for seed in 0..600 {
        agrees_without_loss::<Cbba>(seed, REFRESHES[seed as usize % 2], 1);
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
        let situation = Situation::on_grid(&mut chance, robots, tasks);
        let mut team = Team::<Cbba>::still(seed, NEVER, situation.clone(), config);
        team.run(30);
        let score = |robot: usize| {
            let Bidder {
                beliefs, bundle, ..
            } = &team.allocator(robot).0;
            let path = bundle.path(beliefs);
            let path: Vec<usize> = path.iter().map(|task| task.index()).collect();
            situation.score(robot, &path)
        };
        let sum: f64 = (0..robots).map(score).sum();
        let share = sum / optimum(&situation, bundle);
        assert!(share >= 0.5, "C3, seed {seed}: {share}");
        worst = worst.min(share);
    }
    // The worst of these cases stays above four fifths.
    assert!(worst > 0.8, "{worst}");
}

/// C5: repeated broadcasts lead to the same result despite message loss.
#[test]
fn repeated_messages_reach_the_same_result_despite_loss() {
    settles_with_loss::<Cbba>(0.3, 200, 12);
    settles_with_loss::<Cbba>(0.6, 400, 12);
}

#[track_caller]
pub(crate) fn settles_with_loss<A: Open>(loss: f64, most: u32, mean: u32) {
    let mut rounds_of_all = 0;
    for seed in 0..80 {
        let (mut team, bundle) = random_bidders::<A>(seed, REFRESHES[1], NEVER);
        team.loss = loss;
        let expected = greedy(&team.situation, bundle);
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
                team.situation
            );
        }
        for _ in 0..50 {
            team.step();
            assert!(is_settled(&team), "C5, seed {seed}, loss {loss}");
        }
        rounds_of_all += rounds;
    }
    assert!(rounds_of_all < 80 * mean, "loss {loss}: {rounds_of_all}");
}

/// C1, C2, C4 and C5 for ACBBA, within twice the rounds, with and without repetition. Nothing changes afterwards.
#[test]
fn acbba_agrees_with_and_without_loss() {
    for seed in 0..600 {
        for repeat_s in REFRESHES {
            agrees_without_loss::<Acbba>(seed, repeat_s, 2);
        }
    }
    settles_with_loss::<Acbba>(0.3, 400, 12);
    settles_with_loss::<Acbba>(0.6, 800, 12);
}

/// Message losses, cut links, crashes, restarts and new rounds occur in any order. Afterwards all robots agree, and
/// each claim is a bid that a robot really makes.
pub(crate) fn agrees_after_trouble<A: Open>() {
    for seed in 0..200 {
        let (mut team, _) = random_bidders::<A>(seed, 1.0, TAU);
        go_through_trouble(&mut team, seed, check_beliefs);
        team.run(200);
        let views = beliefs(&team);
        for view in &views {
            assert_eq!(*view, views[0], "seed {seed}");
        }
        let assignment = assignment(&team);
        for (task, _, _, claim) in views.into_iter().next().into_iter().flatten() {
            let Some(claim) = claim else { continue };
            // A crashed robot has no bids.
            let is_made = assignment[claim.robot.index()].contains(&(task.index(), claim.value));
            assert!(is_made, "seed {seed}: {claim:?}");
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

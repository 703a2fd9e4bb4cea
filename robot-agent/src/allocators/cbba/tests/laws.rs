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
use crate::allocators::cbba::winners::{Entry, Winners};
use crate::allocators::cbba::{Acbba, AcbbaConfig, Cbaa, CbaaConfig, Cbba, CbbaConfig};
use crate::allocators::team::{STEP, Situation, TAU, Team, allocator_messages};
use crate::testkit;

/// A τ after which no robot counts as lost within a test.
const NEVER: SimTime = SimTime(1_000_000_000);

/// The refresh times: broadcasts only on a change, or in every round.
const REFRESHES: [f64; 2] = [1e6, STEP.0 as f64 / 1000.0];

/// Access to the state of a bidder with any consensus method.
trait Open: Allocator {
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

/// Returns the states of the running robots, with their ranks.
fn states<A: Open>(team: &Team<A>) -> impl Iterator<Item = (usize, (&Winners, &Bundle))> {
    let running = (0..team.robots.len()).filter(|&rank| team.is_running(rank));
    running.map(|rank| (rank, team.allocator(rank).parts()))
}

fn assignment<A: Open>(team: &Team<A>) -> Assignment {
    let mut assignment = vec![Vec::new(); team.robots.len()];
    for (rank, (beliefs, bundle)) in states(team) {
        let bids = bundle.bids(beliefs).into_iter();
        assignment[rank] = bids.map(|(task, bid)| (task.index(), bid)).collect();
    }
    assignment
}

/// The claim to a place of a task: task, slot, round, claim.
type Believed = (TaskId, u16, SimTime, Option<WinningBid>);

/// Returns the entries of all running robots.
fn beliefs<A: Open>(team: &Team<A>) -> Vec<Vec<Believed>> {
    let entry = |entry: &Entry| (entry.task, entry.slot, entry.round, entry.claim);
    let entries = states(team).map(|(_, (beliefs, _))| beliefs.entries());
    entries
        .map(|entries| entries.iter().map(entry).collect())
        .collect()
}

/// Makes a step, and checks C4: a robot holds exactly the places in its bundle, and no bid is negative.
#[track_caller]
fn checked_step<A: Open>(team: &mut Team<A>) {
    team.step();
    for (_, (beliefs, bundle)) in states(team) {
        for (place, entry) in beliefs.entries().iter().enumerate() {
            assert_eq!(beliefs.is_mine(place), bundle.contains(place), "C4");
            assert!(entry.claim.is_none_or(|claim| claim.value >= 0.0));
        }
    }
}

/// Creates a random team. Returns it with the size of the bundles.
fn random_team<A: Open>(seed: u64, tau: SimTime, refresh_s: f64) -> (Team<A>, usize) {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let (robots, tasks) = (chance.random_range(1..7), chance.random_range(1..9));
    let mut situation = Situation::on_grid(&mut chance, robots, tasks);
    if chance.random_bool(0.3) {
        for task in &mut situation.tasks {
            task.priority = chance.random_range(0..2);
        }
    }
    if chance.random_bool(0.3) {
        for task in &mut situation.tasks {
            task.max_robots = chance.random_range(1..4);
        }
    }
    let bundle = chance.random_range(1..4);
    let mut team = Team::still(seed, tau, situation, A::config(bundle, refresh_s));
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

/// C1, C2 and C4: after min(m, L_t·n)·D rounds, for ACBBA twice as many, nothing changes, and all robots have the result
/// of the sequential greedy assignment.
#[test]
fn without_loss_all_robots_agree_on_the_greedy_assignment() {
    for seed in 0..600 {
        let refresh_s = REFRESHES[seed as usize % 2];
        agrees_on_the_greedy_assignment::<Cbba>(seed, 1, refresh_s);
        for refresh_s in REFRESHES {
            agrees_on_the_greedy_assignment::<Acbba>(seed, 2, refresh_s);
        }
    }
}

fn agrees_on_the_greedy_assignment<A: Open>(seed: u64, times: usize, refresh_s: f64) {
    let (mut team, bundle) = random_team::<A>(seed, NEVER, refresh_s);
    let tasks = &team.situation.tasks;
    let places: usize = tasks.iter().map(|task| task.max_robots).sum();
    let rounds = places.min(bundle * team.robots.len()) * team.diameter();
    for _ in 0..=times * rounds {
        checked_step(&mut team);
    }
    let (settled, agreed) = (assignment(&team), beliefs(&team));
    assert_eq!(settled, greedy(&team.situation, bundle), "C2, seed {seed}");
    for other in &agreed {
        assert_eq!(*other, agreed[0], "C1, seed {seed}");
    }
    team.run(20);
    assert_eq!(beliefs(&team), agreed, "C1, seed {seed}");
    if refresh_s == REFRESHES[0] {
        let messages = allocator_messages(&team.in_flight);
        assert_eq!(messages.count(), 0, "messages remain, seed {seed}");
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
        let mut team = Team::<Cbba>::still(seed, NEVER, situation, config);
        team.run(30);
        let score = |(rank, (beliefs, bundle)): (usize, (&Winners, &Bundle))| {
            let path = bundle.path(beliefs).into_iter();
            let path: Vec<usize> = path.map(TaskId::index).collect();
            team.situation.score(rank, &path)
        };
        let sum: f64 = states(&team).map(score).sum();
        let share = sum / optimum(&team.situation, bundle);
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
    settles_with_loss::<Acbba>(0.3, 400);
    settles_with_loss::<Acbba>(0.6, 800);
}

#[track_caller]
fn settles_with_loss<A: Open>(loss: f64, most: u32) {
    let mut rounds_of_all = 0;
    for seed in 0..80 {
        let (mut team, bundle) = random_team::<A>(seed, NEVER, REFRESHES[1]);
        team.loss = loss;
        let expected = greedy(&team.situation, bundle);
        let is_settled = |team: &Team<A>| {
            let views = beliefs(team);
            assignment(team) == expected && views.iter().all(|view| *view == views[0])
        };
        let mut rounds = 0;
        while !is_settled(&team) {
            checked_step(&mut team);
            rounds += 1;
            assert!(rounds < most, "C5, seed {seed}, loss {loss}");
        }
        for _ in 0..50 {
            team.step();
            assert!(is_settled(&team), "C5, seed {seed}, loss {loss}");
        }
        rounds_of_all += rounds;
    }
    assert!(rounds_of_all < 80 * 12, "loss {loss}: {rounds_of_all}");
}

/// Message losses, cut links, crashes, restarts and new rounds occur in any order. Afterwards all robots agree, and
/// each claim is a bid that a robot really makes.
fn agrees_after_trouble<A: Open>() {
    for seed in 0..200 {
        let (mut team, _) = random_team::<A>(seed, TAU, 1.0);
        let robots = team.robots.len();
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        for _ in 0..10 {
            team.loss = [0.0, 0.3, 0.9][chance.random_range(0..3)];
            for link in team.links.iter_mut().flatten() {
                *link = chance.random_bool(0.7);
            }
            let robot = chance.random_range(0..robots);
            match chance.random_range(0..4) {
                0 => team.kill(robot),
                1 => team.restart(robot),
                2 => {
                    let now = team.now();
                    let task = chance.random_range(0..team.situation.tasks.len());
                    team.situation.tasks[task].round = now;
                }
                _ => {}
            }
            for _ in 0..chance.random_range(1..150) {
                checked_step(&mut team);
            }
        }
        team.loss = 0.0;
        team.links
            .iter_mut()
            .flatten()
            .for_each(|link| *link = true);
        team.run(200);
        // A bid changes when its unit begins or lapses, also now. Teammates receive it some steps later.
        let agree = |team: &Team<A>| {
            let views = beliefs(team);
            views.iter().all(|view| *view == views[0])
        };
        for _ in 0..20 {
            if !agree(&team) {
                team.step();
            }
        }
        let (views, assignment) = (beliefs(&team), assignment(&team));
        for view in &views {
            assert_eq!(*view, views[0], "seed {seed}");
        }
        for (task, _, _, claim) in views.first().into_iter().flatten() {
            let Some(claim) = claim else { continue };
            let holder = claim.robot.index();
            let is_made = assignment[holder].contains(&(task.index(), claim.value));
            assert!(team.is_running(holder) && is_made, "seed {seed}: {claim:?}");
        }
    }
}

#[test]
fn all_robots_agree_after_trouble() {
    agrees_after_trouble::<Cbba>();
    agrees_after_trouble::<Acbba>();
}

//! The observe mission (docs/missions/observe.md): the order of the four policies, and whole runs.
//!
//! A step is 200 ms here, which hardly changes the results. `alliance sweep analysis/sweeps/cmommt.toml` runs all teams
//! and radii.

use alliance_tests::harness::Lab;
use alliance_tests::runs::{log_of, parse, play, run, setup, vocabulary};
use missions::observe::data::{ObserveSection, Policy};
use proto::tick::Outcome;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{LogLevel, MissionRow, RunLog, Table};
use scenario::{Robot, Scenario};
use serde_json::Map;

use crate::golden::{assert_as_before, pinned};

const SEEDS: u64 = 40;
const NO_RADIO: &str =
    "[faults]\ntimeline = [{ fault.drop = { from = 'all', to = 'all', p = 1.0 }, at_s = 0.0 }]\n";

/// Returns a built-in scenario with a policy and additional lines.
fn scenario(name: &str, policy: Policy, more: &str) -> Scenario {
    let text = vocabulary().builtin(name).unwrap().text;
    let mut scenario = parse(&format!("step_ms = 200\n{text}\n{more}"));
    section(&mut scenario).policy = policy;
    scenario
}

fn section(scenario: &mut Scenario) -> &mut ObserveSection {
    scenario.mission.values_mut().unwrap()
}

/// In the first tick, one target is observed. The entropy of one part is 0, without a sign.
#[test]
fn the_entropy_of_one_observed_target_is_zero() {
    let lab = Lab::new();
    let run = lab.run("run cmommt --in-process --limit 0.05 --out run --json");
    let entropy = run.expect(1).json()["result"]["h"].as_f64().unwrap();
    assert_eq!(entropy.to_bits(), 0.0_f64.to_bits());
}

/// Returns A/n of each of the seeds.
fn shares(scenario: &Scenario, seeds: u64) -> Vec<f64> {
    let share = |seed| {
        let setup = setup(scenario.clone(), seed);
        let (outcome, recorder) = run(setup, LogLevel::Off);
        assert_eq!(outcome, Outcome::Complete);
        let result = log_of(recorder).run.result;
        result.mission.get("a").number().unwrap()
    };
    (1..=seeds).map(share).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the lower end of the 95 % bootstrap interval of a mean.
fn lower_end(values: &[f64]) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let means = (0..2000).map(|_| {
        let drawn = (0..values.len()).map(|_| values[rng.random_range(0..values.len())]);
        mean(&drawn.collect::<Vec<_>>())
    });
    let mut means: Vec<f64> = means.collect();
    means.sort_by(f64::total_cmp);
    means[means.len() / 40]
}

/// With four targets for each robot, weights help, and forces help more. The expected means are those of the
/// published table, corrected for evenly spread starts.
#[test]
fn with_many_targets_a_cmommt_is_best_and_random_and_fixed_are_worst() {
    let policies = [
        Policy::Random,
        Policy::Fixed,
        Policy::Local,
        Policy::ACmommt,
    ];
    let all = policies.map(|policy| shares(&scenario("cmommt-crowded", policy, ""), SEEDS));
    for (shares, published) in all.iter().zip([0.27, 0.30, 0.44, 0.48]) {
        let mean = mean(shares);
        assert!((mean - published).abs() < 0.08, "{mean}, not {published}");
    }
    let [random, fixed, local, weighted] = all;
    let gains = weighted.iter().zip(&local);
    let gains: Vec<f64> = gains.map(|(with, without)| with - without).collect();
    assert!(lower_end(&gains) > 0.0, "{gains:?}");
    for worse in [random, fixed] {
        assert!(mean(&local) > 1.3 * mean(&worse), "{local:?}, {worse:?}");
    }
}

/// With five robots for each target the weights have almost no effect.
#[test]
fn with_few_targets_local_equals_a_cmommt() {
    let [local, weighted] = [Policy::Local, Policy::ACmommt].map(|policy| {
        let mut scenario = scenario("cmommt", policy, "");
        section(&mut scenario).n = 2;
        let robot = |number| Robot {
            name: format!("r{number}"),
            ..Robot::default()
        };
        scenario.robots = (1..=10).map(robot).collect();
        shares(&scenario, SEEDS)
    });
    let difference = mean(&weighted) - mean(&local);
    assert!(difference.abs() < 0.03, "{difference}");
    assert!(mean(&local) > 0.77, "{}, published: 0.85", mean(&local));
}

#[test]
fn a_larger_region_lowers_the_observed_share() {
    let by_radius = [10.0, 20.0, 30.0, 50.0].map(|radius_m| {
        let mut scenario = scenario("cmommt-crowded", Policy::ACmommt, "");
        scenario.room.width_m = 2.0 * radius_m;
        scenario.room.height_m = 2.0 * radius_m;
        mean(&shares(&scenario, 10))
    });
    let falls = by_radius.is_sorted_by(|near, far| *near > 1.5 * far);
    assert!(falls, "{by_radius:?}");
}

/// One of five robots crashes after a third of the mission. Its share may be lost, and the others continue.
#[test]
fn a_crash_costs_at_most_the_share_of_the_robot() {
    let killed = "[faults]\ntimeline = [{ fault.kill = 'gold', at_s = 40.0 }]\n";
    let [whole, killed] = ["", killed].map(|more| {
        let scenario = scenario("cmommt-crowded", Policy::ACmommt, more);
        mean(&shares(&scenario, SEEDS))
    });
    let likely = (1.0 - 2.0 / 5.0) * whole..0.97 * whole;
    assert!(likely.contains(&killed), "{killed} of {whole}");
}

fn poses(scenario: &Scenario, seed: u64) -> Vec<u8> {
    let (outcome, recorder) = run(setup(scenario.clone(), seed), LogLevel::Full);
    assert_eq!(outcome, Outcome::Complete);
    recorder.into_sink().tables[&Table::Poses].clone()
}

/// The weights depend only on messages of teammates.
#[test]
fn without_radio_a_cmommt_equals_local_byte_for_byte() {
    let are_equal = |more, seed| {
        let of = |policy| poses(&scenario("cmommt-crowded", policy, more), seed);
        of(Policy::Local) == of(Policy::ACmommt)
    };
    assert!((1..=3).all(|seed| are_equal(NO_RADIO, seed)));
    assert!(!(1..=3).all(|seed| are_equal("", seed)));
}

/// Returns the number of observed targets at a time, from mission.csv.
fn observed(log: &RunLog, at_s: f64) -> u64 {
    let rows = log.rows::<MissionRow>().unwrap();
    let mut before = rows.iter().filter(|row| row.t_ms.as_secs_f64() <= at_s);
    let last = before.next_back().and_then(|row| row.values[0].1);
    last.unwrap_or_default() as u64
}

/// Robots with dead sensors observe nothing, and observe again after healing. Noise has little effect.
#[test]
fn robots_with_dead_sensors_observe_nothing() {
    let of_all = |mode: &str, times: &str| {
        let orders = ["blue", "gold", "green", "red", "violet"].map(|robot| {
            format!("{{ fault.sensor = {{ robot = '{robot}', device = 'targets', mode = {mode} }}, {times} }}")
        });
        format!("[faults]\ntimeline = [{}]\n", orders.join(", "))
    };
    let play = |more: &str| {
        let scenario = scenario("cmommt-crowded", Policy::ACmommt, more);
        play(scenario, 1).1
    };
    let dead = play(&of_all("'dead'", "at_s = 40.0, for_s = 20.0"));
    let seen = [39.0, 41.0, 59.0, 61.0].map(|at_s| observed(&dead, at_s));
    assert!(seen[0] > 3 && seen[3] > 0, "{seen:?}");
    assert_eq!(seen[1..3], [0, 0]);
    let noisy = play(&of_all("{ noise = { m = 0.3 } }", "at_s = 0.0"));
    let share = noisy.run.result.mission.get("a").number().unwrap();
    assert!(share > 0.3, "{share}");
    let dropout = play(&of_all("{ dropout = 0.5 }", "at_s = 0.0"));
    let half = dropout.run.result.mission.get("a").number().unwrap();
    let likely = 0.2 * share..0.8 * share;
    assert!(likely.contains(&half), "{half} of {share}");
}

#[test]
fn golden_runs_of_the_observe_policies_are_unchanged() {
    let mut runs = Map::new();
    for (name, policy) in [
        ("random", Policy::Random),
        ("fixed", Policy::Fixed),
        ("local", Policy::Local),
        ("a-cmommt", Policy::ACmommt),
    ] {
        let scenario = scenario("cmommt-crowded", policy, "");
        runs.insert(name.to_owned(), pinned(setup(scenario, 1)));
    }
    assert_as_before("policies", runs);
}

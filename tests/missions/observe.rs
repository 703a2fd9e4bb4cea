//! The observe mission (docs/missions/observe.md): the order of the four policies, and whole runs.
//!
//! A step is 200 ms here, which hardly changes the results. `alliance sweep analysis/sweeps/cmommt.toml` runs all teams
//! and radii.

use in_process::Team as OneProcess;
use missions::Registry;
use missions::observe::data::{ObserveSection, Policy};
use proto::tick::Outcome;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use run_log::{EventRow, LogLevel, MemoryLog, MissionRow, PoseRow, RunLog, Table, TargetRow};
use scenario::{Robot, Scenario, Setup};
use serde_json::Map;

use crate::golden::{assert_as_before, pinned};
use crate::harness::Lab;
use crate::in_process::run;
use crate::recompute::log_of;
use crate::team::Team;

const SEEDS: u64 = 40;
const NO_RADIO: &str =
    "[faults]\ntimeline = [{ fault.drop = { from = 'all', to = 'all', p = 1.0 }, at_s = 0.0 }]\n";

/// Returns a built-in scenario with a policy and additional lines.
fn scenario(name: &str, policy: Policy, more: &str) -> Scenario {
    let vocabulary = Registry::built_in().vocabulary();
    let text = vocabulary.builtin(name).unwrap().text;
    let text = format!("step_ms = 200\n{text}\n{more}");
    let mut scenario = Scenario::parse(name, &text, &vocabulary).unwrap();
    section(&mut scenario).policy = policy;
    scenario
}

fn section(scenario: &mut Scenario) -> &mut ObserveSection {
    scenario.mission.values_mut().unwrap()
}

fn setup(scenario: &Scenario, seed: u64) -> Setup {
    Setup::resolve(scenario.clone(), seed, None).unwrap().setup
}

/// Returns A/n of each of the seeds.
fn shares(scenario: &Scenario, seeds: u64) -> Vec<f64> {
    let share = |seed| {
        let setup = setup(scenario, seed);
        let mut team = OneProcess::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let outcome = team.continue_for(u64::MAX, Outcome::TimeLimit, |_| {});
        let outcome = outcome.unwrap();
        assert_eq!(outcome, Outcome::Complete);
        let (run, _) = team.end(outcome).unwrap();
        run.result.mission.get("a").number().unwrap()
    };
    (1..=seeds).map(share).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the lower end of the 95 % bootstrap interval of a mean.
fn lower_end(values: &[f64]) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut means: Vec<f64> = (0..2000)
        .map(|_| {
            let drawn = (0..values.len()).map(|_| values[rng.random_range(0..values.len())]);
            mean(&drawn.collect::<Vec<_>>())
        })
        .collect();
    means.sort_by(f64::total_cmp);
    means[means.len() / 40]
}

/// With four targets for each robot, weights help, and forces help more. The expected means are those of the
/// published table, corrected for evenly spread starts.
#[test]
fn with_many_targets_a_cmommt_is_best_and_random_and_fixed_are_worst() {
    let [random, fixed, local, weighted] = [
        Policy::Random,
        Policy::Fixed,
        Policy::Local,
        Policy::ACmommt,
    ]
    .map(|policy| shares(&scenario("cmommt-crowded", policy, ""), SEEDS));
    let gains = weighted
        .iter()
        .zip(&local)
        .map(|(with, without)| with - without);
    let gains: Vec<f64> = gains.collect();
    assert!(lower_end(&gains) > 0.0, "{gains:?}");
    for (shares, published) in [
        (&random, 0.27),
        (&fixed, 0.30),
        (&local, 0.44),
        (&weighted, 0.48),
    ] {
        assert!(
            (mean(shares) - published).abs() < 0.08,
            "{} {published}",
            mean(shares)
        );
    }
    assert!(mean(&local) > 1.3 * mean(&random), "{local:?}, {random:?}");
    assert!(mean(&local) > 1.3 * mean(&fixed), "{local:?}, {fixed:?}");
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
    assert!(
        by_radius.is_sorted_by(|near, far| *near > 1.5 * far),
        "{by_radius:?}"
    );
}

/// One of five robots crashes after a third of the mission. Its share may be lost, and the others continue.
#[test]
fn a_crash_costs_at_most_the_share_of_the_robot() {
    let killed = "[faults]\ntimeline = [{ fault.kill = 'gold', at_s = 40.0 }]\n";
    let [whole, killed] = ["", killed].map(|more| {
        let scenario = scenario("cmommt-crowded", Policy::ACmommt, more);
        mean(&shares(&scenario, SEEDS))
    });
    let least = (1.0 - 2.0 / 5.0) * whole;
    assert!(
        (least..0.97 * whole).contains(&killed),
        "{killed} of {whole}"
    );
}

/// The rows of mission.csv follow from targets.csv. Each target is found at its position, and never moves faster than
/// its limit.
#[test]
fn targets_csv_agrees_with_mission_csv_and_events_csv() {
    let scenario = scenario("cmommt-crowded", Policy::ACmommt, "");
    let section = scenario.mission.values::<ObserveSection>().unwrap();
    let (n, most_m) = (usize::from(section.n), 0.2 * section.fastest_m_s);
    let (_, recorder) = run(setup(&scenario, 1), LogLevel::Full);
    let log = RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary());
    let log = log.unwrap();
    let targets: Vec<TargetRow> = log.rows().unwrap();
    let poses: Vec<PoseRow> = log.rows().unwrap();
    assert_eq!(targets.len() as u64, n as u64 * log.run.result.ticks);
    assert_eq!(poses.last().unwrap().t_ms, targets.last().unwrap().t_ms);
    let mut mission = log.rows::<MissionRow>().unwrap().into_iter().peekable();
    let events: Vec<EventRow> = log.rows().unwrap();
    let mut now = mission.next().unwrap();
    let mut found = 0;
    let mut before: Option<&[TargetRow]> = None;
    for tick in targets.chunks(n) {
        let at = tick[0].t_ms;
        if mission.peek().is_some_and(|row| row.t_ms == at) {
            now = mission.next().unwrap();
        }
        let observed = tick.iter().filter(|row| row.observers > 0).count();
        let pairs: u32 = tick.iter().map(|row| row.observers).sum();
        assert_eq!(now.get("observed"), Some(observed as f64), "{at}");
        assert_eq!(now.get("pairs"), Some(f64::from(pairs)), "{at}");
        for (row, number) in tick.iter().zip(0..) {
            assert_eq!(row.target, format!("t{number}"));
            if let Some(before) = before {
                let before = &before[number];
                let way_m = (row.x_m - before.x_m).hypot(row.y_m - before.y_m);
                assert!(way_m <= most_m + 1e-4, "{row:?}");
            }
        }
        for event in events.iter().filter(|event| event.t_ms == at) {
            let row = tick.iter().find(|row| row.target == event.subject);
            if let ("found", Some(row)) = (&*event.kind, row) {
                assert_eq!(event.detail, format!("at {:.3} {:.3}", row.x_m, row.y_m));
                assert!(row.observers > 0, "{event:?}");
                found += 1;
            }
        }
        before = Some(tick);
    }
    assert!(found > 10, "{found}");
}

/// The targets of a row are at the end of the step that begins at its time: they fit the poses of the next tick.
#[test]
fn targets_are_at_the_end_of_the_step_and_poses_at_its_start() {
    let scenario = scenario("cmommt-crowded", Policy::ACmommt, "");
    let section = scenario.mission.values::<ObserveSection>().unwrap();
    let (n, range_m) = (usize::from(section.n), section.range_m);
    let (_, recorder) = run(setup(&scenario, 1), LogLevel::Full);
    let log = RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary());
    let log = log.unwrap();
    let (targets, poses): (Vec<TargetRow>, Vec<PoseRow>) =
        (log.rows().unwrap(), log.rows().unwrap());
    let robots = scenario.robots.len();
    let in_sight = |target: &TargetRow, poses: &[PoseRow]| {
        let near =
            |pose: &&PoseRow| (pose.x_m - target.x_m).hypot(pose.y_m - target.y_m) <= range_m;
        poses.iter().filter(near).count() as u32
    };
    let (mut same, mut next, mut all) = (0, 0, 0);
    for (targets, poses) in targets
        .chunks(n)
        .zip(poses.windows(2 * robots).step_by(robots))
    {
        let (at, after) = poses.split_at(robots);
        assert_eq!(targets[0].t_ms, at[0].t_ms);
        for target in targets {
            all += 1;
            same += usize::from(in_sight(target, at) == target.observers);
            next += usize::from(in_sight(target, after) == target.observers);
        }
    }
    assert!(
        all > 1000 && next == all && same < all,
        "{same} and {next} of {all}"
    );
}

fn poses(scenario: &Scenario, seed: u64) -> Vec<u8> {
    let (outcome, recorder) = run(setup(scenario, seed), LogLevel::Full);
    assert_eq!(outcome, Outcome::Complete);
    recorder.into_sink().tables[&Table::Poses].clone()
}

/// The weights depend only on messages of teammates.
#[test]
fn without_radio_a_cmommt_equals_local_byte_for_byte() {
    let both = |more, seed| {
        let of = |policy| poses(&scenario("cmommt-crowded", policy, more), seed);
        (of(Policy::Local), of(Policy::ACmommt))
    };
    for seed in 1..=3 {
        let (local, weighted) = both(NO_RADIO, seed);
        assert!(local == weighted, "seed {seed}");
    }
    let with_radio = (1..=3).map(|seed| both("", seed));
    assert!(
        with_radio
            .into_iter()
            .any(|(local, weighted)| local != weighted)
    );
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
        log_of(run(setup(&scenario, 1), LogLevel::Full).1)
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
    assert!(
        half < 0.8 * share && half > 0.2 * share,
        "{half} of {share}"
    );
}

/// Runs real processes with one killed, replays the log, and checks the invariants.
#[test]
fn a_run_by_processes_with_a_kill_is_repeated_byte_for_byte() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &["cmommt", "--speed", "60x"]);
    team.wait_for_row("events.csv", &["found"]);
    team.kill("gold");
    team.wait().expect(0);
    let log = lab.log("run");
    assert!(log.run.result.mission.get("a").number().unwrap() > 0.2);
    lab.run(&["replay", "run", "--out", "again"]).expect(0);
    lab.assert_same_bytes("run", "again");
    let file = lab.path("scenario.toml");
    let killed = "[faults]\ntimeline = [{ fault.kill = 'gold', at_s = 40.0 }]\n";
    let scenario = scenario("cmommt-crowded", Policy::ACmommt, killed);
    std::fs::write(&file, scenario.to_toml().unwrap()).unwrap();
    let checked = ["scenario.toml", "--in-process", "--check"];
    lab.mission("checked", &checked).expect(0);
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
        runs.insert(name.to_owned(), pinned(setup(&scenario, 1)));
    }
    assert_as_before("golden/policies.json", runs);
}

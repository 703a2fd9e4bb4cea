//! Compares every figure of run.json and of the report's tables with the independent calculation of
//! `alliance_tests::figures`, in random runs with faults.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use alliance_tests::fault_fuzzer::{self, Coverage, Fuzz};
use alliance_tests::figures;
use alliance_tests::runs::{builtin, log_of, play, run, setup, vocabulary};
use analysis::random_mission::faults::RandomFaults;
use analysis::random_mission::{CountRange, LengthRange, RandomMission};
use analysis::report::{History, Metrics};
use missions::observe::data::ObserveSection;
use missions::service::data::ServiceSection;
use observation::takeovers::{Takeover, TakeoverCause};
use run_log::{EventRow, LogLevel, PoseRow, RunFile, RunLog, TargetRow};
use scenario::Scenario;
use scenario::mission::{FigureValue, MissionFigures};

/// Returns a random scenario with random faults. The seed selects the mission and the allocator in turn.
fn random_scenario(seed: u64) -> Scenario {
    let known = vocabulary();
    let mission = &known.missions[seed as usize % known.missions.len()];
    let allocators = &known.allocators;
    let allocator = &allocators[seed as usize / known.missions.len() % allocators.len()];
    let turn = seed as usize / known.missions.len() / allocators.len();
    let mut base = match (mission.name(), turn % 3) {
        ("waste", 1) => known.builtin("foraging").map(|known| known.text),
        ("service", 1) => known.builtin("l-alliance-abstract").map(|known| known.text),
        ("service", 2) => known.builtin("janitorial").map(|known| known.text),
        _ => None,
    }
    .map_or_else(
        || mission.family(2 + turn % 5, 1 + turn % 4).unwrap(),
        |text| Scenario::parse("random", text, &known).unwrap(),
    );
    base.limit_s = 240.0;
    base.step_ms = 100;
    let is_drawn = mission.random_section().is_some() && turn.is_multiple_of(3);
    let (min, max, until_s) = (0, 12, 200.0);
    let sides = LengthRange {
        min: 6.0,
        max: 16.0,
    };
    let drawn = RandomMission {
        room: is_drawn.then_some(sides),
        robots: is_drawn.then_some(CountRange { min: 1, max: 8 }),
        mission: is_drawn.then(|| mission.name().to_owned()),
        obstacles: None,
        faults: Some(RandomFaults { min, max, until_s }),
    };
    let mut scenario = drawn.draw(base, seed);
    scenario.allocator = Some(allocator.name.to_owned());
    scenario
}

/// Runs a random scenario to its end, every second one with crashes, stalls and losses outside the scenario.
pub fn random_run(seed: u64) -> RunLog {
    let setup = setup(random_scenario(seed), seed);
    log_of(if (seed / 4).is_multiple_of(2) {
        run(setup, LogLevel::Full).1
    } else {
        let fuzz = Fuzz {
            seed,
            ticks: u64::MAX,
            calm: 0.98,
            loss: 0.1,
        };
        fault_fuzzer::run(&setup, fuzz, &mut Coverage::new()).unwrap()
    })
}

#[track_caller]
fn assert_figures_agree(seeds: impl Iterator<Item = u64>) {
    let mut wrong = Vec::new();
    let mut runs = 0;
    for seed in seeds {
        let log = random_run(seed);
        let all = catch_unwind(AssertUnwindSafe(|| {
            let mut found = figures::run_file(&log).unwrap().0;
            found.extend(figures::report(&log).unwrap().0);
            found
        }));
        let found = all.unwrap_or_else(|_| vec!["the calculation panicked".to_owned()]);
        runs += 1;
        let scenario = &log.run.setup.scenario;
        let (mission, allocators) = (scenario.mission().name(), scenario.allocator_list());
        let named = |difference| format!("seed {seed}, {mission} by {allocators}: {difference}");
        wrong.extend(found.into_iter().map(named));
    }
    assert!(wrong.is_empty(), "{runs} runs:\n{}", wrong.join("\n"));
}

#[test]
fn every_figure_agrees_with_the_tables() {
    assert_figures_agree(0..32);
}

/// Returns seeds of service missions whose points have properties, such as windows and needs, or that have chargers.
fn seeds_with_properties() -> impl Iterator<Item = u64> {
    (0..).filter(|seed| {
        let scenario = random_scenario(*seed);
        let is_service = scenario.mission().name() == "service";
        is_service && {
            let section = ServiceSection::of(&scenario);
            section.has_properties() || !section.chargers.is_empty()
        }
    })
}

#[test]
fn every_figure_of_points_with_properties_agrees_with_the_tables() {
    // In run 4829, a fault adds a point of a kind for which no robot has the skill.
    assert_figures_agree(seeds_with_properties().take(24).chain([4829]));
}

/// `cargo test -p alliance-tests --test missions -- --ignored every_figure_of_a_thousand_runs`
#[test]
#[ignore = "takes minutes; `every_figure_agrees_with_the_tables` is its short form"]
fn every_figure_of_a_thousand_runs_agrees_with_the_tables() {
    assert_figures_agree((0..1000).chain(seeds_with_properties().take(300)));
}

/// Returns the log of a built-in scenario up to a limit, and its poses by time.
fn log_and_poses(name: &str, limit_s: f64) -> (RunLog, BTreeMap<u64, Vec<PoseRow>>) {
    let mut scenario = builtin(name);
    scenario.limit_s = limit_s;
    let log = play(scenario, 1).1;
    let mut poses: BTreeMap<u64, Vec<PoseRow>> = BTreeMap::new();
    for row in log.rows::<PoseRow>().unwrap() {
        poses.entry(row.t_ms.0).or_default().push(row);
    }
    (log, poses)
}

/// docs/GUARANTEES.md, "Instants": the poses of the same instant are those of the next tick.
#[test]
fn poses_are_of_the_start_of_a_step_and_targets_and_events_of_its_end() {
    let (log, poses) = log_and_poses("cmommt", 60.0);
    let scenario = &log.run.setup.scenario;
    let range_m = f64::from(ObserveSection::from_scenario(scenario).range_m);
    let step_ms = scenario.step_ms;
    let mut others = 0;
    for row in log.rows::<TargetRow>().unwrap() {
        let seen_at = |t_ms: u64| {
            let distances = poses.get(&t_ms)?.iter().map(|pose| {
                let x_m = f64::from(pose.x_m) - f64::from(row.x_m);
                let y_m = f64::from(pose.y_m) - f64::from(row.y_m);
                x_m.hypot(y_m)
            });
            Some(
                distances
                    .filter(|distance_m| *distance_m <= range_m)
                    .count() as u32,
            )
        };
        // The last step has no next one.
        let Some(at_end) = seen_at(row.t_ms.0 + step_ms) else {
            continue;
        };
        assert_eq!(row.observers, at_end, "{row:?}");
        others += u32::from(seen_at(row.t_ms.0) != Some(at_end));
    }
    assert!(others > 0, "the poses of both instants agree everywhere");

    let (log, poses) = log_and_poses("waste-cleanup", 120.0);
    let step_ms = log.run.setup.scenario.step_ms;
    let mut picks = log.rows::<EventRow>().unwrap();
    picks.retain(|event| event.kind == "picked");
    assert!(!picks.is_empty());
    for event in picks {
        let carries_at = |t_ms: u64| {
            let mut bodies = poses[&t_ms].iter();
            let body = bodies.find(|body| body.robot == event.robot);
            body.unwrap().carrying
        };
        let carries = [0, step_ms].map(|after_ms| carries_at(event.t_ms.0 + after_ms));
        assert_eq!(carries, [false, true], "{event:?}");
    }
}

/// The comparison must detect errors, otherwise it proves nothing.
#[test]
fn a_wrong_figure_is_detected() {
    type Change = fn(&mut RunFile);
    let changes: [Change; 8] = [
        |run| run.result.ticks += 1,
        |run| run.unscripted ^= true,
        |run| run.hash = None,
        |run| run.result.mission.add("more", 1_u32),
        |run| run.result.robots.values_mut().next().unwrap().incarnations += 1,
        |run| run.result.robots.values_mut().next().unwrap().messages_sent += 1,
        |run| run.result.robots.values_mut().next().unwrap().bytes_sent += 1,
        |run| {
            run.result
                .robots
                .values_mut()
                .next_back()
                .unwrap()
                .messages_received += 1
        },
    ];
    for seed in 0..4 {
        let mut log = random_run(seed);
        let right = log.run.clone();
        for change in changes {
            log.run = right.clone();
            change(&mut log.run);
            let found = figures::run_file(&log).unwrap().0;
            assert_eq!(found.len(), 1, "seed {seed}: {found:?}");
        }
        for index in 0..right.faults.len() {
            log.run = right.clone();
            log.run.faults[index].hits += 1;
            let found = figures::run_file(&log).unwrap().0;
            assert_eq!(found.len(), 1, "seed {seed}: {found:?}");
        }
        // Each figure of the mission, in total and of a robot.
        let names = right.result.mission.iter().map(|(name, _)| name.to_owned());
        for name in names.collect::<Vec<_>>() {
            log.run = right.clone();
            let figures = &mut log.run.result.mission;
            *figures = with_wrong(figures, &name);
            let found = figures::run_file(&log).unwrap().0;
            assert!(!found.is_empty(), "seed {seed}: {name}");
        }
        let (robot, figures) = right.result.robots.iter().next().unwrap();
        for (name, _) in figures.mission.iter() {
            log.run = right.clone();
            let figures = log.run.result.robots.get_mut(robot).unwrap();
            figures.mission = with_wrong(&figures.mission, name);
            let found = figures::run_file(&log).unwrap().0;
            assert!(!found.is_empty(), "seed {seed}: {name} of {robot}");
        }
    }
}

/// Returns figures of which one is too large.
fn with_wrong(figures: &MissionFigures, wrong: &str) -> MissionFigures {
    let mut changed = MissionFigures::default();
    for (name, value) in figures.iter() {
        let value = match value {
            FigureValue::Count(count) if name == wrong => FigureValue::Count(count + 1),
            // Some figures of motion have bounds of one step.
            FigureValue::Real(number) if name == wrong => FigureValue::Real(1.1 * number + 10.0),
            FigureValue::None if name == wrong => FigureValue::Count(1),
            value => value,
        };
        changed.add(name, value);
    }
    changed
}

fn first_takeover(metrics: &mut Metrics) -> Option<&mut Takeover> {
    metrics.takeovers.first_mut()
}

#[test]
fn a_wrong_metric_is_detected() {
    type Change = fn(&mut Metrics) -> Option<()>;
    let changes: [Change; 12] = [
        |metrics| {
            metrics
                .robots
                .first_mut()
                .map(|robot| robot.activations += 1)
        },
        |metrics| metrics.robots.first_mut().map(|robot| robot.idle.0 += 100),
        |metrics| {
            metrics
                .robots
                .last_mut()
                .map(|robot| robot.present.0 += 100)
        },
        |metrics| {
            let mut events = metrics.recurring.iter_mut();
            events.find_map(|event| event.moments.pop()).map(drop)
        },
        |metrics| metrics.failures.pop().map(drop),
        |metrics| {
            metrics
                .failures
                .first_mut()
                .map(|failure| failure.at.0 += 100)
        },
        |metrics| {
            metrics
                .failures
                .iter_mut()
                .find_map(|failure| failure.orphan.take())
                .map(drop)
        },
        |metrics| metrics.takeovers.pop().map(drop),
        |metrics| first_takeover(metrics).map(|takeover| takeover.from += 1),
        |metrics| first_takeover(metrics).map(|takeover| takeover.idle_since.0 += 100),
        |metrics| {
            let cause = TakeoverCause::Left("?".to_owned());
            first_takeover(metrics).map(|takeover| takeover.cause = cause)
        },
        |metrics| {
            let moments = metrics
                .recurring
                .iter_mut()
                .flat_map(|event| &mut event.moments);
            moments.last().map(|moment| moment.late.0 += 100)
        },
    ];
    let mut made = [0; 12];
    for seed in 0..24 {
        let log = random_run(seed);
        let metrics = Metrics::compute(&History::read(&log).unwrap(), &log.run);
        for (index, change) in changes.iter().enumerate() {
            let mut wrong = metrics.clone();
            if change(&mut wrong).is_some() {
                let found = figures::report_of(&log, &wrong).unwrap().0;
                assert_eq!(found.len(), 1, "seed {seed}, change {index}: {found:?}");
                made[index] += 1;
            }
        }
    }
    assert!(!made.contains(&0), "{made:?}");
}

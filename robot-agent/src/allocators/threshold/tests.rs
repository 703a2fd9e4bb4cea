//! The properties of response thresholds (docs/allocators/threshold.md).

use proptest::prelude::*;
use proto::telemetry::Reason;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::{Config, Response, Threshold};
use crate::allocator::{Allocator, Choice, Decision, Input, RandomDraws};
use crate::allocators::team::{STEP, Situation, Team};
use crate::{fixtures, testkit};

#[test]
fn thresholds_keep_the_properties_of_all_allocators() {
    testkit::check_allocator::<Threshold>(&Config::default());
    testkit::check_allocator::<Threshold>(&ready());
}

/// Returns parameters with which a robot takes a due task within a few steps.
fn ready() -> Config {
    Config {
        theta_start: 1.0,
        theta_max: 1.0,
        ..Config::default()
    }
}

fn response(stimulus: f64, threshold: f64) -> Response {
    Response {
        task: TaskId(0),
        stimulus,
        threshold,
        round: SimTime::ZERO,
    }
}

/// The expected values of s²/(s² + θ²) are computed by hand.
#[test]
fn probability_matches_values_computed_by_hand() {
    for (stimulus, threshold, expected) in [
        (0.0, 1.0, 0.0),
        (1.0, 1.0, 0.5),
        (1.0, 2.0, 0.2),
        (3.0, 1.0, 0.9),
        (1.0, 7.0, 0.02),
        (500.0, 500.0, 0.5),
        (10.0, 1000.0, 0.000_099_99),
    ] {
        let probability = response(stimulus, threshold).probability();
        assert!(
            (probability - expected).abs() < 1e-9,
            "{stimulus} {threshold}: {probability}"
        );
        // The rate gives the same probability that the task is taken within a second.
        let within_s = -libm::expm1(-response(stimulus, threshold).rate());
        assert!((within_s - expected).abs() < 1e-9, "{within_s}");
    }
}

proptest! {
    /// P rises with s and falls with θ.
    #[test]
    fn probability_is_monotone(
        stimulus in 0.1..2000.0, threshold in 1.0..1000.0, more in 1.01..10.0,
    ) {
        let values = |stimulus, threshold| {
            let response = response(stimulus, threshold);
            (response.probability(), response.rate())
        };
        let here = values(stimulus, threshold);
        let stronger = values(stimulus * more, threshold);
        let duller = values(stimulus, threshold * more);
        prop_assert!(stronger.0 > here.0 && stronger.1 > here.1);
        prop_assert!(duller.0 < here.0 && duller.1 < here.1);
        prop_assert!((0.0..=1.0).contains(&here.0));
    }

    /// θ stays within its limits and s is never negative, for any team and duration.
    #[test]
    fn thresholds_stay_in_bounds(
        situation in Situation::arbitrary(3, 4), least in 1.0..50.0, span in 0.0..50.0, start in 0.1..200.0,
    ) {
        let config = Config { theta_min: least, theta_max: least + span, theta_start: start, ..Config::default() };
        let mut team = Team::<Threshold>::new(situation, config);
        for _ in 0..1500 {
            team.step();
            for rank in 0..team.robots.len() {
                for response in &team.allocator(rank).tasks {
                    prop_assert!((least..=least + span).contains(&response.threshold), "{response:?}");
                    prop_assert!(response.stimulus >= 0.0, "{response:?}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// An able robot finally takes each due task with the published parameters, although other tasks are always
    /// available.
    #[test]
    fn tasks_that_are_due_are_taken(situation in Situation::arbitrary(3, 4)) {
        let tasks = situation.tasks.len();
        let able = |task: usize| situation.cost_s.iter().any(|row| row[task].is_some());
        let mut left: Vec<usize> = (0..tasks).filter(|&task| able(task)).collect();
        let mut team = Team::<Threshold>::new(situation.clone(), Config::default());
        // More than half an hour. A threshold of 1000 and an equal stimulus give a probability of one half per second.
        for _ in 0..40_000 {
            team.step();
            left.retain(|&task| team.executors(task).is_empty());
        }
        prop_assert_eq!(left, Vec::<usize>::new());
    }
}

/// A robot with two tasks and scripted inputs.
struct Solo {
    allocator: Threshold,
    decision: Decision,
    tick: u64,
    seed: u64,
    rounds: [SimTime; 2],
    due: [bool; 2],
    is_laden: bool,
    step_s: f64,
}

impl Solo {
    fn new(config: Config, seed: u64) -> Self {
        let team = Team::<Threshold>::new(Situation::from_costs(&[&[10.0, 20.0]]), config);
        Self {
            allocator: team.allocator(0).clone(),
            decision: Decision::default(),
            tick: 0,
            seed,
            rounds: [SimTime::ZERO; 2],
            due: [true, false],
            is_laden: false,
            step_s: STEP.as_secs_f64(),
        }
    }

    fn step(&mut self, progressed: &[TaskId]) -> Option<BehaviorId> {
        let choice = |task: u32| Choice {
            round: self.rounds[task as usize],
            applicable: self.due[task as usize],
            ..fixtures::choice(task, 10.0)
        };
        let choices = [choice(0), choice(1)];
        let now = SimTime((self.tick as f64 * self.step_s * 1000.0) as u64);
        let input = Input {
            step_s: self.step_s,
            is_laden: self.is_laden,
            applicable: &self.due,
            choices: &choices,
            progressed,
            draws: RandomDraws::new(self.seed, RobotId(0), self.tick),
            ..fixtures::input(now, RobotId(0))
        };
        self.decision.rows.clear();
        self.allocator.step(&input, &mut self.decision);
        self.tick += 1;
        self.decision.active
    }

    fn response(&self, task: usize) -> &Response {
        &self.allocator.tasks[task]
    }
}

/// The stimulus of a due task grows by δ per second. Each progress and each newer round takes α; both in one step take
/// α once.
#[test]
fn stimuli_grow_while_due_and_fall_at_progress() {
    // The threshold is so high that the robot never takes a task.
    let config = Config {
        theta_start: 1e9,
        theta_min: 1e9,
        ..Config::default()
    };
    let mut solo = Solo::new(config, 1);
    let near = |solo: &Solo, expected: f64| {
        let stimulus = solo.response(0).stimulus;
        assert!((stimulus - expected).abs() < 1e-6, "{stimulus} {expected}");
    };
    for _ in 0..400 {
        solo.step(&[]);
    }
    near(&solo, 20.0);
    assert_eq!(solo.response(1).stimulus, 0.0);
    solo.due[0] = false;
    solo.step(&[TaskId(0)]);
    near(&solo, 17.0);
    solo.step(&[TaskId(0), TaskId(0), TaskId(1)]);
    near(&solo, 11.0);
    assert_eq!(solo.response(1).stimulus, 0.0);
    solo.rounds[0] = SimTime(9000);
    solo.step(&[]);
    near(&solo, 8.0);
    solo.step(&[]);
    near(&solo, 8.0);
    solo.rounds[0] = SimTime(10_000);
    solo.step(&[TaskId(0)]);
    near(&solo, 5.0);
}

/// ξ and φ are per second: 10 s of the first task take 100 from its threshold and add 10 to the other's.
#[test]
fn thresholds_follow_the_performed_task() {
    let config = Config {
        leave: 0.0,
        ..Config::default()
    };
    let mut solo = Solo::new(config, 1);
    let (mut performed, mut steps) = (0, 0);
    while performed < 200 {
        steps += 1;
        performed += u32::from(solo.step(&[]).is_some());
    }
    let idle_s = f64::from(steps - performed) * 0.05;
    let near =
        |value: f64, expected: f64| assert!((value - expected).abs() < 1e-6, "{value} {expected}");
    near(solo.response(0).threshold, 500.0 + idle_s - 100.0);
    near(solo.response(1).threshold, 500.0 + idle_s + 10.0);
    // The row contains the probability of taking the task.
    let row = solo.decision.rows[0];
    near(row.utility, solo.response(0).probability());
}

/// Checks the share of 4,000 robots that act within a second, to four standard deviations, for any step length.
#[track_caller]
fn assert_share(expected: f64, mut acts: impl FnMut(u64) -> bool) {
    let tries = 4000_u64;
    let share = (0..tries).filter(|&seed| acts(seed)).count() as f64 / tries as f64;
    let deviation = (expected * (1.0 - expected) / tries as f64).sqrt();
    assert!(
        (share - expected).abs() < 4.0 * deviation,
        "{share} {expected}"
    );
}

#[test]
fn probabilities_are_per_second_for_any_step_length() {
    // A constant stimulus of 1 with θ = 2 gives one fifth within a second.
    let config = Config {
        theta_min: 2.0,
        theta_max: 2.0,
        delta: 1e-12,
        ..Config::default()
    };
    for steps in [20, 5, 1] {
        let solo = |seed| {
            let mut solo = Solo::new(config, seed);
            solo.step_s = 1.0 / f64::from(steps);
            solo.allocator.tasks[0].stimulus = 1.0;
            solo.allocator.tasks[1].stimulus = 1.0;
            solo
        };
        assert_share(0.2, |seed| {
            let mut solo = solo(seed);
            (0..steps).any(|_| solo.step(&[]).is_some())
        });
        // One of two equal tasks is taken with probability 1 - 0.8², and each by half of those robots.
        assert_share(0.18, |seed| {
            let mut solo = solo(seed);
            solo.due = [true, true];
            (0..steps).find_map(|_| solo.step(&[])) == Some(BehaviorId(1))
        });
        // A robot leaves a task with probability one fifth too, unless it carries something.
        for is_laden in [false, true] {
            let leaves = |seed| {
                let mut solo = solo(seed);
                solo.is_laden = is_laden;
                solo.decision.active = Some(BehaviorId(0));
                (0..steps).any(|_| {
                    let left = solo.step(&[]).is_none();
                    assert!(!left || solo.decision.reason == Some(Reason::Drawn));
                    left
                })
            };
            if is_laden {
                assert!(!(0..1000).any(leaves));
            } else {
                assert_share(0.2, leaves);
            }
        }
    }
}

//! The properties L1 to L6 of docs/ALLOCATORS.md, "The laws".

use proptest::prelude::*;
use proptest::strategy::Strategy as _;
use proto::telemetry::{BehaviorState, Reason};

use super::super::config::Strategy;
use super::super::monitor::Monitor;
use super::super::rates::{Category, PATIENCE_CAP, TaskTimes, rates};
use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

const MU: usize = 7;

/// Returns the time from robot 0's μ-th trial until robot 1 reaches θ, if it does within ten trial lengths. Robot 0
/// makes μ trials of `length`, then one every `next`, or none.
fn at_threshold(length: SimTime, next: Option<SimTime>) -> Option<SimTime> {
    let unit_s = length.as_secs_f64() / 2.0;
    // The robot activates as soon as it reaches θ, independent of other claims.
    let switches = Switches {
        waiting: false,
        arbitration: false,
        ..Preset::Team.switches()
    };
    let mut solo = Solo::new(&me(1, 2, &[unit_s]), &Config::default(), switches);
    let learned = SimTime(length.0 * MU as u64);
    let end = learned + SimTime(10 * length.0);
    let mut progress = 0;
    let mut due = length;
    while solo.now < end {
        let is_done = solo.now == due;
        if is_done {
            progress += 1;
            due = match next {
                _ if progress < MU as u32 => due + length,
                Some(next) => due + next,
                None => SimTime(u64::MAX),
            };
        }
        let sends = is_done || solo.now.0.is_multiple_of(1000);
        let report = sends.then(|| solo.report(0, (Executing, Some(0), progress)));
        let received: Vec<_> = report.into_iter().collect();
        // The task is due for robot 1 from the last measured trial on.
        let is_due = solo.now >= learned;
        solo.step(&[is_due], &received, &[]);
        if solo.active().is_some() {
            return Some(solo.now - STEP - learned);
        }
    }
    None
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// L1: a robot without progress is taken over d after its first message. A robot with progress every d - 2δt is
    /// never taken over.
    #[test]
    fn patience_lasts_as_long_as_a_trial(steps in 60..400_u64) {
        let length = SimTime(steps * STEP.0);
        prop_assert_eq!(at_threshold(length, None), Some(length));
        prop_assert_eq!(at_threshold(length, Some(length - STEP - STEP)), None);
    }
}

/// Generates a teammate's action: state, task, progress, the error of its time in steps, and whether it starts a new
/// incarnation.
fn action() -> impl proptest::strategy::Strategy<Value = (Report, i64, bool)> {
    let state = prop::sample::select(vec![
        Executing, Executing, Executing, Waiting, Released, Idle,
    ]);
    let report = (state, 0..3_u32, prop_oneof![0..6_u32, Just(u32::MAX)]);
    let wrong = prop_oneof![4 => Just(0_i64), 1 => -200..200_i64];
    (report, wrong, prop::bool::weighted(0.05)).prop_map(|((state, task, progress), wrong, new)| {
        let task = (state != Idle).then_some(task);
        ((state, task, progress), wrong, new)
    })
}

fn strategies() -> impl proptest::strategy::Strategy<Value = (Strategy, Ordering)> {
    let strategy = prop::sample::select(STRATEGIES.to_vec());
    (strategy, prop::sample::select(ORDERINGS.to_vec()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// L2: 0 < δ_slow < δ_fast, ψ > 0 and φ is capped for any received messages. L3: delays are within their limits
    /// before the clamp.
    #[test]
    fn rates_are_valid_for_any_messages(
        (strategy, ordering) in strategies(),
        actions in prop::collection::vec((1..3_u32, action(), 0..60_u64), 1..60),
        done in prop::collection::vec(0..3_u32, 0..3),
        units in prop::collection::vec(0.0..50.0_f64, 3),
    ) {
        let config = Config { strategy, ordering, ..Config::default() };
        let mut solo = Solo::new(&me(0, 3, &units), &config, Preset::Team.switches());
        let mut incarnation = [1; 3];
        for (sender, (report, wrong, new), rest) in actions {
            let incarnation = &mut incarnation[sender as usize];
            *incarnation += u32::from(new);
            solo.seq += 1;
            let sent = SimTime(solo.now.0.saturating_add_signed(wrong * 100));
            let received = heartbeat(sender, (*incarnation, solo.seq), sent, report);
            solo.step(&[true; 3], &[received], &done);
            for _ in 0..rest {
                solo.step(&[true; 3], &[], &[]);
            }
            for (task, values) in solo.learner.tasks.iter().zip(&solo.learner.task_values) {
                let mut list = Vec::new();
                let engine_values = solo.learner.adaptive(*task, values, &mut list);
                let shortest_s = values.knowledge.shortest_s;
                let all = list.iter().map(|(_, toward)| *toward).chain([engine_values.toward_most]);
                for toward in all {
                    prop_assert!(toward.slow > 0.0 && toward.slow < engine_values.fast);
                    prop_assert!(engine_values.fast.is_finite());
                    let most_s = PATIENCE_CAP * shortest_s + 1e-3;
                    prop_assert!(toward.phi.as_secs_f64() <= most_s);
                }
                prop_assert!(engine_values.psi.0 > 0 && engine_values.lambda >= engine_values.psi);
                let delay_s = values.rates.delay_s;
                let limits_s = 2.0 - 1e-9..8.0 + 1e-9;
                prop_assert!(limits_s.contains(&delay_s), "{delay_s}");
            }
        }
    }

    /// Skipped steps equal evaluated ones, although the engine's parameters change between them.
    #[test]
    fn skipped_steps_change_nothing(
        (strategy, ordering) in strategies(),
        actions in prop::collection::vec((1..3_u32, action(), 0..100_u64), 1..40),
    ) {
        let config = Config { strategy, ordering, ..Config::default() };
        let [mut solo, mut evaluated] = std::array::from_fn(|_| {
            Solo::new(&me(0, 3, &[3.0, 5.0, 8.0]), &config, Preset::Team.switches())
        });
        for (place, (sender, (report, _, is_done), rest)) in actions.into_iter().enumerate() {
            for step in 0..=rest {
                let received = (step == 0).then(|| heartbeat(sender, (1, place as u64 + 1), solo.now, report));
                let received: Vec<_> = received.into_iter().collect();
                let done: Vec<u32> = solo.active().filter(|_| is_done && step == 0).into_iter().collect();
                evaluated.learner.engine.weigh_anew();
                solo.step(&[true; 3], &received, &done);
                evaluated.step(&[true; 3], &received, &done);
                prop_assert_eq!(&solo.outcome, &evaluated.outcome);
            }
        }
    }

    /// L3: of the tasks at which the robot is best the longer comes first, of the rest the shorter.
    #[test]
    fn longer_tasks_come_sooner_where_the_robot_is_best(
        one in 1.0..100.0_f64, more in 0.1..100.0_f64, low in 0.0..1.0_f64, high in 0.0..100.0_f64,
    ) {
        let delay_s = |own_s, category| {
            let knowledge = TaskTimes { own_s, best_s: own_s, shortest_s: own_s, category };
            rates(&Config::default(), &knowledge, (low, one + more + high), 0.0).delay_s
        };
        let longer = one + more;
        prop_assert!(delay_s(longer, Category::BestHere) < delay_s(one, Category::BestHere));
        prop_assert!(delay_s(longer, Category::Others) > delay_s(one, Category::Others));
    }

    /// L4: with equal trials, each task is in the first category of at most one robot.
    #[test]
    fn a_task_belongs_to_at_most_one_robot(
        trials in prop::collection::vec((0..4_u32, 0..3_u32, 1..5_u32), 0..40),
    ) {
        let mut learners: Vec<Solo> = (0..4)
            .map(|rank| Solo::new(&me(rank, 4, &[3.0; 3]), &Config::default(), Preset::Team.switches()))
            .collect();
        let mut owners = [0; 3];
        for solo in &mut learners {
            for &(robot, task, time_s) in &trials {
                let time_s = f64::from(time_s);
                solo.learner.monitor.store(RobotId(robot), TaskId(task), time_s);
            }
            let me = solo.learner.me.robot.0;
            let others = (0..4).filter(|&rank| rank != me);
            let received: Vec<_> = others.map(|rank| solo.report(rank, (Idle, None, 0))).collect();
            solo.step(&[false; 3], &received, &[]);
            for (count, values) in owners.iter_mut().zip(&solo.learner.task_values) {
                *count += u32::from(values.knowledge.category == Category::BestHere);
            }
        }
        prop_assert_eq!(owners, [1; 3]);
    }

    /// L5: after μ new trials the old ones have no weight.
    #[test]
    fn old_trials_have_no_weight(
        window in 1..12_usize,
        old in prop::collection::vec(0.1..100.0_f64, 0..30),
        new in prop::collection::vec(0.1..100.0_f64, 12),
    ) {
        let me = me(1, 2, &[10.0]);
        let time_s = |times: &[f64]| {
            let mut monitor = Monitor::new(&me, window, 2.0, false);
            for &time_s in times {
                monitor.store(RobotId(0), TaskId(0), time_s);
            }
            monitor.time_s(TaskId(0), RobotId(0))
        };
        let new = &new[..window];
        prop_assert_eq!(time_s(&[&old, new].concat()), time_s(new));
    }
}

/// Returns the time, s, for which robot n is kept from the only task before it first ends a stint itself, and its own
/// longest estimate meanwhile, s. Stops after `limit_s` of that estimate. Each teammate does a unit in `unit_s` before
/// the task is due for robot n.
fn kept_away_s(
    config: &Config,
    preset: Preset,
    teammates: usize,
    unit_s: u64,
    limit_s: impl Fn(f64) -> f64,
    mut send: impl FnMut(usize, SimTime) -> Option<(TaskState, bool)>,
) -> (f64, f64) {
    let rank = teammates as u32;
    let mut solo = Solo::new(&me(rank, teammates + 1, &[2.0]), config, preset.switches());
    let (mut away_s, mut own_s) = (0.0, 0.0_f64);
    let mut incarnations = vec![1; teammates];
    for second in 0..=unit_s {
        let report = (Executing, Some(0), u32::from(second == unit_s));
        let mut received: Vec<_> = (0..rank).map(|mate| solo.report(mate, report)).collect();
        for _ in 0..1000 / STEP.0 {
            solo.step(&[false], &received, &[]);
            received.clear();
        }
    }
    while away_s <= limit_s(own_s) {
        let mut received = Vec::new();
        for (sender, incarnation) in incarnations.iter_mut().enumerate() {
            if let Some((state, is_new)) = send(sender, solo.now) {
                *incarnation += u32::from(is_new);
                solo.seq += 1;
                let task = (state != Idle).then_some(0);
                let sent = SimTime(solo.now.0.saturating_sub(STEP.0));
                received.push(heartbeat(
                    sender as u32,
                    (*incarnation, solo.seq),
                    sent,
                    (state, task, 0),
                ));
            }
        }
        solo.step(&[true], &received, &[]);
        own_s = own_s.max(solo.learner.task_values[0].knowledge.own_s);
        let ended = [Reason::AcquiescedPsi, Reason::GaveUpLambda];
        if solo
            .outcome
            .changes
            .iter()
            .any(|change| ended.contains(&change.reason))
        {
            break;
        }
        if solo.outcome.motivations[0].state != BehaviorState::Active {
            away_s += STEP.as_secs_f64();
        }
    }
    (away_s, own_s)
}

/// Generates the messages that a teammate repeats, each with the steps until the next: any messages, or only claims to
/// the task.
fn script() -> impl proptest::strategy::Strategy<Value = Vec<(TaskState, bool, u64)>> {
    let report = (
        prop::sample::select(vec![Executing, Executing, Waiting, Released, Idle]),
        prop::bool::weighted(0.1),
        prop_oneof![Just(1_u64), 1_u64..8, 1_u64..120],
    );
    prop_oneof![
        2 => prop::collection::vec(report, 1..6),
        1 => Just(vec![(Executing, false, 8)]),
    ]
}

/// Computes B of docs/BOUNDS.md, s, with the longest delay, boredom before each rise and the limit of φ.
fn bound_s(config: &Config, preset: Preset, teammates: usize, own_s: f64) -> f64 {
    let (n, step_s) = (teammates as f64, STEP.as_secs_f64());
    let waits = if preset == Preset::Team {
        n * (n + 1.0) / 2.0
    } else {
        0.0
    };
    let rise_s = config.max_delay_s + config.boredom_threshold / config.boredom_rate;
    (n + 1.0) * (rise_s + 2.0 * step_s)
        + n * (PATIENCE_CAP * own_s + step_s)
        + waits * (own_s + TAU.as_secs_f64() + step_s)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// L6: the bound holds for any messages without progress and any number of failed trials.
    #[test]
    fn no_robot_keeps_a_task_for_longer_than_the_bound(
        (strategy, ordering) in strategies(),
        preset in prop::sample::select(vec![Preset::Team, Preset::Par98]),
        teammates in prop::collection::vec(script(), 1..4),
        unit_s in prop_oneof![Just(0_u64), 1_u64..300],
    ) {
        let config = Config { strategy, ordering, ..Config::default() };
        let mut next = vec![(0_usize, 0_u64); teammates.len()];
        let bound_s = |own_s| bound_s(&config, preset, teammates.len(), own_s);
        let limit_s = |own_s| 2.0 * bound_s(own_s) + 100.0;
        let (away_s, own_s) = kept_away_s(&config, preset, teammates.len(), unit_s, limit_s, |rank, _| {
            let (place, resting) = &mut next[rank];
            if *resting > 0 {
                *resting -= 1;
                return None;
            }
            let (state, is_new, rests) = teammates[rank][*place];
            *place = (*place + 1) % teammates[rank].len();
            *resting = rests - 1;
            Some((state, is_new))
        });
        prop_assert!(away_s <= bound_s(own_s), "{away_s} of {} s", bound_s(own_s));
    }
}

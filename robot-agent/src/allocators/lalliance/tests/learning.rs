//! Active learning, and the order in which robots prefer tasks.

use super::*;

use TaskState::Executing;

/// Executes each active task for `unit` per unit until `end`. Returns the tasks in the order of execution.
fn work(
    solo: &mut Solo,
    end: SimTime,
    unit: SimTime,
    received: impl Fn(&mut Solo) -> Vec<Report>,
) -> Vec<u32> {
    let tasks = solo.learner.tasks.len();
    let (mut begun, mut order) = (SimTime::ZERO, Vec::new());
    while solo.now < end {
        let done = solo.active().filter(|_| solo.now.since(begun) >= unit);
        let reports = received(solo);
        let received: Vec<_> = reports
            .into_iter()
            .map(|report| solo.report(0, report))
            .collect();
        let before = solo.active();
        let progressed: Vec<u32> = done.into_iter().collect();
        solo.step(&vec![true; tasks], &received, &progressed);
        if done.is_some() || solo.active() != before {
            begun = solo.now - STEP;
        }
        if solo.active() != before {
            order.extend(solo.active());
        }
    }
    order
}

/// Active learning tries the least tried task next, until each has two trials.
#[test]
fn active_learning_tries_all_tasks_in_turn() {
    let config = Config {
        learning_trials: 2,
        ..Config::default()
    };
    let me = me(1, 2, &[20.0, 20.0, 20.0]);
    let mut solo = Solo::new(&me, &config, Preset::Team.switches());
    let order = work(&mut solo, SimTime(60_000), SimTime(5000), |_| Vec::new());
    assert_eq!(order[..6], [0, 1, 2, 0, 1, 2]);
    let counts: Vec<u32> = (0..3)
        .map(|task| solo.learner.monitor.trial_count(TaskId(task)))
        .collect();
    assert!(counts.iter().all(|count| *count >= 2), "{counts:?}");
}

/// A task that a teammate executes is not tried, and the phase ends at its limit.
#[test]
fn active_learning_leaves_others_alone_until_its_limit() {
    let config = Config {
        learning_trials: 2,
        learning_limit_s: 100.0,
        ..Config::default()
    };
    let me = me(1, 2, &[20.0, 20.0]);
    let mut solo = Solo::new(&me, &config, Preset::Team.switches());
    let babbles = |solo: &mut Solo| {
        let due = solo.now.0.is_multiple_of(1000);
        due.then_some((Executing, Some(1), 0)).into_iter().collect()
    };
    let order = work(&mut solo, SimTime(100_000), SimTime(5000), babbles);
    assert_eq!(order, [0]);
    // The patience has ended, and no other robot continues the task.
    assert!(solo.learner.monitor.trial_count(TaskId(0)) > 2);
}

/// A task at which the robot is best starts at once, the others when the robot is bored.
#[test]
fn tasks_that_others_are_better_at_wait_for_boredom() {
    let me = me(1, 2, &[10.0]);
    let config = Config {
        max_delay_s: 2.0,
        ..Config::default()
    };
    let activation = |report: Option<Report>| {
        let mut solo = Solo::new(&me, &config, Preset::Team.switches());
        while solo.active().is_none() {
            let report = report.filter(|_| solo.now.0.is_multiple_of(1000));
            let received: Vec<_> = report
                .into_iter()
                .map(|report| solo.report(0, report))
                .collect();
            solo.step(&[true], &received, &[]);
        }
        solo.now.0 - STEP.0
    };
    assert_eq!(activation(None), 2000);
    // Robot 0 is present with the same estimate and the lower rank, so that 5 s of boredom come first.
    let bored = activation(Some((TaskState::Idle, None, 0)));
    assert_eq!(bored, 5000 + 2000 - STEP.0);
}

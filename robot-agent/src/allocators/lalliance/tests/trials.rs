//! The measurement of trials.

use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

/// Creates robot 1, which receives messages of robot 0. The assumed time of both tasks is 20 s.
fn receiver() -> Solo {
    Solo::new(
        &me(1, 2, &[10.0, 10.0]),
        &Config::default(),
        Preset::Team.switches(),
    )
}

/// Delivers reports at times in ms, and makes steps until the end.
fn run_with(reports: &[(u64, Report)], end_ms: u64) -> Solo {
    let mut solo = receiver();
    while solo.now.0 <= end_ms {
        let due: Vec<Report> = reports
            .iter()
            .filter(|(at, _)| *at == solo.now.0)
            .map(|(_, report)| *report)
            .collect();
        let received: Vec<_> = due
            .into_iter()
            .map(|report| solo.report(0, report))
            .collect();
        solo.step(&[false, false], &received, &[]);
    }
    solo
}

#[track_caller]
fn assert_time(solo: &Solo, robot: u32, task: u32, expected_s: f64) {
    let time_s = solo.learner.monitor.time_s(TaskId(task), RobotId(robot));
    assert!((time_s - expected_s).abs() < 1e-9, "{time_s}");
}

#[test]
fn without_a_trial_twice_the_unit_is_assumed() {
    let solo = run_with(&[(0, (Executing, Some(0), 0))], 4000);
    assert_time(&solo, 0, 0, 20.0);
    assert_time(&solo, 1, 1, 20.0);
}

/// The times are 8 s, then three units in 6 s: 8, 2, 2, 2 with mean 3.5 and deviation 3.
#[test]
fn progress_ends_a_trial_and_begins_the_next() {
    let reports = [
        (0, (Executing, Some(0), 0)),
        (4000, (Executing, Some(0), 0)),
        (8000, (Executing, Some(0), 1)),
        (12_000, (Executing, Some(0), 1)),
        (14_000, (Executing, Some(0), 4)),
    ];
    assert_time(&run_with(&reports, 8000), 0, 0, 8.0);
    assert_time(&run_with(&reports, 14_000), 0, 0, 6.5);
    assert_time(&run_with(&reports, 14_000), 0, 1, 20.0);
}

/// A failed trial counts its duration, at least the current estimate.
#[test]
fn a_trial_fails_by_a_release_by_another_task_by_idleness_and_by_silence() {
    let begins = (0, (Executing, Some(0), 0));
    for end in [
        (Released, Some(0), 0),
        (Executing, Some(1), 0),
        (Waiting, Some(1), 0),
        (Waiting, Some(0), 0),
        (Idle, None, 0),
    ] {
        assert_time(&run_with(&[begins, (3000, end)], 3000), 0, 0, 20.0);
        let repeats = (1..=8).map(|k| (3000 * k, begins.1));
        let reports: Vec<_> = [begins]
            .into_iter()
            .chain(repeats)
            .chain([(25_000, end)])
            .collect();
        assert_time(&run_with(&reports, 25_000), 0, 0, 25.0);
    }
    let reports: Vec<_> = (0..=8).map(|k| (3000 * k, begins.1)).collect();
    // After a silence of τ the trial ends at the last message.
    assert_time(&run_with(&reports, 28_900), 0, 0, 20.0);
    let silent = run_with(&reports, 29_000);
    assert_time(&silent, 0, 0, 24.0);
    assert_eq!(silent.learner.monitor.executing_count(TaskId(0)), 0);
}

/// A release often reports the last unit.
#[test]
fn a_release_that_reports_progress_is_a_success() {
    let reports = [
        (0, (Executing, Some(0), 0)),
        (3000, (Released, Some(0), 1)),
        (3000, (Idle, None, 0)),
    ];
    assert_time(&run_with(&reports, 3000), 0, 0, 3.0);
}

/// Send times count. Late messages, duplicates and messages from the future do not distort the measurement.
#[test]
fn times_are_those_of_the_sender() {
    let mut solo = receiver();
    let send = |seq, sent, report| heartbeat(0, (1, seq), SimTime(sent), report);
    solo.now = SimTime(9000);
    let late = send(1, 1000, (Executing, Some(0), 0));
    solo.step(&[false; 2], &[late.clone(), late.clone()], &[]);
    let done = send(3, 8000, (Executing, Some(0), 1));
    solo.step(&[false; 2], std::slice::from_ref(&done), &[]);
    assert_time(&solo, 0, 0, 7.0);
    solo.step(&[false; 2], &[done, late], &[]);
    solo.step(&[false; 2], &[send(2, 2000, (Released, Some(0), 0))], &[]);
    assert_time(&solo, 0, 0, 7.0);
    assert_eq!(solo.learner.monitor.executing_count(TaskId(0)), 1);
    let now = solo.now;
    solo.step(
        &[false; 2],
        &[send(4, u64::MAX, (Executing, Some(0), 2))],
        &[],
    );
    let next_s = now.since(SimTime(8000)).as_secs_f64();
    let mean = (7.0 + next_s) / 2.0;
    let deviation = (7.0 - next_s).abs() / 2.0_f64.sqrt();
    assert_time(&solo, 0, 0, mean + deviation);
}

#[test]
fn a_new_incarnation_ends_the_trial_of_the_old_one() {
    let mut solo = receiver();
    let send = |incarnation, seq, sent| {
        heartbeat(
            0,
            (incarnation, seq),
            SimTime(sent),
            (Executing, Some(0), 0),
        )
    };
    for (incarnation, seq, at) in [(1, 1, 0), (1, 2, 4000), (1, 3, 8000), (2, 1, 8100)] {
        while solo.now.0 < at {
            solo.step(&[false; 2], &[], &[]);
        }
        solo.step(&[false; 2], &[send(incarnation, seq, at)], &[]);
    }
    assert_time(&solo, 0, 0, 20.0);
    let again = heartbeat(0, (2, 2), SimTime(10_100), (Executing, Some(0), 1));
    solo.now = SimTime(10_100);
    solo.step(&[false; 2], &[again], &[]);
    // The failed trial counts 20 s, the next one 2 s.
    assert_time(&solo, 0, 0, 11.0 + 18.0 / 2.0_f64.sqrt());
}

/// The robot's own trials are measured in the same way as its teammates'.
#[test]
fn the_own_trials_are_measured_too() {
    let mut solo = Solo::new(
        &me(1, 2, &[10.0]),
        &Config::default(),
        Preset::Team.switches(),
    );
    while solo.active().is_none() {
        solo.step(&[true], &[], &[]);
    }
    let began = solo.now - STEP;
    while solo.now < began + SimTime(6000) {
        solo.step(&[true], &[], &[]);
    }
    solo.step(&[true], &[], &[0, 0]);
    assert_time(&solo, 1, 0, 3.0);
    // ψ and λ count from here: 3 s and 9 s of the new trial.
    let progressed = solo.now - STEP;
    while solo.active().is_some() {
        solo.step(&[true], &[], &[]);
    }
    let gave_up = solo.now - STEP;
    assert_eq!(gave_up, progressed + SimTime(9000) + STEP);
    let failed_s = gave_up.since(progressed).as_secs_f64();
    let times = [3.0, 3.0, failed_s];
    let mean = times.iter().sum::<f64>() / 3.0;
    let squares: f64 = times.iter().map(|time_s| (time_s - mean).powi(2)).sum();
    assert_time(&solo, 1, 0, mean + (squares / 2.0).sqrt());
}

/// A later incarnation loads the learned times exactly. After μ new trials only the number of old ones has an effect.
#[test]
fn learned_times_are_loaded_exactly() {
    let reports = [
        (0, (Executing, Some(0), 0)),
        (4000, (Executing, Some(0), 1)),
        (7000, (Executing, Some(0), 4)),
    ];
    let learned = run_with(&reports, 7000).learner.learned();
    assert_eq!(learned.len(), 1);
    let mut solo = receiver();
    let monitor = &mut solo.learner.monitor;
    for (task, robot, times) in &learned {
        monitor.recall(*task, *robot, times);
    }
    assert_eq!(monitor.learned(), learned);
    assert_eq!(learned[0].2.latest_s, [4.0, 1.0, 1.0, 1.0]);
    assert_time(&solo, 0, 0, 3.25);

    for _ in 0..7 {
        solo.learner.monitor.store(RobotId(0), TaskId(0), 5.0);
    }
    assert_time(&solo, 0, 0, 5.0);
    assert_eq!(solo.learner.learned()[0].2.trials, 11);
}

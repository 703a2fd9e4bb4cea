//! What is measured.

use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

/// Robot 1 listens to robot 0; the prior of each of two tasks is 20 s.
fn listener() -> Solo {
    Solo::new(
        &me(1, 2, &[10.0, 10.0]),
        &Config::default(),
        Preset::Team.switches(),
    )
}

/// Hears words at times, in ms, and steps on to the end.
fn hears(words: &[(u64, Word)], end_ms: u64) -> Solo {
    let mut solo = listener();
    while solo.now.0 <= end_ms {
        let due: Vec<Word> = words
            .iter()
            .filter(|(at, _)| *at == solo.now.0)
            .map(|(_, word)| *word)
            .collect();
        let heard: Vec<_> = due.into_iter().map(|word| solo.word(0, word)).collect();
        solo.step(&[false, false], &heard, &[]);
    }
    solo
}

#[track_caller]
fn assert_time(solo: &Solo, robot: u16, task: u16, expected_s: f64) {
    let time_s = solo.learner.monitor.time_s(TaskId(task), RobotId(robot));
    assert!((time_s - expected_s).abs() < 1e-9, "{time_s}");
}

#[test]
fn without_a_trial_twice_the_unit_is_believed() {
    let solo = hears(&[(0, (Executing, Some(0), 0))], 4000);
    assert_time(&solo, 0, 0, 20.0);
    assert_time(&solo, 1, 1, 20.0);
}

/// 8 s, then three units in 6 s: 8, 2, 2, 2 have the mean 3.5 and the deviation 3.
#[test]
fn progress_ends_a_trial_and_begins_the_next() {
    let words = [
        (0, (Executing, Some(0), 0)),
        (4000, (Executing, Some(0), 0)),
        (8000, (Executing, Some(0), 1)),
        (12_000, (Executing, Some(0), 1)),
        (14_000, (Executing, Some(0), 4)),
    ];
    assert_time(&hears(&words, 8000), 0, 0, 8.0);
    assert_time(&hears(&words, 14_000), 0, 0, 6.5);
    assert_time(&hears(&words, 14_000), 0, 1, 20.0);
}

/// A trial that fails counts what was believed, and more only if it took more.
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
        assert_time(&hears(&[begins, (3000, end)], 3000), 0, 0, 20.0);
        let talks = (1..=8).map(|k| (3000 * k, begins.1));
        let words: Vec<_> = [begins]
            .into_iter()
            .chain(talks)
            .chain([(25_000, end)])
            .collect();
        assert_time(&hears(&words, 25_000), 0, 0, 25.0);
    }
    let words: Vec<_> = (0..=8).map(|k| (3000 * k, begins.1)).collect();
    // Silent for τ: the trial took until the last word.
    assert_time(&hears(&words, 28_900), 0, 0, 20.0);
    let silent = hears(&words, 29_000);
    assert_time(&silent, 0, 0, 24.0);
    assert_eq!(silent.learner.monitor.executing(TaskId(0)), 0);
}

/// The last unit is often reported with the release.
#[test]
fn a_release_that_reports_progress_is_a_success() {
    let words = [
        (0, (Executing, Some(0), 0)),
        (3000, (Released, Some(0), 1)),
        (3000, (Idle, None, 0)),
    ];
    assert_time(&hears(&words, 3000), 0, 0, 3.0);
}

/// Words count by when they were sent; late ones, doubled ones and those from the future change nothing for the worse.
#[test]
fn times_are_those_of_the_sender() {
    let mut solo = listener();
    let send = |seq, sent, word| says(0, (1, seq), SimTime(sent), word);
    solo.now = SimTime(9000);
    let late = send(1, 1000, (Executing, Some(0), 0));
    solo.step(&[false; 2], &[late.clone(), late.clone()], &[]);
    let done = send(3, 8000, (Executing, Some(0), 1));
    solo.step(&[false; 2], std::slice::from_ref(&done), &[]);
    assert_time(&solo, 0, 0, 7.0);
    solo.step(&[false; 2], &[done, late], &[]);
    solo.step(&[false; 2], &[send(2, 2000, (Released, Some(0), 0))], &[]);
    assert_time(&solo, 0, 0, 7.0);
    assert_eq!(solo.learner.monitor.executing(TaskId(0)), 1);
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
    let mut solo = listener();
    let send = |life, seq, sent| says(0, (life, seq), SimTime(sent), (Executing, Some(0), 0));
    for (life, seq, at) in [(1, 1, 0), (1, 2, 4000), (1, 3, 8000), (2, 1, 8100)] {
        while solo.now.0 < at {
            solo.step(&[false; 2], &[], &[]);
        }
        solo.step(&[false; 2], &[send(life, seq, at)], &[]);
    }
    assert_time(&solo, 0, 0, 20.0);
    let again = says(0, (2, 2), SimTime(10_100), (Executing, Some(0), 1));
    solo.now = SimTime(10_100);
    solo.step(&[false; 2], &[again], &[]);
    // The failed one counts 20 s, the next one 2 s.
    assert_time(&solo, 0, 0, 11.0 + 18.0 / 2.0_f64.sqrt());
}

/// What the robot does itself is measured as its teammates would.
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
    // ψ and λ count from there: 3 s and 9 s of the new trial.
    let progressed = solo.now - STEP;
    while solo.active().is_some() {
        solo.step(&[true], &[], &[]);
    }
    let gave_up = solo.now - STEP;
    assert_eq!(gave_up, progressed + SimTime(9000) + STEP);
    let failed_s = gave_up.since(progressed).as_secs_f64();
    let times = [3.0, 3.0, failed_s];
    let mean = times.iter().sum::<f64>() / 3.0;
    let squares: f64 = times.iter().map(|it| (it - mean).powi(2)).sum();
    assert_time(&solo, 1, 0, mean + (squares / 2.0).sqrt());
}

/// What one robot has learned another life of it recalls to the bit; after μ new trials nothing of it is left but their number.
#[test]
fn what_was_learned_is_recalled() {
    let words = [
        (0, (Executing, Some(0), 0)),
        (4000, (Executing, Some(0), 1)),
        (7000, (Executing, Some(0), 4)),
    ];
    let learned = hears(&words, 7000).learner.learned();
    assert_eq!(learned.len(), 1);
    let mut solo = listener();
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

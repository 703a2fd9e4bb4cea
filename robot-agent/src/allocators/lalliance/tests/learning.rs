//! Active learning, and what robots are drawn to.

use super::*;

use TaskState::Executing;

/// Works `unit_s` at whatever is active, to the end; gives back which tasks were worked at, in order.
fn works(
    solo: &mut Solo,
    end: SimTime,
    unit: SimTime,
    heard: impl Fn(&mut Solo) -> Vec<Word>,
) -> Vec<u16> {
    let tasks = solo.learner.tasks.len();
    let (mut begun, mut order) = (SimTime::ZERO, Vec::new());
    while solo.now < end {
        let done = solo.active().filter(|_| solo.now.since(begun) >= unit);
        let words = heard(solo);
        let heard: Vec<_> = words.into_iter().map(|word| solo.word(0, word)).collect();
        let before = solo.active();
        let progressed: Vec<u16> = done.into_iter().collect();
        solo.step(&vec![true; tasks], &heard, &progressed);
        if done.is_some() || solo.active() != before {
            begun = solo.now - STEP;
        }
        if solo.active() != before {
            order.extend(solo.active());
        }
    }
    order
}

/// Each task in turn, the least tried first, until there are two trials of each.
#[test]
fn active_learning_tries_all_in_turn() {
    let config = Config {
        learning_trials: 2,
        ..Config::default()
    };
    let me = me(1, 2, &[20.0, 20.0, 20.0]);
    let mut solo = Solo::new(&me, &config, Preset::Team.switches());
    let order = works(&mut solo, SimTime(60_000), SimTime(5000), |_| Vec::new());
    assert_eq!(order[..6], [0, 1, 2, 0, 1, 2]);
    let counts: Vec<u32> = (0..3)
        .map(|task| solo.learner.monitor.own_trials(TaskId(task)))
        .collect();
    assert!(counts.iter().all(|count| *count >= 2), "{counts:?}");
}

/// What somebody is heard at is left alone, and the phase ends in time.
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
    let order = works(&mut solo, SimTime(100_000), SimTime(5000), babbles);
    assert_eq!(order, [0]);
    // Patience is over then, and what it has been at for long enough is done by nobody else.
    assert!(solo.learner.monitor.own_trials(TaskId(0)) > 2);
}

/// What it is best at comes at once, the rest when the robot is bored.
#[test]
fn what_others_are_better_at_waits_for_boredom() {
    let me = me(1, 2, &[10.0]);
    let config = Config {
        max_delay_s: 2.0,
        ..Config::default()
    };
    let activation = |word: Option<Word>| {
        let mut solo = Solo::new(&me, &config, Preset::Team.switches());
        while solo.active().is_none() {
            let word = word.filter(|_| solo.now.0.is_multiple_of(1000));
            let heard: Vec<_> = word.into_iter().map(|word| solo.word(0, word)).collect();
            solo.step(&[true], &heard, &[]);
        }
        solo.now.0 - STEP.0
    };
    assert_eq!(activation(None), 2000);
    // Robot 0 is there, and of the same belief and of the lower rank: 5 s of boredom go first.
    let bored = activation(Some((TaskState::Idle, None, 0)));
    assert_eq!(bored, 5000 + 2000 - STEP.0);
}

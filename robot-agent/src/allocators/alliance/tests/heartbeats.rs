//! The times and contents of a robot's heartbeats.

use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

/// The time, ms, the state, its start, ms, and the task of an announcement.
type Announced = (u64, TaskState, u64, Option<TaskId>);

const NO_TASK: [bool; 4] = [false; 4];

fn announced(at: SimTime, output: &StepOutcome) -> impl Iterator<Item = Announced> {
    let announcements = output.announcements.iter();
    announcements.map(move |sent| (at.0, sent.state, sent.since.0, sent.task))
}

/// Returns gold's announcements while move(top) is applicable from the start to `until_ms`. Blue claims it every second if
/// it babbles.
fn run(setup: &Setup, babbles: bool, until_ms: u64, end_ms: u64) -> Vec<Announced> {
    let mut gold = Solo::new(GOLD, setup);
    let mut all = Vec::new();
    while gold.now < ms(end_ms) {
        let at = gold.now;
        let claims = babbles && at.0.is_multiple_of(1000);
        let claim = claims.then(|| gold.message(BLUE, Executing, ms(0)));
        let applicable = if at < ms(until_ms) { ONLY_TOP } else { NO_TASK };
        let output = gold.step(applicable, claim.as_slice());
        all.extend(announced(at, &output));
    }
    all
}

#[test]
fn heartbeats_follow_a_change_at_once_and_then_every_period() {
    // θ is reached after 20 s at 5/s and 200 ms per step; 1/ρ = 1 s.
    let top = Some(task(TOP));
    let mut all = run(&setup(Preset::Team, 2, 200), false, 22_500, 24_000);
    all.retain(|announced| announced.0 >= 19_000);
    let expected = [
        (19_000, Idle, 0, None),
        (20_000, Executing, 20_000, top),
        (21_000, Executing, 20_000, top),
        (22_000, Executing, 20_000, top),
        (22_600, Released, 22_600, top),
        (22_600, Idle, 22_600, None),
        (23_600, Idle, 22_600, None),
    ];
    assert_eq!(all, expected);

    // Without the switches there are neither releases nor idle heartbeats.
    let all = run(&setup(Preset::Par98, 2, 200), false, 22_500, 30_000);
    assert_eq!(all, expected[1..4]);

    // A waiting set. Blue's first message resets the motivation at 0. It rises slowly for φ = 30 s, then fast: θ at 44 s.
    let mut all = run(&setup(Preset::Team, 2, 200), true, 47_000, 50_000);
    all.retain(|announced| announced.1 != Idle);
    let expected = [
        (44_000, Waiting, 44_000, top),
        (45_000, Waiting, 44_000, top),
        (46_000, Waiting, 44_000, top),
        (47_000, Released, 47_000, top),
    ];
    assert_eq!(all, expected);
}

#[test]
fn periods_are_rounded_up_to_steps_and_idle_heartbeats_use_the_longest() {
    let mut setup = setup(Preset::Team, 2, 200);
    every_set(&mut setup, |set| set.broadcast_rate_hz = 2.0);
    let times = |setup: &Setup, end_ms| -> Vec<u64> {
        let all = run(setup, false, 0, end_ms);
        all.into_iter().map(|announced| announced.0).collect()
    };
    assert_eq!(times(&setup, 2000), [0, 600, 1200, 1800]);
    let gold = Arc::make_mut(&mut setup.alliance.robots)
        .get_mut("gold")
        .unwrap();
    gold.sets.get_mut("report").unwrap().broadcast_rate_hz = 0.25;
    assert_eq!(times(&setup, 9000), [0, 4000, 8000]);
}

#[test]
fn progress_is_announced_at_once_and_counted() {
    let mut setup = setup(Preset::Team, 2, 200);
    every_set(&mut setup, |set| set.broadcast_rate_hz = 0.25);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(21_000), ONLY_TOP);
    let mut step = |progressed: &[TaskId]| -> Vec<u32> {
        let output = step_of(&mut gold.engine, gold.now, &[], &ONLY_TOP, progressed);
        gold.now = gold.now + ms(200);
        let announcements = output.announcements.iter();
        announcements.map(|sent| sent.progress).collect()
    };
    assert!(step(&[]).is_empty());
    assert_eq!(step(&[task(TOP), task(TOP)]), [2]);
    // Progress on another task is not announced for this one.
    assert!(step(&[task(BOTTOM)]).is_empty());
    assert_eq!(step(&[task(TOP)]), [3]);
}

#[test]
fn a_stopped_robot_does_not_make_up_for_missed_heartbeats() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(21_200), ONLY_TOP);
    gold.now = ms(90_000);
    let step = |_| gold.step(ONLY_TOP, &[]).announcements.len();
    let counts: Vec<usize> = (0..7).map(step).collect();
    assert_eq!(counts, [1, 0, 0, 0, 0, 1, 0]);
}

#[test]
fn no_release_while_another_set_continues_the_task() {
    // Blue waits with both of its sets for find until gold releases it.
    let mut setup = setup(Preset::Team, 2, 200);
    setup.scenario.robots[0].side_sensor = true;
    let blue = Arc::make_mut(&mut setup.alliance.robots)
        .get_mut("blue")
        .unwrap();
    let wander = blue.sets["find-wander"].clone();
    blue.sets.insert("find-methodical".to_owned(), wander);
    let mut blue = engine(BLUE, &setup);
    let mut step = |seq: u64, state| -> Vec<_> {
        let now = ms(200 * seq);
        let message = heartbeat(GOLD, seq, now, state, ms(0), FIND);
        let applicable = [true, true, false, false, false];
        let output = step_of(&mut blue, now, &[message], &applicable, &[]);
        let announcements = output.announcements.into_iter();
        announcements
            .map(|sent| (sent.state, sent.behavior))
            .collect()
    };
    let methodical = Some(BehaviorId(0));
    let before = (1..=226).flat_map(|seq| step(seq, Executing)).last();
    assert_eq!(before, Some((Waiting, Some(set(FIND)))));
    assert_eq!(step(227, Released), [(Executing, methodical)]);
    assert_eq!(step(228, Released), []);
}

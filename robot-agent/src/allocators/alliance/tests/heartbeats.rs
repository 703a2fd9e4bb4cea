//! The times and contents of a robot's heartbeats.

use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

/// Returns (time in ms, state, since in ms, task) of each announcement of a step.
fn announced(at: SimTime, output: &StepOutcome) -> Vec<(u64, TaskState, u64, Option<TaskId>)> {
    let announcements = output.announcements.iter();
    announcements
        .map(|announcement| {
            (
                at.0,
                announcement.state,
                announcement.since.0,
                announcement.task,
            )
        })
        .collect()
}

/// Returns gold's announcements while move(top) is applicable from the start to `until_ms`.
fn run(setup: &Setup, until_ms: u64, end_ms: u64) -> Vec<(u64, TaskState, u64, Option<TaskId>)> {
    let mut gold = Solo::new(GOLD, setup);
    let mut all = Vec::new();
    while gold.now < ms(end_ms) {
        let at = gold.now;
        let applicable = if at < ms(until_ms) {
            ONLY_TOP
        } else {
            [false; 4]
        };
        let output = gold.step(applicable, &[]);
        all.extend(announced(at, &output));
    }
    all
}

#[test]
fn heartbeats_follow_a_change_at_once_and_then_every_period() {
    let setup = setup(Preset::Team, 2, 200);
    // θ is reached after 20 s at 5/s and 200 ms per step; 1/ρ = 1 s.
    let top = Some(task(TOP));
    let last: Vec<_> = run(&setup, 22_500, 24_000)
        .into_iter()
        .filter(|announced| announced.0 >= 19_000)
        .collect();
    assert_eq!(
        last,
        [
            (19_000, Idle, 0, None),
            (20_000, Executing, 20_000, top),
            (21_000, Executing, 20_000, top),
            (22_000, Executing, 20_000, top),
            (22_600, Released, 22_600, top),
            (22_600, Idle, 22_600, None),
            (23_600, Idle, 22_600, None),
        ]
    );
}

#[test]
fn period_that_is_no_multiple_of_the_step_is_rounded_up() {
    let mut setup = setup(Preset::Team, 2, 200);
    every_set(&mut setup, |set| set.broadcast_rate_hz = 2.0);
    let times: Vec<u64> = run(&setup, 0, 2000)
        .into_iter()
        .map(|announced| announced.0)
        .collect();
    assert_eq!(times, [0, 600, 1200, 1800]);
}

#[test]
fn releases_and_idle_heartbeats_depend_on_the_switches() {
    let setup = setup(Preset::Par98, 2, 200);
    let states: Vec<TaskState> = run(&setup, 22_500, 30_000)
        .into_iter()
        .map(|announced| announced.1)
        .collect();
    assert_eq!(states, [Executing; 3]);
}

#[test]
fn idle_heartbeats_come_at_the_longest_period() {
    let mut setup = setup(Preset::Team, 2, 200);
    let gold = setup.alliance.robots.get_mut("gold").unwrap();
    gold.sets.get_mut("report").unwrap().broadcast_rate_hz = 0.25;
    let times: Vec<u64> = run(&setup, 0, 9000)
        .into_iter()
        .map(|announced| announced.0)
        .collect();
    assert_eq!(times, [0, 4000, 8000]);
}

#[test]
fn progress_is_announced_at_once_and_counted() {
    let mut setup = setup(Preset::Team, 2, 200);
    every_set(&mut setup, |set| set.broadcast_rate_hz = 0.25);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(21_000), ONLY_TOP);
    let mut step = |progressed: &[TaskId]| {
        let output = super::step_of(
            &mut gold.engine,
            &StepInput {
                now: gold.now,
                received: &[],
                applicable: &ONLY_TOP,
                progressed,
            },
        );
        gold.now = gold.now + ms(200);
        let announcements = output.announcements.iter();
        let counts: Vec<u32> = announcements
            .map(|announcement| announcement.progress)
            .collect();
        (counts, gold.engine.progress(task(TOP)))
    };
    assert_eq!(step(&[]), (vec![], 0));
    assert_eq!(step(&[task(TOP), task(TOP)]), (vec![2], 2));
    assert_eq!(step(&[]), (vec![], 2));
    // Progress on another task is not announced for this one.
    assert_eq!(step(&[task(BOTTOM)]), (vec![], 2));
}

#[test]
fn a_stopped_robot_does_not_make_up_for_missed_heartbeats() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(21_200), ONLY_TOP);
    gold.now = ms(90_000);
    let counts: Vec<usize> = (0..7)
        .map(|_| gold.step(ONLY_TOP, &[]).announcements.len())
        .collect();
    assert_eq!(counts, [1, 0, 0, 0, 0, 1, 0]);
}

#[test]
fn a_waiting_set_announces_every_period_and_releases_when_it_stops() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    let mut all = Vec::new();
    while gold.now < ms(50_000) {
        let at = gold.now;
        let received: Vec<_> =
            at.0.is_multiple_of(1000)
                .then(|| gold.message(BLUE, Executing, ms(0)))
                .into_iter()
                .collect();
        let applicable = if at < ms(47_000) {
            ONLY_TOP
        } else {
            [false; 4]
        };
        let output = gold.step(applicable, &received);
        all.extend(
            announced(at, &output)
                .into_iter()
                .filter(|announced| announced.1 != Idle),
        );
    }
    // Blue's first message resets the motivation at 0. It rises slowly for φ = 30 s, then fast: θ at 44 s.
    let top = Some(task(TOP));
    let expected = [
        (44_000, Waiting, 44_000, top),
        (45_000, Waiting, 44_000, top),
        (46_000, Waiting, 44_000, top),
        (47_000, Released, 47_000, top),
    ];
    assert_eq!(all, expected);
}

#[test]
fn no_release_while_another_set_continues_the_task() {
    // Blue waits with both of its sets for find until gold releases it.
    let mut setup = setup(Preset::Team, 2, 200);
    setup.scenario.robots[0].side_sensor = true;
    let blue = setup.alliance.robots.get_mut("blue").unwrap();
    let wander = blue.sets["find-wander"].clone();
    blue.sets.insert("find-methodical".to_owned(), wander);
    let mut blue = engine(BLUE, &setup);
    let mut step = |seq: u64, state| {
        let now = ms(200 * seq);
        let message = heartbeat(GOLD, seq, now, state, ms(0), FIND);
        let output = super::step_of(
            &mut blue,
            &StepInput {
                now,
                received: &shared(&[message]),
                applicable: &[true, true, false, false, false],
                progressed: &[],
            },
        );
        let announcements = output.announcements.into_iter();
        announcements
            .map(|announcement| (announcement.state, announcement.behavior))
            .collect::<Vec<_>>()
    };
    let methodical = Some(BehaviorId(0));
    let before = (1..=226).flat_map(|seq| step(seq, Executing)).last();
    assert_eq!(before, Some((Waiting, Some(set(FIND)))));
    assert_eq!(step(227, Released), [(Executing, methodical)]);
    assert_eq!(step(228, Released), []);
}

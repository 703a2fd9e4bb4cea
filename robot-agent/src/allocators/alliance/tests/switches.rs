//! The effect of each switch alone: two teams that differ only in this switch meet the same events. `waiting` and
//! `takeover` test `wish_when_suppressed` and `reset_stops_active`; the tests of the world's barrier cover
//! `step_order`.

use scenario::HistoryOrigin;

use super::*;

use BehaviorState::{Active, Waiting};

/// Returns preset `team` unchanged, and with one switch changed.
fn pair(count: usize, change: fn(&mut Switches)) -> [Setup; 2] {
    let team = setup(Preset::Team, count, 200);
    let mut changed = team.clone();
    change(&mut changed.alliance.switches);
    assert_ne!(team.alliance.switches, changed.alliance.switches);
    [team, changed]
}

/// Returns gold's motivations in two steps: at 10 s, with blue's first message about move(top), and in the step after
/// it.
fn motivations_from_10_s(setup: &Setup, state: TaskState) -> [f64; 2] {
    let mut gold = Solo::new(GOLD, setup);
    gold.quiet_until(ms(10_000), ONLY_TOP);
    let message = gold.message(BLUE, state, ms(0));
    [vec![message], vec![]].map(|received| {
        let motivation = gold.step(ONLY_TOP, &received).motivations[TOP].motivation;
        (motivation * 10.0).round() / 10.0
    })
}

#[test]
fn waiting() {
    // Blue claims at 20 s; gold receives the claim at 20.2 s. The slower gold reaches θ at 64.2 s.
    let outcomes = pair(2, |switches| switches.waiting = false).map(|mut setup| {
        behaviors_of(&mut setup, "gold", |set| set.fast_impatience = 4.999);
        let mut team = Team::new(&setup);
        team.run_until(ms(64_600), &[ONLY_TOP; 2]);
        let (_, state, reason) = team.changes_of(GOLD, TOP)[0];
        (state, reason)
    });
    let reason = Reason::Threshold;
    assert_eq!(outcomes, [(Waiting, reason), (Active, reason)]);
}

#[test]
fn waiting_counts() {
    let outcomes = pair(2, |switches| switches.waiting_counts = true)
        .map(|setup| motivations_from_10_s(&setup, TaskState::Waiting));
    // Without the switch the rise is fast; with it, gold is reset and slow.
    assert_eq!(outcomes, [[50.0, 51.0], [0.0, 0.2]]);
}

#[test]
fn history_origin() {
    let outcomes = pair(2, |switches| {
        switches.history_origin = HistoryOrigin::MissionStart
    })
    .map(|setup| {
        let mut team = Team::new(&setup);
        team.run_until(ms(25_000), &[ONLY_TOP; 2]);
        team.step_with(&[ONLY_TOP; 2], &[(BLUE, task(TOP))]);
        let gold = team.step(&[ONLY_TOP; 2])[1].motivations[TOP];
        gold.impatience_reset
    });
    assert_eq!(outcomes, [false, true]);
}

#[test]
fn arbitration() {
    let outcomes = pair(2, |switches| switches.arbitration = false).map(|setup| {
        let mut team = Team::new(&setup);
        team.run_until(ms(30_000), &[ONLY_TOP; 2]);
        let active = team
            .engines
            .iter()
            .filter(|engine| engine.active().is_some());
        active.count()
    });
    assert_eq!(outcomes, [1, 2]);
}

#[test]
fn release_message() {
    // Blue's last heartbeat is received at 30.2 s; its set ceases to be applicable at 30.4 s.
    let outcomes = pair(2, |switches| switches.release_message = false).map(|mut setup| {
        // An idle heartbeat has the same effect as a release.
        setup.alliance.switches.idle_heartbeat = false;
        let mut team = Team::new(&setup);
        team.run_until(ms(30_400), &[ONLY_TOP; 2]);
        team.run_until(ms(36_000), &[[false; 4], ONLY_TOP]);
        team.changes_of(GOLD, TOP).last().unwrap().0
    });
    assert_eq!(outcomes, [30_600, 35_200]);
}

#[test]
fn idle_heartbeat() {
    let outcomes = pair(2, |switches| switches.idle_heartbeat = false).map(|setup| {
        let mut gold = Solo::new(GOLD, &setup);
        gold.step([false; 4], &[]).announcements.len()
    });
    assert_eq!(outcomes, [1, 0]);
}

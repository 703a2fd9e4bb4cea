//! What each switch does by itself: the same happens to teams that differ in this switch alone. Of `wish_when_suppressed`
//! and `reset_stops_active` that is shown in `waiting` and `takeover`; `step_order` is the world's (its barrier's tests).

use alliance_proto::scenario::HistoryOrigin;

use super::*;

use BehaviorState::{Active, Waiting};

/// Preset `team` as it is, and with one switch changed.
fn pair(count: usize, change: fn(&mut Switches)) -> [Setup; 2] {
    let team = setup(Preset::Team, count, 200);
    let mut changed = team.clone();
    change(&mut changed.alliance.switches);
    assert_ne!(team.alliance.switches, changed.alliance.switches);
    [team, changed]
}

/// Gold's step at 10 s, in which it hears blue say that about move(top) for the first time, and the step after it.
fn hears_at_10_s(setup: &Setup, state: TaskState) -> [f64; 2] {
    let mut gold = Solo::new(GOLD, setup);
    gold.quiet_until(ms(10_000), ONLY_TOP);
    let word = gold.says(BLUE, state, ms(0));
    [vec![word], vec![]].map(|heard| {
        let motivation = gold.step(ONLY_TOP, &heard).motivations[TOP].motivation;
        (motivation * 10.0).round() / 10.0
    })
}

#[test]
fn waiting() {
    // Blue claims at 20 s, which gold hears first at 20.2 s; gold, which is slower, comes to θ at 64.2 s.
    let outcomes = pair(2, |it| it.waiting = false).map(|mut setup| {
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
    let outcomes = pair(2, |it| it.waiting_counts = true)
        .map(|setup| hears_at_10_s(&setup, TaskState::Waiting));
    // Fast, or reset and slow.
    assert_eq!(outcomes, [[50.0, 51.0], [0.0, 0.2]]);
}

#[test]
fn history_origin() {
    let outcomes = pair(2, |it| it.history_origin = HistoryOrigin::MissionStart).map(|setup| {
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
    let outcomes = pair(2, |it| it.arbitration = false).map(|setup| {
        let mut team = Team::new(&setup);
        team.run_until(ms(30_000), &[ONLY_TOP; 2]);
        let active = team.engines.iter().filter(|it| it.active().is_some());
        active.count()
    });
    assert_eq!(outcomes, [1, 2]);
}

#[test]
fn release_message() {
    // Blue's last heartbeat was heard at 30.2 s; its set ceases to be applicable at 30.4 s.
    let outcomes = pair(2, |it| it.release_message = false).map(|mut setup| {
        // An idle heartbeat says as much as a release.
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
    let outcomes = pair(2, |it| it.idle_heartbeat = false).map(|setup| {
        let mut gold = Solo::new(GOLD, &setup);
        gold.step([false; 4], &[]).announcements.len()
    });
    assert_eq!(outcomes, [1, 0]);
}

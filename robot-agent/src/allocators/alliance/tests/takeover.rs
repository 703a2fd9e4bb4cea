//! The takeover times of ALLIANCE.md §4, to one step, at steps of 10, 50 and 200 ms.

use super::*;

const STEPS_MS: [u64; 3] = [10, 50, 200];

fn assert_within_a_step(actual: SimTime, expected_s: f64, step_ms: u64) {
    let difference = (actual.as_secs_f64() - expected_s).abs();
    assert!(
        difference <= step_ms as f64 / 1000.0 + 1e-9,
        "{actual} instead of {expected_s} s at steps of {step_ms} ms"
    );
}

/// Time from the first heartbeat of an incumbent, which speaks every second for `speaks_s`, to θ.
fn takeover(step_ms: u64, phi_s: f64, speaks_s: u64) -> SimTime {
    let mut setup = setup(Preset::Par98, 2, step_ms);
    every_set(&mut setup, |set| {
        set.willing_to_affect_s
            .values_mut()
            .for_each(|it| *it = phi_s);
    });
    let mut gold = Solo::new(GOLD, &setup);
    let first = ms(4000);
    gold.quiet_until(first, ONLY_TOP);
    loop {
        let spoken = gold.now.since(first);
        let speaks = spoken.0.is_multiple_of(1000) && spoken <= ms(1000 * speaks_s);
        let heard: Vec<_> = speaks
            .then(|| gold.says(BLUE, TaskState::Executing, first))
            .into_iter()
            .collect();
        let output = gold.step(ONLY_TOP, &heard);
        if spoken == SimTime::ZERO {
            assert_eq!(output.motivations[TOP].motivation, 0.0);
        }
        if gold.engine.active().is_some() {
            return spoken;
        }
    }
}

#[test]
fn nobody_on_the_task() {
    for step_ms in STEPS_MS {
        let mut gold = Solo::new(GOLD, &setup(Preset::Team, 2, step_ms));
        let mut taken = gold.now;
        while gold.engine.active().is_none() {
            taken = gold.now;
            gold.step(ONLY_TOP, &[]);
        }
        assert_within_a_step(taken, 20.0, step_ms);
    }
}

#[test]
fn incumbent_talks_but_fails_and_patience_ends_first() {
    for step_ms in STEPS_MS {
        assert_within_a_step(takeover(step_ms, 30.0, u64::MAX / 1000), 44.0, step_ms);
    }
}

#[test]
fn incumbent_talks_but_fails_and_patience_outlasts_the_slow_rise() {
    for step_ms in STEPS_MS {
        assert_within_a_step(takeover(step_ms, 300.0, u64::MAX / 1000), 100.0, step_ms);
    }
}

#[test]
fn incumbent_falls_silent() {
    for step_ms in STEPS_MS {
        assert_within_a_step(takeover(step_ms, 300.0, 12), 33.6, step_ms);
    }
}

/// When the incumbent (blue) of a newcomer (gold) leaves the task, as if it had come to θ at 20 s exactly, and why.
///
/// Adding up 2000 gains of 0.05 ends just below 100, which costs blue one step; the times after it are counted from there.
fn newcomer(preset: Preset, reset_stops_active: bool, step_ms: u64) -> (SimTime, Reason) {
    let mut setup = setup(preset, 2, step_ms);
    setup.alliance.switches.reset_stops_active = reset_stops_active;
    behaviors_of(&mut setup, "blue", |set| set.before_yielding_s = 80.0);
    behaviors_of(&mut setup, "gold", |set| {
        set.fast_impatience = 4.0;
        set.willing_to_affect_s
            .values_mut()
            .for_each(|it| *it = 60.0);
    });
    let mut team = Team::new(&setup);
    team.run_until(ms(110_000), &[ONLY_TOP; 2]);
    let blue = team.changes_of(BLUE, TOP);
    let (activated, _, _) = blue[0];
    assert_within_a_step(ms(activated), 20.0, step_ms);
    let (left, state, reason) = blue[1];
    assert_eq!(state, BehaviorState::Hibernating);
    (ms(20_000) + ms(left - activated), reason)
}

#[test]
fn newcomer_knocks_off_the_incumbent_where_a_reset_stops_active_sets() {
    for step_ms in STEPS_MS {
        let step_s = step_ms as f64 / 1000.0;
        // In order, gold hears blue in the same step and blue hears gold in the next; else both are one step later.
        let (left, reason) = newcomer(Preset::Thesis, true, step_ms);
        assert_within_a_step(left, 90.0 + step_s, step_ms);
        assert_eq!(reason, Reason::ResetBy(GOLD));
        let (left, reason) = newcomer(Preset::Par98, true, step_ms);
        assert_within_a_step(left, 90.0 + 2.0 * step_s, step_ms);
        assert_eq!(reason, Reason::ResetBy(GOLD));
    }
}

#[test]
fn newcomer_has_to_wait_for_psi_otherwise() {
    for step_ms in STEPS_MS {
        for preset in [Preset::Thesis, Preset::Par98, Preset::Team] {
            let (left, reason) = newcomer(preset, false, step_ms);
            assert_within_a_step(left, 100.0, step_ms);
            assert_eq!(reason, Reason::AcquiescedPsi);
        }
    }
}

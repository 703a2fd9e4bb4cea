//! The takeover times of docs/ALLIANCE.md §4, to one step, with steps of 10, 50 and 200 ms.

use super::*;

const STEPS_MS: [u64; 3] = [10, 50, 200];

fn assert_within_a_step(actual: SimTime, expected_s: f64, step_ms: u64) {
    let difference = (actual.as_secs_f64() - expected_s).abs();
    assert!(
        difference <= step_ms as f64 / 1000.0 + 1e-9,
        "{actual} instead of {expected_s} s at steps of {step_ms} ms"
    );
}

/// Returns the time from an incumbent's first heartbeat to θ. The incumbent sends every second for `sends_s`.
fn takeover(step_ms: u64, phi_s: f64, sends_s: u64) -> SimTime {
    let mut setup = setup(Preset::Par98, 2, step_ms);
    every_set(&mut setup, |set| toward_all(set, 1.0, phi_s));
    let mut gold = Solo::new(GOLD, &setup);
    let first = ms(4000);
    gold.quiet_until(first, ONLY_TOP);
    loop {
        let elapsed = gold.now.since(first);
        let sends = elapsed.0.is_multiple_of(1000) && elapsed <= ms(1000 * sends_s);
        let received: Vec<_> = sends
            .then(|| gold.message(BLUE, TaskState::Executing, first))
            .into_iter()
            .collect();
        let output = gold.step(ONLY_TOP, &received);
        if elapsed == SimTime::ZERO {
            assert_eq!(output.motivations[TOP].motivation, 0.0);
        }
        if gold.engine.active().is_some() {
            return elapsed;
        }
    }
}

#[test]
fn a_task_without_an_incumbent() {
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
fn a_failing_or_silent_incumbent_is_replaced() {
    let endless = u64::MAX / 1000;
    let table = [
        // The incumbent fails; φ ends before the slow rise does.
        (30.0, endless, 44.0),
        // The incumbent fails; the slow rise ends before φ does.
        (300.0, endless, 100.0),
        // The incumbent is silent from 12 s on.
        (300.0, 12, 33.6),
    ];
    for step_ms in STEPS_MS {
        for (phi_s, sends_s, expected_s) in table {
            assert_within_a_step(takeover(step_ms, phi_s, sends_s), expected_s, step_ms);
        }
    }
}

/// Returns when and why the incumbent (blue) of a newcomer (gold) leaves the task, as if it had reached θ at exactly 20
/// s.
///
/// The sum of 2000 gains of 0.05 is slightly below 100, so that blue needs one more step. Later times count from its
/// activation.
fn newcomer(preset: Preset, reset_stops_active: bool, step_ms: u64) -> (SimTime, Reason) {
    let mut setup = setup(preset, 2, step_ms);
    setup.alliance.switches.reset_stops_active = reset_stops_active;
    behaviors_of(&mut setup, "blue", |set| set.before_yielding_s = 80.0);
    behaviors_of(&mut setup, "gold", |set| {
        set.fast_impatience = 4.0;
        toward_all(set, 1.0, 60.0);
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
fn newcomer_displaces_the_incumbent_where_a_reset_stops_active_sets() {
    for step_ms in STEPS_MS {
        let step_s = step_ms as f64 / 1000.0;
        // In order, gold receives blue's message in the same step and blue receives gold's in the next. Otherwise both
        // are one step later.
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

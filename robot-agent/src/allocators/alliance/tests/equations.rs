//! The equations one by one, compared with tables computed by hand.

use super::*;
use crate::allocators::alliance::history::History;
use crate::allocators::alliance::motivation::{
    Factors, acquiescence, impatience, impatience_reset, motivation,
};
use crate::allocators::alliance::params::{Params, TowardTeammate};

/// Returns parameters with τ = 5 s, δ_slow = 1 and φ = 30 s toward gold, δ_slow = 2 and φ = 10 s toward green.
fn params() -> Params {
    let toward = |slow, phi| TowardTeammate { slow, phi: ms(phi) };
    Params {
        period: ms(1000),
        tau: ms(5000),
        fast: 5.0,
        toward_most: Some(toward(1.0, 30_000)),
        toward: vec![(GREEN, toward(2.0, 10_000))],
        psi: ms(20_000),
        lambda: ms(60_000),
    }
}

/// Returns the history after heartbeats (time in ms, sender, state) about move(top).
fn history_of(messages: &[(u64, RobotId, TaskState)], switches: &Switches) -> History {
    let mut history = History::new(ALL.len());
    for (seq, &(at, sender, state)) in (1..).zip(messages) {
        let message = heartbeat(sender, seq, ms(at), state, ms(0), TOP);
        history.receive(ms(at), &message, switches, |task| Some(task.index()));
    }
    history
}

use TaskState::{Executing, Released, Waiting};

#[test]
fn impatience_is_slow_within_tau_and_before_phi() {
    let switches = Preset::Par98.switches();
    let history = history_of(
        &[(1000, GOLD, Executing), (8000, GOLD, Executing)],
        &switches,
    );
    let late = history_of(
        &[(1000, GOLD, Executing), (30_000, GOLD, Executing)],
        &switches,
    );
    let table = [
        // The window is open at its start: a message exactly 5 s old does not count.
        (&history, 8000, 1.0),
        (&history, 12_999, 1.0),
        (&history, 13_000, 5.0),
        // φ counts from the first message and ends the slow rate after 30 s.
        (&late, 30_000, 1.0),
        (&late, 30_999, 1.0),
        (&late, 31_000, 5.0),
    ];
    for (history, now, expected) in table {
        let rate = impatience(&params(), history.records_of(task(TOP).index()), ms(now));
        assert_eq!(rate, expected, "at {now} ms");
    }
}

#[test]
fn impatience_takes_the_slowest_rate_of_the_teammates_that_count() {
    let switches = Preset::Par98.switches();
    let messages = [
        (1000, GREEN, Executing),
        (2000, GOLD, Executing),
        (5000, GREEN, Executing),
        (8000, GREEN, Executing),
    ];
    let history = history_of(&messages, &switches);
    let table = [
        (5000, 1.0),
        (6999, 1.0),
        // Gold has been silent for τ: green's rate applies until green's φ.
        (7000, 2.0),
        (10_999, 2.0),
        (11_000, 5.0),
    ];
    for (now, expected) in table {
        let rate = impatience(&params(), history.records_of(task(TOP).index()), ms(now));
        assert_eq!(rate, expected, "at {now} ms");
    }
}

#[test]
fn impatience_ignores_other_tasks() {
    let switches = Preset::Par98.switches();
    let history = history_of(&[(1000, GOLD, Executing)], &switches);
    let rate = impatience(
        &params(),
        history.records_of(task(BOTTOM).index()),
        ms(1000),
    );
    assert_eq!(rate, 5.0);
}

#[test]
fn reset_comes_once_per_teammate_with_its_first_message() {
    let switches = Preset::Par98.switches();
    let mut history = History::new(ALL.len());
    let script = [
        (1000, &[GREEN][..], Some(GREEN)),
        (1050, &[], None),
        (2000, &[GREEN], None),
        (3000, &[GOLD, GREEN], Some(GOLD)),
        (4000, &[GOLD, GREEN], None),
    ];
    let mut seq = 0;
    for (at, senders, expected) in script {
        for &sender in senders {
            seq += 1;
            let message = heartbeat(sender, seq, ms(at), Executing, ms(0), TOP);
            history.receive(ms(at), &message, &switches, |task| Some(task.index()));
        }
        let reset = impatience_reset(history.records_of(task(TOP).index()), ms(at));
        assert_eq!(reset, expected, "at {at} ms");
    }
}

#[test]
fn reset_names_the_lowest_rank_of_two() {
    let switches = Preset::Par98.switches();
    let history = history_of(
        &[(1000, GREEN, Executing), (1000, GOLD, Executing)],
        &switches,
    );
    assert_eq!(
        impatience_reset(history.records_of(task(TOP).index()), ms(1000)),
        Some(GOLD)
    );
}

#[test]
fn acquiescence_after_psi_if_wanted_and_after_lambda_anyway() {
    let switches = Preset::Team.switches();
    let none = history_of(&[], &switches);
    let executing = history_of(&[(28_000, GOLD, Executing)], &switches);
    let waiting = history_of(&[(28_000, GOLD, Waiting)], &switches);
    let released = history_of(
        &[(27_000, GOLD, Waiting), (28_000, GOLD, Released)],
        &switches,
    );
    let yields = Some(Reason::AcquiescedPsi);
    let gives_up = Some(Reason::GaveUpLambda);
    // The set is active since 10 s, so that ψ ends at 30 s and λ at 70 s.
    let table = [
        (&executing, 30_000, None),
        (&executing, 30_001, yields),
        (&waiting, 30_001, yields),
        (&released, 30_001, None),
        (&none, 30_001, None),
        // Gold's last message was received at 28 s.
        (&waiting, 32_999, yields),
        (&waiting, 33_000, None),
        (&none, 70_000, None),
        (&none, 70_001, gives_up),
    ];
    for (history, now, expected) in table {
        let records = history.records_of(task(TOP).index());
        let reason = acquiescence(&params(), ms(10_000), records, ms(now));
        assert_eq!(reason, expected, "at {now} ms");
    }
}

#[test]
fn motivation_adds_caps_and_is_zero_if_any_factor_is() {
    let ones = Factors {
        sensory_feedback: true,
        activity_suppression: true,
        reset_by: None,
        acquiescence: None,
    };
    let not_applicable = Factors {
        sensory_feedback: false,
        ..ones
    };
    let suppressed = Factors {
        activity_suppression: false,
        ..ones
    };
    let reset = Factors {
        reset_by: Some(GOLD),
        ..ones
    };
    let yields = Factors {
        acquiescence: Some(Reason::AcquiescedPsi),
        ..ones
    };
    let table = [
        (0.0, 0.25, ones, 0.25, None),
        (99.5, 0.25, ones, 99.75, None),
        (99.75, 0.25, ones, 100.0, None),
        (99.9, 0.25, ones, 100.0, None),
        (100.0, 0.25, ones, 100.0, None),
        (50.0, 0.25, not_applicable, 0.0, Some(Reason::NotApplicable)),
        (50.0, 0.25, suppressed, 0.0, Some(Reason::Suppressed)),
        (50.0, 0.25, reset, 0.0, Some(Reason::ResetBy(GOLD))),
        (100.0, 0.25, yields, 0.0, Some(Reason::AcquiescedPsi)),
    ];
    for (previous, gain, factors, expected, reason) in table {
        assert_eq!(motivation(previous, gain, &factors, 100.0), expected);
        assert_eq!(factors.zero(), reason);
    }
    let all = Factors {
        sensory_feedback: false,
        activity_suppression: false,
        reset_by: Some(GOLD),
        acquiescence: Some(Reason::GaveUpLambda),
    };
    assert_eq!(all.zero(), Some(Reason::NotApplicable));
}

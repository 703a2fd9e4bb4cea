//! The equations one by one, compared with tables computed by hand.

use super::*;
use crate::allocators::alliance::history::History;
use crate::allocators::alliance::motivation::{
    Factors, acquiescence, impatience, impatience_reset, motivation,
};
use crate::allocators::alliance::params::{Params, TowardTeammate};

use Reason::{AcquiescedPsi, GaveUpLambda, NotApplicable, ResetBy, Suppressed};

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

/// Heartbeats about move(top): time in ms, sender, state.
type Messages = [(u64, RobotId, TaskState)];

/// Stores the heartbeats that were received up to `now_ms`.
fn history_at(messages: &Messages, preset: Preset, now_ms: u64) -> History {
    let mut history = History::new(ALL.len());
    let received = messages.iter().filter(|message| message.0 <= now_ms);
    for (seq, &(at, sender, state)) in (1..).zip(received) {
        let message = heartbeat(sender, seq, ms(at), state, ms(0), TOP);
        history.receive(ms(at), &message, &preset.switches(), |task| {
            Some(task.index())
        });
    }
    history
}

use TaskState::{Executing, Released, Waiting};

#[test]
fn impatience_is_the_slowest_rate_of_the_teammates_that_count() {
    let early: &Messages = &[(1000, GOLD, Executing), (8000, GOLD, Executing)];
    let late: &Messages = &[(1000, GOLD, Executing), (30_000, GOLD, Executing)];
    let two: &Messages = &[
        (1000, GREEN, Executing),
        (2000, GOLD, Executing),
        (5000, GREEN, Executing),
        (8000, GREEN, Executing),
    ];
    let table = [
        // The window is open at its start: a message exactly 5 s old does not count.
        (early, TOP, 8000, 1.0),
        (early, TOP, 12_999, 1.0),
        (early, TOP, 13_000, 5.0),
        (early, BOTTOM, 8000, 5.0),
        // φ counts from the first message and ends the slow rate after 30 s.
        (late, TOP, 30_000, 1.0),
        (late, TOP, 30_999, 1.0),
        (late, TOP, 31_000, 5.0),
        (two, TOP, 5000, 1.0),
        (two, TOP, 6999, 1.0),
        // Gold has been silent for τ: green's rate applies until green's φ.
        (two, TOP, 7000, 2.0),
        (two, TOP, 10_999, 2.0),
        (two, TOP, 11_000, 5.0),
    ];
    for (messages, index, now, expected) in table {
        let history = history_at(messages, Preset::Par98, u64::MAX);
        let rate = impatience(&params(), history.records_of(index), ms(now));
        assert_eq!(rate, expected, "task {index} at {now} ms");
    }
}

#[test]
fn reset_comes_once_per_teammate_with_its_first_message() {
    let messages: &Messages = &[
        (1000, GREEN, Executing),
        (2000, GREEN, Executing),
        (3000, GOLD, Executing),
        (3000, GREEN, Executing),
        (4000, GOLD, Executing),
        (4000, GREEN, Executing),
    ];
    // Of two first messages in one step the lower rank is named.
    let both: &Messages = &[(1000, GREEN, Executing), (1000, GOLD, Executing)];
    let table = [
        (messages, 1000, Some(GREEN)),
        (messages, 1050, None),
        (messages, 2000, None),
        (messages, 3000, Some(GOLD)),
        (messages, 4000, None),
        (both, 1000, Some(GOLD)),
    ];
    for (messages, now, expected) in table {
        let history = history_at(messages, Preset::Par98, now);
        let reset = impatience_reset(history.records_of(TOP), ms(now));
        assert_eq!(reset, expected, "at {now} ms");
    }
}

#[test]
fn acquiescence_after_psi_if_wanted_and_after_lambda_anyway() {
    let none: &Messages = &[];
    let executing: &Messages = &[(28_000, GOLD, Executing)];
    let waiting: &Messages = &[(28_000, GOLD, Waiting)];
    let released: &Messages = &[(27_000, GOLD, Waiting), (28_000, GOLD, Released)];
    let yields = Some(AcquiescedPsi);
    let gives_up = Some(GaveUpLambda);
    // The set is active since 10 s, so that ψ ends at 30 s and λ at 70 s.
    let table = [
        (executing, 30_000, None),
        (executing, 30_001, yields),
        (waiting, 30_001, yields),
        (released, 30_001, None),
        (none, 30_001, None),
        // Gold's last message was received at 28 s.
        (waiting, 32_999, yields),
        (waiting, 33_000, None),
        (none, 70_000, None),
        (none, 70_001, gives_up),
    ];
    for (messages, now, expected) in table {
        let history = history_at(messages, Preset::Team, u64::MAX);
        let records = history.records_of(TOP);
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
    let mut not_applicable = ones;
    not_applicable.sensory_feedback = false;
    let mut suppressed = ones;
    suppressed.activity_suppression = false;
    let mut reset = ones;
    reset.reset_by = Some(GOLD);
    let mut yields = ones;
    yields.acquiescence = Some(AcquiescedPsi);
    let table = [
        (0.0, 0.25, ones, 0.25, None),
        (99.5, 0.25, ones, 99.75, None),
        (99.75, 0.25, ones, 100.0, None),
        (99.9, 0.25, ones, 100.0, None),
        (100.0, 0.25, ones, 100.0, None),
        (50.0, 0.25, not_applicable, 0.0, Some(NotApplicable)),
        (50.0, 0.25, suppressed, 0.0, Some(Suppressed)),
        (50.0, 0.25, reset, 0.0, Some(ResetBy(GOLD))),
        (100.0, 0.25, yields, 0.0, Some(AcquiescedPsi)),
    ];
    for (previous, gain, factors, expected, reason) in table {
        assert_eq!(motivation(previous, gain, &factors, 100.0), expected);
        assert_eq!(factors.zero(), reason);
    }
    // Of several factors that are 0 the first is named.
    let all = Factors {
        activity_suppression: false,
        ..not_applicable
    };
    assert_eq!(all.zero(), Some(NotApplicable));
}

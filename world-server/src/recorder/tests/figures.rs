//! Result figures of run.json.

use super::*;

#[test]
fn figures_of_the_sample() {
    let (run, _) = log(LogLevel::Off, &sample());
    let result = run.result;
    assert_eq!(result.ticks, 3);
    assert_eq!(result.sim_time_ms, SimTime(150));
    assert_eq!(result.items, sample()[2].items);
    assert_eq!(
        result.robots["blue"],
        RobotFigures {
            lives: 1,
            ticks_counted: 3,
            activations: 1,
            items_delivered: 1,
            reports_made: 0,
            messages_sent: 0,
            bytes_sent: 0,
            messages_heard: 1,
            messages_lost: 1,
            messages_delayed: 0,
            messages_duplicate: 0,
        }
    );
    assert_eq!(result.robots["gold"].messages_sent, 2);
    assert_eq!(result.robots["gold"].bytes_sent, 250);
    assert_eq!(result.robots["gold"].reports_made, 1);
    assert_eq!(result.robots["green"].ticks_counted, 0);
}

#[test]
fn lateness_counts_from_the_report_before() {
    let period_ms = 120_000;
    let tick_at = |ms: u64| OwnedTick {
        now: SimTime(ms),
        events: vec![Event::new(EventKind::Reported, Some(BLUE))],
        ..sample()[2].clone()
    };
    let first_ms = period_ms + 3_000;
    let early_ms = first_ms + 60_000;
    let last_ms = early_ms + period_ms + 1_500;
    let ticks = [first_ms, early_ms, last_ms].map(tick_at);
    let result = log(LogLevel::Off, &ticks).0.result;
    assert_eq!(result.reports_made, 3);
    assert_eq!(result.report_lateness_max_ms, Some(3_000));
    assert_eq!(result.report_lateness_mean_ms, Some(1_500.0));
}

#[test]
fn no_reports_no_lateness() {
    let result = log(LogLevel::Off, &sample()[..1]).0.result;
    assert_eq!(
        (
            result.report_lateness_mean_ms,
            result.report_lateness_max_ms
        ),
        (None, None)
    );
}

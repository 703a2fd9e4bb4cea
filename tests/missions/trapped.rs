//! The built-in scenario `thesis-trapped-robot`: the observations of the thesis, §4.3.2, in the log.

use run_log::{EventRow, MotivationRow};
use scenario::time::SimTime;

use crate::story::{METHODICAL, REPORT, Report, Story, WANDER, change, setup};

const NAME: &str = "thesis-trapped-robot";
/// The largest distance between a boxed-in robot and its last position, in m.
const BOX_M: f32 = 0.3;

fn assert_observations(story: &Story) {
    blue_is_boxed_in_while_methodical(story);
    the_search_goes_from_blue_to_gold_to_green(story);
    assert_impatience_rates_change(story);
    gold_and_green_share_the_rest(story);
    assert_reports_are_late_because_no_robot_is_free(story);
}

fn blue_is_boxed_in_while_methodical(story: &Story) {
    let blue = story.poses.iter().filter(|row| row.robot == "blue");
    let end = blue.clone().next_back().unwrap();
    let away = |x_m: f32, y_m: f32| (x_m - end.x_m).hypot(y_m - end.y_m) > BOX_M;
    let last_away = blue.rev().find(|row| away(row.x_m, row.y_m)).unwrap();
    assert_eq!(last_away.behavior_set, METHODICAL);
    // Blue is stuck before gold's takeover.
    assert!(last_away.t_ms < story.changes("find-locations")[1].t_ms);
}

fn the_search_goes_from_blue_to_gold_to_green(story: &Story) {
    let changes = story.changes("find-locations");
    let seen: Vec<_> = changes.iter().map(|row| change(row)).collect();
    let expected = [
        ("blue", METHODICAL, "activated", "threshold"),
        // Gold takes over.
        ("gold", WANDER, "waiting", "threshold"),
        ("blue", METHODICAL, "hibernated", "reset-by gold"),
        ("gold", WANDER, "activated", "wait-over"),
        // Blue waits, because it was active before.
        ("blue", METHODICAL, "waiting", "threshold"),
        // Green takes over. It was not active before, so both others are reset.
        ("green", WANDER, "waiting", "threshold"),
        ("blue", METHODICAL, "hibernated", "reset-by green"),
        ("gold", WANDER, "hibernated", "reset-by green"),
        ("green", WANDER, "activated", "wait-over"),
        // The other two wait at the end, and green finishes.
        ("blue", METHODICAL, "waiting", "threshold"),
        ("gold", WANDER, "waiting", "threshold"),
        ("blue", METHODICAL, "hibernated", "not-applicable"),
        ("gold", WANDER, "hibernated", "not-applicable"),
        ("green", WANDER, "hibernated", "not-applicable"),
    ];
    assert_eq!(seen, expected);

    // Gold was active for less than ψ, so it did not yield to blue.
    let (golds, greens) = (changes[3].t_ms, changes[8].t_ms);
    let active_s = greens.since(golds).as_secs_f64();
    assert!(active_s < story.params("gold", WANDER).before_yielding_s);
    assert_eq!(story.only("position-update").robot, "green");
    assert!(story.only("position-update").t_ms > changes[10].t_ms);
    assert_eq!(story.all("locations-withdrawn").count(), 0);
}

/// Checks that impatience is slow for φ after the first message of each new searcher, and fast afterwards.
fn assert_impatience_rates_change(story: &Story) {
    let changes = story.changes("find-locations");
    let at = |index: usize| changes[index].t_ms;
    assert_rate_change(story, "gold", WANDER, "blue", at(1));
    assert_rate_change(story, "green", WANDER, "blue", at(1).since(story.step()));
    assert_rate_change(story, "blue", METHODICAL, "gold", at(4));
    assert_rate_change(story, "green", WANDER, "gold", at(5));
    assert_rate_change(story, "blue", METHODICAL, "green", at(9));
    assert_rate_change(story, "gold", WANDER, "green", at(10));
}

/// Checks the motivations from the reset by the searcher's first message up to `end`.
#[track_caller]
fn assert_rate_change(story: &Story, robot: &str, set: &str, searcher: &str, end: SimTime) {
    let reset = story.first_received(robot, searcher, "find-locations");
    let params = story.params(robot, set);
    let slow = params.slow_impatience[searcher];
    let phi = SimTime::from_secs_f64(params.willing_to_affect_s[searcher]);
    let mut rows = story.motivations(robot, set);
    rows.retain(|row| reset <= row.t_ms && row.t_ms <= end);
    assert!(!rows[0].impatience_reset && rows[0].motivation == 0.0);
    for pair in rows.windows(2) {
        assert!(pair[0].motivation < pair[1].motivation, "{:?}", pair[1]);
    }
    let (flat, steep): (Vec<&MotivationRow>, Vec<&MotivationRow>) =
        rows.into_iter().partition(|row| row.t_ms < reset + phi);
    assert!(flat.iter().all(|row| row.impatience == slow));
    let fast = params.fast_impatience;
    assert!(steep.iter().all(|row| row.impatience == fast));
    assert!(!steep.is_empty(), "{robot} is interrupted before its phi");
}

fn gold_and_green_share_the_rest(story: &Story) {
    let update = story.only("position-update").t_ms;
    assert_eq!(story.count("delivered", "blue"), 0);
    assert_eq!(story.count("reported", "blue"), 0);
    let activations_of_blue = |row: &&EventRow| row.robot == "blue" && row.t_ms > update;
    assert!(story.all("activated").filter(activations_of_blue).count() > 0);
    let items = story.all("delivered").count();
    for robot in ["gold", "green"] {
        assert!(story.count("delivered", robot) >= items / 4, "{robot}");
        assert!(story.count("reported", robot) > 0, "{robot}");
    }
}

fn assert_reports_are_late_because_no_robot_is_free(story: &Story) {
    // The first report is due before the locations are found.
    let reports = &story.reports()[1..];
    let period = story.report_period();
    assert!(reports.len() >= 3);
    for report in reports {
        assert!(report.lateness().0 > period.0 / 4, "{report:?}");
    }
    // A report had to wait until a robot acquiesced.
    let mut late = reports
        .iter()
        .filter(|report| report.lateness().0 > period.0 / 2);
    assert!(late.any(|report| waited_for_psi(story, report)));
}

/// Returns whether gold and green both moved items at the due time, and the reporter became free only by ψ or λ.
fn waited_for_psi(story: &Story, report: &Report<'_>) -> bool {
    let moves = |robot| {
        let active = story.active(robot, report.due);
        active.is_some_and(|set| set.starts_with("move-spill"))
    };
    let mut own: Vec<&EventRow> = story.events.iter().collect();
    own.retain(|row| row.robot == report.by && row.t_ms <= report.made);
    let begins = own
        .iter()
        .rfind(|row| row.kind == "activated" && row.subject == REPORT);
    let within = report.due..=begins.unwrap().t_ms;
    let mut ends = own;
    ends.retain(|row| row.kind == "hibernated" && row.subject.starts_with("move-spill"));
    ends.retain(|row| within.contains(&row.t_ms));
    let by_time = |row: &&EventRow| ["acquiesced-psi", "gave-up-lambda"].contains(&&*row.reason);
    moves("gold") && moves("green") && !ends.is_empty() && ends.iter().all(by_time)
}

#[test]
fn the_observations_hold_with_many_seeds() {
    for seed in 1..=4 {
        println!("seed {seed}");
        assert_observations(&Story::play(setup(NAME, seed)));
    }
}

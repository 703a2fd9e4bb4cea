//! The definition of a takeover, on rows of events.csv alone. Steps take 50 ms.

use missions::Registry;
use proptest::prelude::*;

use super::*;
use observation::takeovers::Takeover;

const STEP: SimTime = SimTime(50);

fn default_setup() -> Setup {
    testkit::setup(default_scenario())
}

/// Returns rows of a text with time, ms, kind, robot and reason. Changes of behavior sets are about the upper spill. The
/// report of a robot in the tick of its death counts if the reason of `gone` is `counted`.
fn rows(text: &str) -> Vec<EventLine> {
    let lines = text.lines().filter(|line| !line.trim().is_empty());
    let rows = lines.map(|line| {
        let words: Vec<&str> = line.split_whitespace().collect();
        let t_ms: u64 = words[0].parse().unwrap();
        let reason = words.get(3).copied().unwrap_or_default();
        let is_change = ["activated", "hibernated", "waiting"].contains(&words[1]);
        let counted = t_ms / STEP.0 - u64::from(reason != "counted");
        EventLine {
            t_ms: SimTime(t_ms),
            kind: words[1].to_owned(),
            robot: words[2].to_owned(),
            subject: if is_change { TOP } else { "" }.to_owned(),
            reason: reason.to_owned(),
            detail: match words[1] {
                "gone" => format!("incarnation 1; last counted in tick {counted}"),
                _ => String::new(),
            },
        }
    });
    rows.collect()
}

/// Returns the takeovers after losses in rows that arrive tick by tick.
fn live(setup: &Setup, rows: &[EventLine], end: SimTime) -> Vec<LossTakeover> {
    let mut detector = TakeoverDetector::new(setup);
    let mut found = Vec::new();
    let mut rows = rows.iter().peekable();
    let mut now = SimTime::ZERO;
    while now < end {
        while let Some(row) = rows.next_if(|row| row.t_ms <= now) {
            detector.add(row);
        }
        now = now + STEP;
        found.extend(detector.take(now));
    }
    found.extend(detector.finish(end));
    found.sort_by_key(|takeover| takeover.at);
    found
}

/// Compares the takeovers after losses, found live and in the whole log, with the expected lines.
#[track_caller]
fn check(text: &str, expected: &[&str]) {
    let (setup, end) = (default_setup(), SimTime(240_000));
    let rows = rows(text);
    for found in [live(&setup, &rows, end), loss_takeovers(&setup, &rows, end)] {
        let lines: Vec<String> = found.iter().map(LossTakeover::to_string).collect();
        assert_eq!(lines, expected);
    }
}

/// Blue leaves the task at the end of the tick in which gold dies. Gold began later, so it is the predecessor.
#[test]
fn the_tick_of_a_death_belongs_to_the_stint_if_the_report_counted() {
    let log = |counted: &str| {
        format!(
            "
            152100 activated blue
            180050 activated gold
            182050 gone gold {counted}
            182100 hibernated blue gave-up-lambda
            182150 joined gold
            190100 activated green
            220100 hibernated green gave-up-lambda
            "
        )
    };
    let takeover = "190.100 s: green took over move-spill(top) from gold, 8.05 s after its death";
    check(&log("counted"), &[takeover]);
    check(&log("before"), &[]);
}

#[test]
fn a_claim_in_the_tick_of_a_death_is_a_bid() {
    let log = |activated_ms: u64| {
        format!(
            "
            {activated_ms} activated blue
            200050 gone blue counted
            204650 activated gold
            "
        )
    };
    let takeover = "204.650 s: gold took over move-spill(top) from blue, 4.60 s after its death";
    check(&log(200_000), &[takeover]);
    let first = "
        200050 gone blue counted
        200050 activated blue
        204650 activated gold
        ";
    check(first, &[]);
}

#[test]
fn an_activation_in_the_first_tick_of_a_new_process_takes_over() {
    check(
        "
        150050 activated gold
        150050 activated green
        150100 hibernated green outbid
        155050 activated green
        155100 hibernated green outbid
        166000 gone green counted
        167100 gone gold counted
        171050 joined green
        171050 activated green
        ",
        &["171.050 s: green took over move-spill(top) from gold, 3.95 s after its death"],
    );
    check(
        "
        60000 activated blue
        100050 gone blue counted
        103100 gone gold counted
        104100 joined gold
        104100 activated gold
        105100 joined blue
        106000 gone gold counted
        ",
        &["104.100 s: gold took over move-spill(top) from blue, 4.05 s after its death"],
    );
}

#[test]
fn a_robot_that_is_back_takes_over_only_if_it_activates_the_task() {
    check(
        "
        130000 activated green
        143050 stalled blue
        146000 gone green counted
        148050 back blue
        148050 activated blue
        ",
        &["148.050 s: blue took over move-spill(top) from green, 2.05 s after its death"],
    );
    check(
        "
        120000 activated blue
        130000 activated green
        143050 stalled blue
        146000 gone green counted
        148050 back blue
        ",
        &[],
    );
}

/// Gold stops for no tick while it works, and once more in the tick in which it is back.
#[test]
fn a_stop_without_a_missed_tick_ends_no_stint() {
    let rows = rows(
        "
        10000 activated gold
        20000 stalled gold
        20000 back gold
        30000 stalled gold
        31000 back gold
        31000 stalled gold
        40000 activated blue
        ",
    );
    let found = find_all(&default_setup(), &rows, SimTime(50_000));
    let stints = found.stints.iter();
    let spans: Vec<_> = stints
        .map(|stint| (stint.robot, stint.span.from.0, stint.span.to.0))
        .collect();
    assert_eq!(spans, [(GOLD, 10_000, 30_000), (BLUE, 40_000, 50_000)]);
    assert_eq!(found.takeovers[0].idle_since, SimTime(30_000));
}

/// A robot claims the task again in the tick after its death: its first claim is over.
#[test]
fn a_new_process_begins_a_new_stint() {
    let rows = rows(
        "
        10000 activated blue
        20000 gone blue counted
        20050 joined blue
        20050 activated blue
        ",
    );
    let found = find_all(&default_setup(), &rows, SimTime(30_000));
    let spans = found
        .stints
        .iter()
        .map(|stint| (stint.span.from, stint.span.to));
    let expected =
        [(10_000, 20_050), (20_050, 30_000)].map(|(from, to)| (SimTime(from), SimTime(to)));
    assert_eq!(spans.collect::<Vec<_>>(), expected);
    assert_eq!(found.takeovers, []);
}

/// Blue and green claim the dead gold's task in the same tick, and both pick an item. The robot that leaves first yields
/// to the other one.
#[test]
fn a_claim_does_not_count_if_it_yields_to_one_that_it_met() {
    let log = |blue_leaves_ms: u64| {
        format!(
            "
            10000 activated gold
            30000 gone gold
            35000 activated blue
            35000 activated green
            35500 picked blue
            35800 picked green
            {blue_leaves_ms} hibernated blue outbid
            37000 hibernated green arbitration
            "
        )
    };
    let by = |robot| {
        format!("35.000 s: {robot} took over move-spill(top) from gold, 5.00 s after its death")
    };
    check(&log(36_000), &[&by("green")]);
    check(&log(39_000), &[&by("blue")]);
}

/// After gold's death, blue claims the task for 3 s and is outbid by green before it has worked.
#[test]
fn a_claim_without_work_that_ends_by_negotiation_takes_nothing_over() {
    let log = |reason: &str, act: &str| {
        format!(
            "
            10000 activated gold
            30000 gone gold
            34000 activated blue
            {act}
            37000 hibernated blue {reason}
            37050 activated green
            40000 picked green
            60000 hibernated green outbid
            "
        )
    };
    let by = |robot, at, after| {
        format!("{at} s: {robot} took over move-spill(top) from gold, {after} s after its death")
    };
    let green = by("green", "37.050", "7.05");
    let blue = by("blue", "34.000", "4.00");
    for reason in [
        "outbid",
        "claimed",
        "awarded",
        "reassigned",
        "drawn",
        "arbitration",
    ] {
        check(&log(reason, ""), &[&green]);
        check(&log(reason, "36000 picked blue"), &[&blue]);
        // In the tick in which blue leaves, the act is no longer its own.
        check(&log(reason, "37000 picked blue"), &[&green]);
    }
    check(&log("gave-up-lambda", ""), &[&blue]);
    check(&log("lease-ended", ""), &[&blue]);
}

/// Without a fault, blue and gold claim the task in turn. Only a robot that has worked, or gives up, is a predecessor.
#[test]
fn negotiation_without_work_is_no_takeover() {
    let count = |text: &str| {
        let found = find_all(&default_setup(), rows(text), SimTime(240_000));
        found.takeovers.len()
    };
    let in_turn = |act: &str, reason: &str| {
        format!(
            "
            10000 activated blue
            {act}
            14000 hibernated blue {reason}
            14050 activated gold
            20000 delivered gold
            "
        )
    };
    assert_eq!(count(&in_turn("", "outbid")), 0);
    assert_eq!(count(&in_turn("12000 picked blue", "outbid")), 1);
    assert_eq!(count(&in_turn("", "acquiesced-psi")), 1);
    // Blue is still active when gold starts.
    let both = |act: &str| {
        format!(
            "
            10000 activated blue
            14000 activated gold
            20000 delivered gold
            {act}
            30000 hibernated blue not-applicable
            "
        )
    };
    assert_eq!(count(&both("")), 1);
    assert_eq!(count(&both("25000 picked blue")), 0);
}

#[test]
fn claims_of_the_last_tick_are_bids() {
    for (at_ms, count) in [(239_900, 1), (239_950, 0)] {
        let rows = rows(&format!(
            "
            10000 activated gold
            30000 gone gold
            {at_ms} activated blue
            "
        ));
        let found = live(&default_setup(), &rows, SimTime(240_000));
        assert_eq!(found.len(), count, "{found:?}");
    }
}

/// The takeovers of runs with random kills and pauses, in which killed robots start again.
#[test]
fn events_of_live_runs_and_reports_show_the_same_takeovers() {
    let vocabulary = Registry::built_in().vocabulary();
    let mut count = 0;
    for seed in 0..12_u64 {
        let allocators = ["alliance", "cbba", "first-come", "random", "murdoch", "ble"];
        let allocator = allocators[seed as usize % 6];
        let text = vocabulary.builtin("l-alliance-abstract").unwrap().text;
        let mut scenario = testkit::scenario(&format!("{text}\n{}", random_faults(seed)));
        scenario.allocator = Some(allocator.to_owned());
        scenario.limit_s = 250.0;
        let log = testkit::run(Setup::resolve(scenario, seed, None).unwrap().setup);
        let setup = &log.run.setup;
        let history = History::read(&log).unwrap();
        let metrics = Metrics::compute(&history, &log.run);
        let lost = metrics.takeovers.iter();
        let lost = lost.filter(|takeover| takeover.cause.is_loss());
        let expected: Vec<_> = lost.map(|takeover| parts(&history, takeover)).collect();
        let events: Vec<EventLine> = log.each_row().map(|row| event_line(row.unwrap())).collect();
        for found in [
            live(setup, &events, history.end),
            loss_takeovers(setup, &events, history.end),
        ] {
            let found = found.into_iter();
            let found: Vec<_> = found
                .map(|each| (each.at, each.robot, each.task, each.from, each.after))
                .collect();
            assert_eq!(found, expected, "seed {seed}, {allocator}");
        }
        // The rows of motivations and the events state the same times.
        for (rank, robot) in history.robots.iter().enumerate() {
            let stints = metrics.stints.iter().filter(|stint| stint.robot == rank);
            let worked: Spans = stints.map(|stint| stint.span).collect();
            assert_eq!(worked, robot.active(), "seed {seed}, {}", robot.name);
        }
        count += expected.len();
    }
    assert!(count >= 10, "{count} takeovers");
}

fn random_faults(seed: u64) -> String {
    use rand::{RngExt, SeedableRng};
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut text = String::new();
    for _ in 0..6 {
        let robot = random.random_range(1..=4);
        let kind = ["kill", "kill", "pause"][random.random_range(0..3)];
        let at_s = 20.0 + 0.05 * f64::from(random.random_range(0..4400));
        let for_s = [0.05, 0.1, 1.0, 5.0, 5.05, 10.0, 20.0][random.random_range(0..7)];
        text += &format!(
            "[[faults.timeline]]\nfault.{kind} = 'r{robot}'\nat_s = {at_s:.2}\nfor_s = {for_s}\n"
        );
    }
    text
}

fn parts(history: &History, takeover: &Takeover) -> (SimTime, String, String, String, SimTime) {
    let name = |rank: usize| history.robots[rank].name.clone();
    let task = history.catalog.task_name(takeover.task).to_owned();
    let (by, from) = (name(takeover.robot), name(takeover.from));
    (takeover.at, by, task, from, takeover.latency())
}

proptest! {
    /// For any order of claims, deaths, stops and returns, the rows of each tick show live what all rows show at the end.
    #[test]
    fn any_rows_show_the_same_takeovers_tick_by_tick(
        actions in prop::collection::vec((0_u64..4, 0..3_usize, 0..11_usize), 1..60),
    ) {
        let setup = default_setup();
        let (mut at_ms, mut text) = (STEP.0, String::new());
        for (ticks, robot, action) in actions {
            at_ms += STEP.0 * ticks;
            let robot = ["blue", "gold", "green"][robot];
            let row = [
                "activated", "hibernated arbitration", "hibernated done", "gone counted", "gone", "stalled", "back",
                "picked", "delivered", "hibernated outbid", "waiting arbitration",
            ][action];
            let (kind, reason) = row.split_once(' ').unwrap_or((row, ""));
            text += &format!("{at_ms} {kind} {robot} {reason}\n");
        }
        let rows = rows(&text);
        let end = SimTime(at_ms) + STEP;
        let mut at_once = TakeoverDetector::new(&setup);
        rows.iter().for_each(|row| at_once.add(row));
        let expected = at_once.finish(end);
        prop_assert_eq!(&live(&setup, &rows, end), &expected);
        prop_assert_eq!(&loss_takeovers(&setup, &rows, end), &expected);
    }
}

//! The built-in scenario `thesis-no-interruption`: the observations of the thesis, §4.3.1, in the log.

use std::collections::BTreeSet;

use alliance_tests::testkit::ROBOTS;
use scenario::{SwitchSection, Switches};

use crate::story::{BOTTOM, Change, METHODICAL, REPORT, Story, TOP, WANDER, change, setup};

const NAME: &str = "thesis-no-interruption";

/// The first four changes of the upper spill: green's request stops gold, and then green does another task.
const EARLY_INTERRUPTION: [Change<'_>; 4] = [
    ("gold", TOP, "activated", "threshold"),
    ("green", TOP, "waiting", "threshold"),
    ("gold", TOP, "hibernated", "reset-by green"),
    ("green", TOP, "hibernated", "suppressed"),
];

fn assert_observations(story: &Story) {
    assert_blue_searches_and_its_wander_stays_at_zero(story);
    assert_find_sets_stay_at_zero_and_the_others_rise(story);
    assert_the_robots_alternate(story);
    assert_blue_is_reset_three_times(story);
    assert_green_interrupts_gold_and_then_does_another_task(story);
    assert_the_later_of_two_robots_waits_until_the_first_acquiesces(story);
}

fn assert_blue_searches_and_its_wander_stays_at_zero(story: &Story) {
    let first = story.all("activated").next().unwrap();
    assert_eq!((&*first.robot, &*first.subject), ("blue", METHODICAL));
    let wander = story.motivations("blue", WANDER);
    let (before, after): (Vec<_>, Vec<_>) =
        wander.into_iter().partition(|row| row.t_ms <= first.t_ms);
    let rises = before.last().unwrap().motivation > 0.0;
    assert!(rises, "the motivation must rise at first");
    assert!(after.iter().all(|row| row.motivation == 0.0));

    let update = story.only("position-update");
    assert_eq!(update.robot, "blue");
    let searching = after.iter().filter(|row| row.t_ms <= update.t_ms);
    assert!(searching.clone().count() > 100);
    assert!(searching.clone().all(|row| !row.activity_suppression));
    let changes = story.changes("find-locations");
    assert!(changes.iter().all(|row| row.subject == METHODICAL));
}

fn assert_find_sets_stay_at_zero_and_the_others_rise(story: &Story) {
    let update = story.only("position-update").t_ms;
    let after = |robot, set| {
        let rows = story.motivations(robot, set).into_iter();
        rows.filter(|row| row.t_ms > update).collect::<Vec<_>>()
    };
    for robot in ROBOTS {
        let methodical = after(robot, METHODICAL);
        assert_eq!(methodical.is_empty(), robot != "blue");
        for row in methodical.into_iter().chain(after(robot, WANDER)) {
            assert!(row.motivation == 0.0 && !row.sensory_feedback, "{row:?}");
        }
        for set in [TOP, BOTTOM, REPORT] {
            let mut last = 0.0;
            for row in &after(robot, set)[..20] {
                assert!(row.motivation > last, "{row:?}");
                last = row.motivation;
            }
        }
    }
}

fn assert_the_robots_alternate(story: &Story) {
    for robot in ROBOTS {
        assert!(story.count("delivered", robot) > 0, "{robot} moves waste");
        assert!(story.count("reported", robot) > 0, "{robot} reports");
    }
    for spill in [TOP, BOTTOM] {
        let begun = story.all("activated").filter(|row| row.subject == spill);
        let workers: BTreeSet<_> = begun.map(|row| &row.robot).collect();
        assert!(workers.len() >= 2, "{spill}: {workers:?}");
    }
}

fn assert_blue_is_reset_three_times(story: &Story) {
    let rows = story.motivations("blue", TOP);
    let pairs = rows.windows(2);
    let falls = pairs.filter(|pair| pair[0].motivation > 0.0 && pair[1].motivation == 0.0);
    let falls = falls.map(|pair| pair[1]).take(3);
    // The time and the factor of each reset. Suppression takes effect in the step after the activation.
    let seen = falls.map(|row| (row.t_ms, row.activity_suppression, row.impatience_reset));
    let own_activation = |set| story.first_activation("blue", set) + story.step();
    let golds = story.first_activation("gold", TOP);
    let received = story.first_received("blue", "gold", TOP);
    // Blue is the first in a step.
    assert_eq!(received, golds + story.step());
    let expected = [
        (own_activation(REPORT), false, true),
        (received, true, false),
        (own_activation(BOTTOM), false, true),
    ];
    assert_eq!(seen.collect::<Vec<_>>(), expected);
}

fn assert_green_interrupts_gold_and_then_does_another_task(story: &Story) {
    let [begins, wishes, stops, leaves] = story.changes(TOP)[..4] else {
        panic!("too few state changes");
    };
    let changes = [begins, wishes, stops, leaves].map(change);
    assert_eq!(changes, EARLY_INTERRUPTION);

    let params = story.params("gold", TOP);
    let active_s = stops.t_ms.since(begins.t_ms).as_secs_f64();
    assert!(active_s < params.before_yielding_s && active_s < params.before_giving_up_s);
    assert_eq!(story.first_received("gold", "green", TOP), stops.t_ms);
    assert_eq!(stops.t_ms, wishes.t_ms + story.step());

    // Green reaches the threshold with both behavior sets, and activates the other one in that step.
    assert_eq!(story.first_activation("green", REPORT), wishes.t_ms);
    for set in [TOP, REPORT] {
        let at = |time| story.motivation("green", set, time);
        assert_eq!(at(wishes.t_ms), story.threshold());
        assert!(at(wishes.t_ms.since(story.step())) < story.threshold());
    }
    assert_eq!(leaves.t_ms, wishes.t_ms + story.step());
    assert_eq!(story.motivation("green", TOP, leaves.t_ms), 0.0);
    assert_eq!(story.active("green", leaves.t_ms), Some(REPORT));
}

/// Checks the next four changes of the upper spill.
fn assert_the_later_of_two_robots_waits_until_the_first_acquiesces(story: &Story) {
    let [begins, waits, yields, follows] = story.changes(TOP)[4..8] else {
        panic!("too few state changes");
    };
    let (first, later) = (&*begins.robot, &*waits.robot);
    assert_ne!(first, later);
    assert_eq!(change(begins), (first, TOP, "activated", "threshold"));
    assert_eq!(change(waits), (later, TOP, "waiting", "threshold"));
    assert_eq!(change(yields), (first, TOP, "hibernated", "acquiesced-psi"));
    assert_eq!(change(follows), (later, TOP, "activated", "wait-over"));
    assert!(follows.t_ms <= yields.t_ms + story.step());
    for robot in [first, later] {
        let rows = story.motivations(robot, TOP).into_iter();
        let mut both = rows.filter(|row| waits.t_ms <= row.t_ms && row.t_ms < yields.t_ms);
        assert!(both.all(|row| row.motivation == story.threshold()));
    }
}

#[test]
fn the_observations_hold_with_many_seeds() {
    for seed in 1..=4 {
        println!("seed {seed}");
        assert_observations(&Story::play(setup(NAME, seed)));
    }
}

#[test]
fn the_early_interruption_needs_each_of_its_switches() {
    let interrupts_early = |turn_off: fn(&mut Switches)| {
        let mut setup = setup(NAME, 1);
        turn_off(&mut setup.alliance.switches);
        let stated = SwitchSection::from_switches(setup.alliance.switches, setup.step_order);
        setup.scenario.alliance.switches = stated;
        let story = Story::play(setup);
        let changes = story.changes(TOP);
        let changes = changes.iter().take(4).map(|row| change(row));
        changes.eq(EARLY_INTERRUPTION)
    };
    assert!(interrupts_early(|_| ()));
    let turn_off: [fn(&mut Switches); 4] = [
        |switches| switches.waiting = false,
        |switches| switches.waiting_counts = false,
        |switches| switches.wish_when_suppressed = false,
        |switches| switches.reset_stops_active = false,
    ];
    assert!(!turn_off.into_iter().any(interrupts_early));
}

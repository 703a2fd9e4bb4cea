//! The built-in scenario `thesis-no-interruption`: each observation of the thesis' §4.3.1, seen in the log.

use std::collections::BTreeSet;

use alliance_proto::log::MotivationRow;
use alliance_proto::scenario::{SwitchSection, Switches};

use crate::harness::Lab;
use crate::story::{BOTTOM, Change, METHODICAL, REPORT, ROBOTS, Story, TOP, WANDER, change, setup};

const NAME: &str = "thesis-no-interruption";

/// The first four things that happen about the upper spill: green's wish stops gold, and then green does something else.
const CURIOSITY: [Change<'_>; 4] = [
    ("gold", TOP, "activated", "threshold"),
    ("green", TOP, "waiting", "threshold"),
    ("gold", TOP, "hibernated", "reset-by green"),
    ("green", TOP, "hibernated", "suppressed"),
];

fn assert_observations(story: &Story) {
    blue_searches_and_its_wander_stays_at_zero(story);
    after_the_update_the_find_sets_are_at_zero_and_the_others_rise(story);
    the_robots_take_turns(story);
    blue_is_reset_three_times(story);
    gold_is_interrupted_by_green_which_then_does_something_else(story);
    of_two_at_the_threshold_the_later_waits_until_the_first_acquiesces(story);
}

fn blue_searches_and_its_wander_stays_at_zero(story: &Story) {
    let first = story.all("activated").next().unwrap();
    assert_eq!((&*first.robot, &*first.subject), ("blue", METHODICAL));
    let wander = story.motivations("blue", WANDER);
    let (before, after): (Vec<_>, Vec<_>) =
        wander.into_iter().partition(|row| row.t_ms <= first.t_ms);
    assert!(before.last().unwrap().motivation > 0.0, "it rises at first");
    assert!(after.iter().all(|row| row.motivation == 0.0));

    let update = story.only("position-update");
    assert_eq!(update.robot, "blue");
    let searching = after.iter().filter(|row| row.t_ms <= update.t_ms);
    assert!(searching.clone().count() > 100);
    assert!(searching.clone().all(|row| !row.activity_suppression));
    let changes = story.changes("find-locations");
    assert!(changes.iter().all(|row| row.subject == METHODICAL));
}

fn after_the_update_the_find_sets_are_at_zero_and_the_others_rise(story: &Story) {
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

fn the_robots_take_turns(story: &Story) {
    for robot in ROBOTS {
        assert!(story.count("delivered", robot) > 0, "{robot} moves waste");
        assert!(story.count("reported", robot) > 0, "{robot} reports");
    }
    for spill in [TOP, BOTTOM] {
        let workers: BTreeSet<_> = story
            .all("activated")
            .filter(|row| row.subject == spill)
            .map(|row| &row.robot)
            .collect();
        assert!(workers.len() >= 2, "{spill}: {workers:?}");
    }
}

fn blue_is_reset_three_times(story: &Story) {
    let rows = story.motivations("blue", TOP);
    let falls: Vec<&MotivationRow> = rows
        .windows(2)
        .filter(|pair| pair[0].motivation > 0.0 && pair[1].motivation == 0.0)
        .map(|pair| pair[1])
        .take(3)
        .collect();
    // When, and by which factor. What a set suppresses falls in the step after the set's activation.
    let seen = falls
        .iter()
        .map(|row| (row.t_ms, row.activity_suppression, row.impatience_reset));
    let own = |set| story.first_activation("blue", set) + story.step();
    let golds = story.first_activation("gold", TOP);
    let heard = story.first_heard("blue", "gold", TOP);
    assert_eq!(heard, golds + story.step(), "blue is the first in a step");
    let expected = [
        (own(REPORT), false, true),
        (heard, true, false),
        (own(BOTTOM), false, true),
    ];
    assert_eq!(seen.collect::<Vec<_>>(), expected);
}

fn gold_is_interrupted_by_green_which_then_does_something_else(story: &Story) {
    let [begins, wishes, stops, leaves] = story.changes(TOP)[..4] else {
        panic!("too little happens");
    };
    assert_eq!([begins, wishes, stops, leaves].map(change), CURIOSITY);

    let params = story.params("gold", TOP);
    let active_s = stops.t_ms.since(begins.t_ms).as_secs_f64();
    assert!(active_s < params.before_yielding_s && active_s < params.before_giving_up_s);
    assert_eq!(story.first_heard("gold", "green", TOP), stops.t_ms);
    assert_eq!(stops.t_ms, wishes.t_ms + story.step());

    // Green comes to the threshold with both, and in that very step does the other one.
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

/// The next four things that happen there.
fn of_two_at_the_threshold_the_later_waits_until_the_first_acquiesces(story: &Story) {
    let [begins, waits, yields, follows] = story.changes(TOP)[4..8] else {
        panic!("too little happens");
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
fn without_interruption_on_many_seeds() {
    for seed in 1..=8 {
        println!("seed {seed}");
        assert_observations(&Story::play(setup(NAME, seed)));
    }
}

/// It takes all four of the thesis' switches that concern it.
#[test]
fn the_curiosity_is_gone_without_any_one_of_its_switches() {
    let curious = |turn_off: fn(&mut Switches)| {
        let mut setup = setup(NAME, 1);
        turn_off(&mut setup.alliance.switches);
        let stated = SwitchSection::stating(setup.alliance.switches, setup.step_order);
        setup.scenario.alliance.switches = stated;
        let story = Story::play(setup);
        let changes = story.changes(TOP);
        changes.iter().take(4).map(|row| change(row)).eq(CURIOSITY)
    };
    assert!(curious(|_| ()));
    assert!(!curious(|switches| switches.waiting = false));
    assert!(!curious(|switches| switches.waiting_counts = false));
    assert!(!curious(|switches| switches.wish_when_suppressed = false));
    assert!(!curious(|switches| switches.reset_stops_active = false));
}

#[test]
fn without_interruption_by_processes() {
    let lab = Lab::new();
    lab.mission("run", &[NAME]).expect(0);
    assert_observations(&Story::read(lab.log("run")));
}

//! The built-in scenario `parker-specialised`: each robot keeps its task, and two robots do all three tasks after a
//! crash.

use std::collections::{BTreeMap, BTreeSet};

use alliance_tests::harness::Lab;
use alliance_tests::team::Team;

use crate::story::{BOTTOM, REPORT, Story, TOP, setup};

const NAME: &str = "parker-specialised";

/// Checks that two robots keep one spill each to the end, and that the third only reports.
fn assert_specialized(story: &Story) {
    let update = story.only("position-update").t_ms;
    let mut kept: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for row in story.all("activated").filter(|row| row.t_ms > update) {
        kept.entry(&row.robot).or_default().insert(&row.subject);
    }
    let expected = [("blue", TOP), ("gold", BOTTOM), ("green", REPORT)];
    let expected = expected.map(|(robot, set)| (robot, BTreeSet::from([set])));
    assert_eq!(kept, BTreeMap::from(expected));

    assert_eq!(story.count("delivered", "blue"), 12);
    assert_eq!(story.count("delivered", "gold"), 12);
    let reports = story.reports();
    assert!(reports.len() >= 4, "{reports:?}");
    assert!(reports.iter().all(|report| report.by == "green"));
    // No robot is displaced: a mover stops after its own lambda and continues.
    let mut stops = story.all("hibernated").filter(|row| row.t_ms > update);
    assert!(stops.all(|row| row.reason == "gave-up-lambda" || row.reason == "not-applicable"));
}

#[test]
fn each_robot_keeps_its_task_with_many_seeds() {
    for seed in 1..=4 {
        println!("seed {seed}");
        assert_specialized(&Story::play(setup(NAME, seed)));
    }
}

/// Kills the lower mover after half of the items: green takes over its task.
#[test]
fn two_robots_do_three_tasks_after_a_kill() {
    let (victim, orphan) = ("gold", BOTTOM);
    let lab = Lab::new();
    let mut team = Team::start(&lab, [NAME, "--speed", "60x"]);
    team.wait_for_row("mission.csv", &[",12,"]);
    team.kill(victim);
    team.wait().expect(0);
    let story = Story::read(lab.log("run"));

    let crash = story.only("gone");
    assert_eq!(crash.robot, victim);
    assert_eq!(story.active(victim, crash.t_ms), Some(orphan));
    assert_eq!(story.all("delivered").count(), 24);

    let mut after = story.events.iter().filter(|row| row.t_ms > crash.t_ms);
    assert!(after.clone().all(|row| row.robot != victim));
    assert!(after.any(|row| row.kind == "reported"));
    let begun = || story.all("activated").filter(|row| row.t_ms > crash.t_ms);
    let taker = begun().find(|row| row.subject == orphan);
    assert_eq!(taker.unwrap().robot, "green");
    let activated: BTreeSet<&str> = begun().map(|row| &*row.subject).collect();
    assert_eq!(activated, BTreeSet::from([BOTTOM, TOP, REPORT]));
}

//! The built-in scenario `parker-specialised`: each robot keeps one task, and two do the work of three when one has died.

use std::collections::{BTreeMap, BTreeSet};

use crate::harness::Lab;
use crate::story::{BOTTOM, REPORT, Story, TOP, setup};
use crate::team::Team;

const NAME: &str = "parker-specialised";

/// Two robots keep one spill each, to the end, and the third only reports.
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
    // Nobody was driven off: a mover stops when its own lambda has passed, and goes on.
    let mut stops = story.all("hibernated").filter(|row| row.t_ms > update);
    assert!(stops.all(|row| row.reason == "gave-up-lambda" || row.reason == "not-applicable"));
}

#[test]
fn each_robot_keeps_its_task_on_many_seeds() {
    for seed in 1..=8 {
        println!("seed {seed}");
        assert_specialized(&Story::play(setup(NAME, seed)));
    }
}

#[test]
fn each_robot_keeps_its_task_by_processes() {
    let lab = Lab::new();
    lab.mission("run", &[NAME]).expect(0);
    assert_specialized(&Story::read(lab.log("run")));
}

/// Kills a mover with half of the items out of the spills.
fn kill_half_way(victim: &str, orphan: &str) {
    let lab = Lab::new();
    let mut team = Team::start(&lab, &[NAME, "--speed", "60x"]);
    team.wait_for_row("mission.csv", &[",12,"]);
    team.kill(victim);
    team.wait().expect(0);
    let story = Story::read(lab.log("run"));

    let death = story.only("gone");
    assert_eq!(death.robot, victim);
    assert_eq!(story.active(victim, death.t_ms), Some(orphan));
    assert_eq!(story.all("delivered").count(), 24);

    let done: Vec<_> = story
        .events
        .iter()
        .filter(|row| row.t_ms > death.t_ms)
        .collect();
    assert!(done.iter().all(|row| row.robot != victim));
    let mut takers = done
        .iter()
        .filter(|row| row.kind == "activated" && row.subject == orphan);
    assert_eq!(takers.next().unwrap().robot, "green");
    let activated: BTreeSet<&str> = done
        .iter()
        .filter(|row| row.kind == "activated")
        .map(|row| &*row.subject)
        .collect();
    assert_eq!(activated, BTreeSet::from([BOTTOM, TOP, REPORT]));
    assert!(done.iter().any(|row| row.kind == "reported"));
}

#[test]
fn two_do_three_tasks_when_the_mover_of_the_lower_spill_is_killed() {
    kill_half_way("gold", BOTTOM);
}

#[test]
fn two_do_three_tasks_when_the_mover_of_the_upper_spill_is_killed() {
    kill_half_way("blue", TOP);
}

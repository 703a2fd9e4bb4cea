//! The waste mission in any size: room, team and work grow together.

use std::collections::{BTreeMap, BTreeSet};

use alliance_tests::harness::Lab;
use alliance_tests::runs::play;
use glam::Vec2;
use missions::waste::data::{WasteSection, family};
use proto::tick::Outcome;
use run_log::{EventRow, PoseRow};

#[test]
fn a_mission_name_without_sizes_means_three_robots() {
    let lab = Lab::new();
    let run = |out: &str, arguments: &[&str]| {
        let limit = ["--limit", "20", "--in-process"];
        lab.mission(out, &[arguments, &limit].concat()).expect(1);
    };
    run("alone", &["service"]);
    run("sized", &["service", "--robots", "3", "--points", "2"]);
    lab.assert_same_bytes("alone", "sized");
}

/// Each robot does only its own tasks, and carries items only to nearby deposits.
#[test]
fn thirty_robots_carry_the_items_of_twenty_spills_to_nearby_deposits() {
    let (outcome, log) = play(family(30, 20), 1);
    assert_eq!(outcome, Outcome::Complete);
    let scenario = &log.run.setup.scenario;
    let tasks = |name: &str| {
        let mut robots = scenario.robots.iter();
        &robots.find(|robot| robot.name == name).unwrap().tasks
    };
    let events = log.rows::<EventRow>().unwrap();
    let mut movers = BTreeSet::new();
    for row in events.iter().filter(|row| row.kind == "activated") {
        assert!(tasks(&row.robot).contains(&row.detail), "{row:?}");
        movers.insert(row.robot.clone());
    }
    assert!(movers.len() >= 20, "{movers:?}");
    let deposits: Vec<Vec2> = WasteSection::of(scenario)
        .deposits()
        .map(|deposit| deposit.in_room(&scenario.room))
        .collect();
    let places: BTreeMap<_, Vec2> = log
        .rows::<PoseRow>()
        .unwrap()
        .into_iter()
        .map(|row| ((row.t_ms, row.robot), Vec2::new(row.x_m, row.y_m)))
        .collect();
    let mut used = BTreeMap::new();
    for row in events.iter().filter(|row| row.kind == "delivered") {
        let at = places[&(row.t_ms, row.robot.clone())];
        let near = (0..deposits.len()).min_by(|&a, &b| {
            let distance = |deposit: usize| deposits[deposit].distance(at);
            distance(a).total_cmp(&distance(b))
        });
        *used.entry(near).or_insert(0) += 1;
    }
    assert_eq!(used.values().sum::<u32>(), 20 * 12);
    assert!(used.len() >= 8, "{used:?}");
}

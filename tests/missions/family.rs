//! The waste mission in any size: room, team and work grow together.

use std::collections::{BTreeMap, BTreeSet};

use alliance_tests::harness::Lab;
use alliance_tests::runs::{Events, play};
use glam::Vec2;
use missions::waste::data::{WasteSection, family};
use proto::tick::Outcome;
use run_log::PoseRow;

#[test]
fn a_mission_name_without_sizes_means_three_robots() {
    let lab = Lab::new();
    let limit = "--limit 20 --in-process";
    lab.mission("alone", format!("service {limit}")).expect(1);
    let sized = format!("service --robots 3 --points 2 {limit}");
    lab.mission("sized", sized).expect(1);
    lab.assert_same_bytes("alone", "sized");
}

/// Each robot does only its own tasks, and carries items only to nearby deposits.
#[test]
fn thirty_robots_carry_the_items_of_twenty_spills_to_nearby_deposits() {
    let (outcome, log) = play(family(30, 20), 1);
    assert_eq!(outcome, Outcome::Complete);
    let scenario = &log.run.setup.scenario;
    let mut movers = BTreeSet::new();
    for row in log.events("activated") {
        let mut robots = scenario.robots.iter();
        let robot = robots.find(|robot| robot.name == row.robot).unwrap();
        assert!(robot.tasks.contains(&row.detail), "{row:?}");
        movers.insert(row.robot);
    }
    assert!(movers.len() >= 20, "{movers:?}");
    let deposits = WasteSection::of(scenario).deposits();
    let deposits: Vec<Vec2> = deposits
        .map(|deposit| deposit.in_room(&scenario.room))
        .collect();
    let poses = log.rows::<PoseRow>().unwrap().into_iter();
    let places: BTreeMap<_, Vec2> = poses
        .map(|row| ((row.t_ms, row.robot), Vec2::new(row.x_m, row.y_m)))
        .collect();
    let mut used = BTreeMap::new();
    for row in log.events("delivered") {
        let at = places[&(row.t_ms, row.robot)];
        let distance = |deposit: &usize| deposits[*deposit].distance(at);
        let near = (0..deposits.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        *used.entry(near).or_insert(0) += 1;
    }
    assert_eq!(used.values().sum::<u32>(), 20 * 12);
    assert!(used.len() >= 8, "{used:?}");
}

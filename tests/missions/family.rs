//! The waste mission in any size: room, team and work grow together. Tasks and radios have a limited reach, and the
//! team survives crashes.

use missions::waste::data::{WasteSection, family};
use std::collections::{BTreeMap, BTreeSet};

use analysis::invariants::Invariants;
use glam::Vec2;
use in_process::Team;
use missions::waste::data::WasteRow;
use proto::tick::Outcome;
use run_log::{EventRow, LogLevel, MessageRow, PoseRow};
use scenario::Setup;
use scenario::fault::{Fault, Order};
use scenario::time::SimTime;

use crate::harness::Lab;
use crate::in_process::run;
use crate::recompute::log_of;

#[test]
fn three_robots_and_two_spills_give_the_default_mission() {
    let lab = Lab::new();
    let limit = ["--limit", "20", "--in-process"];
    let sized = ["--robots", "3", "--spills", "2"];
    lab.mission("default", &limit).expect(1);
    lab.mission("sized", &[&sized[..], &limit].concat())
        .expect(1);
    lab.assert_same_bytes("default", "sized");
}

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

/// The world decides on radio range, so processes and one process agree.
#[test]
fn a_team_with_radio_range_writes_the_same_bytes_by_processes_and_in_one_process() {
    let lab = Lab::new();
    let sized = ["--robots", "22", "--spills", "15", "--limit", "30"];
    lab.mission("processes", &sized).expect(1);
    lab.mission("one", &[&sized[..], &["--in-process"]].concat())
        .expect(1);
    lab.assert_same_bytes("processes", "one");

    // No message crosses more than the radio range, and many pairs of robots communicate.
    let log = lab.log("one");
    let range_m = log.run.setup.scenario.radio.range_m.unwrap();
    let mut places = BTreeMap::new();
    for row in log.rows::<PoseRow>().unwrap() {
        places.insert((row.t_ms, row.robot.clone()), Vec2::new(row.x_m, row.y_m));
    }
    let at = |t_ms: SimTime, robot: &str| places[&(t_ms, robot.to_owned())];
    let (mut received, mut pairs) = (0, BTreeSet::new());
    for row in log.rows::<MessageRow>().unwrap() {
        let apart_m = at(row.sent_ms, &row.sender).distance(at(row.sent_ms, &row.receiver));
        assert!(apart_m <= range_m, "{row:?}: {apart_m} m");
        received += 1;
        pairs.insert((row.sender, row.receiver));
    }
    assert!(received > 22 * 15, "{received}");
    assert!(
        pairs.len() < 22 * 21,
        "all robots are in range of each other"
    );
}

#[test]
fn thirty_robots_carry_the_items_of_twenty_spills_to_nearby_deposits() {
    let setup = sized(30, 20);
    let items = 20 * 12;
    let (outcome, recorder) = run(setup.clone(), LogLevel::Full);
    assert_eq!(outcome, Outcome::Complete);
    let log = log_of(recorder);
    for row in log.rows::<WasteRow>().unwrap() {
        let all =
            row.items_in_spills + row.items_carried + row.items_on_floor + row.items_delivered;
        assert_eq!(all, items, "at {} ms", row.t_ms);
    }
    // Each robot activates only behavior sets of its own tasks.
    let tasks = |name: &str| {
        let mut robots = setup.scenario.robots.iter();
        &robots.find(|robot| robot.name == name).unwrap().tasks
    };
    let events = log.rows::<EventRow>().unwrap();
    let mut movers = BTreeSet::new();
    for row in events.iter().filter(|row| row.kind == "activated") {
        assert!(tasks(&row.robot).contains(&row.detail), "{row:?}");
        movers.insert(row.robot.clone());
    }
    assert!(movers.len() >= 20, "{movers:?}");
    // Many deposits are used, because robots do not carry items across the room.
    let room = setup.scenario.room;
    let deposits: Vec<Vec2> = WasteSection::of(&setup.scenario)
        .deposits()
        .map(|deposit| deposit.in_room(&room))
        .collect();
    let places: BTreeMap<(SimTime, String), Vec2> = log
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
    assert_eq!(used.values().sum::<u32>(), items);
    assert!(used.len() >= 8, "{used:?}");
}

/// Checks the invariants in every tick: items, solids, one active set, and exclusive tasks among robots in radio
/// range.
#[test]
fn a_large_team_survives_crashes_without_an_invariant_violation() {
    let mut scenario = family(24, 16);
    let victims = ["r1", "r5", "r9", "r17"];
    scenario.faults.timeline = (1..)
        .zip(victims)
        .map(|(number, robot)| Order {
            at_s: Some(30.0 * f64::from(number)),
            ..Order::now(Fault::Kill(robot.to_owned()))
        })
        .collect();
    let setup = Setup::resolve(scenario, 3, None).unwrap().setup;
    let mut invariants = Invariants::new(&setup);
    let mut team = Team::new(setup, LogLevel::Full, run_log::MemoryLog::default()).unwrap();
    let outcome = loop {
        let outcome = team.tick().unwrap();
        invariants.check_simulation(team.simulation()).unwrap();
        if let Some(outcome) = outcome {
            break outcome;
        }
    };
    assert_eq!(outcome, Outcome::Complete);
    let (_, recorder) = team.end(outcome).unwrap();
    let log = log_of(recorder);
    let gone: BTreeSet<String> = log
        .rows::<EventRow>()
        .unwrap()
        .into_iter()
        .filter(|row| row.kind == "gone")
        .map(|row| row.robot)
        .collect();
    assert_eq!(gone, BTreeSet::from(victims.map(str::to_owned)));
}

fn sized(robots: usize, spills: usize) -> Setup {
    let scenario = family(robots, spills);
    Setup::resolve(scenario, 1, None).unwrap().setup
}

//! The waste clean-up in any size (issue "One process, thousands of runs", item 5): room, team and work grow together, tasks
//! and radios reach no farther than they have to, and a death is still coped with.

use missions::waste::data::{WasteSection, family};
use std::collections::{BTreeMap, BTreeSet};

use alliance_proto::fault::{Fault, Order};
use alliance_proto::log::{EventRow, LogLevel, MessageRow, PoseRow};
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;
use glam::Vec2;
use in_process::Team;
use missions::waste::data::WasteRow;
use study::invariants::Invariants;

use crate::harness::Lab;
use crate::in_process::run;
use crate::recompute::log_of;

#[test]
fn with_three_robots_and_two_spills_it_is_the_default_mission() {
    let lab = Lab::new();
    let limit = ["--limit", "20", "--in-process"];
    let sized = ["--robots", "3", "--spills", "2"];
    lab.mission("default", &limit).expect(1);
    lab.mission("sized", &[&sized[..], &limit].concat())
        .expect(1);
    lab.assert_same_bytes("default", "sized");
}

#[test]
fn the_name_of_a_mission_alone_is_that_of_three_robots() {
    let lab = Lab::new();
    let run = |out: &str, arguments: &[&str]| {
        let limit = ["--limit", "20", "--in-process"];
        lab.mission(out, &[arguments, &limit].concat()).expect(1);
    };
    run("alone", &["service"]);
    run("sized", &["service", "--robots", "3", "--points", "2"]);
    lab.assert_same_bytes("alone", "sized");
}

/// By processes as well as in one: what decides who hears whom is the world.
#[test]
fn a_team_with_radios_of_a_range_writes_the_same_bytes_by_processes_and_in_one() {
    let lab = Lab::new();
    let sized = ["--robots", "22", "--spills", "15", "--limit", "30"];
    lab.mission("processes", &sized).expect(1);
    lab.mission("one", &[&sized[..], &["--in-process"]].concat())
        .expect(1);
    lab.assert_same_bytes("processes", "one");

    // Nobody heard anybody who was farther away, and many heard each other.
    let log = lab.log("one");
    let range_m = log.run.setup.scenario.radio.range_m.unwrap();
    let mut places = BTreeMap::new();
    for row in log.rows::<PoseRow>().unwrap() {
        places.insert((row.t_ms, row.robot.clone()), Vec2::new(row.x_m, row.y_m));
    }
    let at = |t_ms: SimTime, robot: &str| places[&(t_ms, robot.to_owned())];
    let (mut heard, mut pairs) = (0, BTreeSet::new());
    for row in log.rows::<MessageRow>().unwrap() {
        let apart_m = at(row.sent_ms, &row.sender).distance(at(row.sent_ms, &row.receiver));
        assert!(apart_m <= range_m, "{row:?}: {apart_m} m");
        heard += 1;
        pairs.insert((row.sender, row.receiver));
    }
    assert!(heard > 22 * 15, "{heard}");
    assert!(pairs.len() < 22 * 21, "everybody hears everybody");
}

#[test]
fn thirty_robots_carry_the_waste_of_twenty_spills_to_their_own_deposits() {
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
    // Each robot activates sets for its own tasks alone.
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
    // Of the deposits many are used: nobody carries anything across the room.
    let room = setup.scenario.room;
    let deposits: Vec<Vec2> = WasteSection::of(&setup.scenario)
        .deposits()
        .map(|it| it.in_room(&room))
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

/// On every tick: items, solids, one set at a time, exclusive tasks among those who hear each other.
#[test]
fn it_copes_with_deaths_and_all_that_must_hold_does() {
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
    let mut team = Team::new(
        setup,
        LogLevel::Full,
        alliance_proto::log::Memory::default(),
    )
    .unwrap();
    let outcome = loop {
        let outcome = team.tick().unwrap();
        invariants.see(team.simulation()).unwrap();
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

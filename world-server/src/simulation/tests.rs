//! Tests of the readings that robots receive, in manually driven runs.

use glam::Vec2;
use proto::tick::Report;
use scenario::fault::{Device, Fault, Order, SensorError, SensorFault, SensorMode};
use scenario::testkit::default_setup;

use run_log::recorder::{Record, RecordError, TickRecord};

use super::*;
use crate::barrier::Verdict;
use crate::drill::DRILL;

const BLUE: RobotId = RobotId(0);

struct Unrecorded;

impl Record for Unrecorded {
    fn record(&mut self, _: &TickRecord<'_>) -> Result<(), RecordError> {
        Ok(())
    }
}

/// Runs a tick in which all robots stand still. Returns the position that blue receives.
fn stand_still(simulation: &mut Simulation) -> Vec2 {
    let mut position = None;
    while let Some(robot) = simulation.next_recipient() {
        let message = simulation.message(robot);
        if robot == BLUE {
            position = message.readings.pose.map(|pose| pose.position);
        }
        let report = Report {
            robot,
            incarnation: message.incarnation,
            tick: message.tick,
            ..Report::default()
        };
        assert_eq!(simulation.report(&report), Verdict::Counted);
    }
    simulation.finish();
    assert!(simulation.record(&mut Unrecorded).unwrap());
    position.expect("blue receives a tick message with a position")
}

/// Checks that the cache of unchanged readings hides neither a fault nor its end.
#[test]
fn a_resting_robot_receives_wrong_readings_only_during_a_sensor_fault() {
    let mut setup = default_setup(1);
    let fault = Fault::Sensor(SensorFault {
        robot: "blue".to_owned(),
        device: Device::new(Device::POSITION),
        mode: SensorMode::Noise(SensorError { m: 0.1, deg: 0.0 }),
    });
    setup.scenario.faults.timeline = vec![Order {
        at_s: Some(1.0),
        for_s: Some(1.0),
        ..Order::now(fault)
    }];
    let names: Vec<String> = setup
        .scenario
        .robots
        .iter()
        .map(|robot| robot.name.clone())
        .collect();
    let second = 1000 / setup.scenario.step_ms as usize;
    let mut simulation = Simulation::new(setup, DRILL, true);
    for name in &names {
        let (robot, incarnation, _) = simulation.invite(name).unwrap();
        simulation.arrive(robot, incarnation);
    }
    let positions: Vec<Vec2> = (0..3 * second)
        .map(|_| stand_still(&mut simulation))
        .collect();
    let position = simulation.world().pose(BLUE).position;
    let (before, rest) = positions.split_at(second);
    let (during, after) = rest.split_at(second);
    assert!(before.iter().all(|place| *place == position));
    assert!(during.iter().all(|place| *place != position));
    assert!(
        during.windows(2).all(|two| two[0] != two[1]),
        "a new error in each tick"
    );
    assert!(after.iter().all(|place| *place == position));
}

//! Tests of manually driven runs: the readings that robots receive, and the broadcasts that the log contains.

use glam::Vec2;
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::team::BroadcastContent;
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

/// Starts a run in which all robots have an agent.
fn start(setup: Setup) -> Simulation {
    let names: Vec<String> = setup
        .scenario
        .robots
        .iter()
        .map(|robot| robot.name.clone())
        .collect();
    let mut simulation = Simulation::new(setup, DRILL, true);
    for name in &names {
        let (robot, incarnation, _) = simulation.invite(name).unwrap();
        simulation.arrive(robot, incarnation);
    }
    simulation
}

/// Returns a message of an allocator in the first tick.
fn message_of(sender: RobotId, index: u16, bytes: usize) -> Broadcast {
    Broadcast {
        sender,
        incarnation: 1,
        tick: 0,
        index,
        seq: 0,
        sent: SimTime::ZERO,
        body: BroadcastContent::Allocation(AllocationMessage::Open(OpenMessage {
            schema: "test".to_owned(),
            bytes: vec![1; bytes],
        })),
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
    let second = 1000 / setup.scenario.step_ms as usize;
    let mut simulation = start(setup);
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

#[test]
fn messages_of_one_robot_do_not_displace_those_of_another_in_the_log() {
    let mut simulation = start(default_setup(1));
    simulation.record_allocation_messages();
    let gold = RobotId(1);
    for index in 0..10_000 {
        simulation.keep_allocation_message(&message_of(BLUE, index, 1));
    }
    // A repeated answer.
    for index in [1, 0, 0] {
        simulation.keep_allocation_message(&message_of(gold, index, 1));
    }
    let kept = simulation.allocation_messages.as_ref().unwrap();
    let of = |robot: RobotId| kept[robot.index()].iter().map(|message| message.index);
    assert_eq!(of(gold).collect::<Vec<_>>(), [1, 0]);
    assert_eq!(of(BLUE).count(), 256, "the limit of broadcasts in a tick");
}

/// The log does not contain the orders of the tick in which no robot is left. A replay knows only the faults that were due.
#[test]
fn orders_in_the_tick_without_robots_are_not_in_the_log() {
    let mut setup = default_setup(1);
    let mute = |at_s: f64| Order {
        at_s: Some(at_s),
        ..Order::now(Fault::Mute("blue".to_owned()))
    };
    setup.scenario.faults.timeline = vec![mute(0.1)];
    let mut simulation = start(setup);
    stand_still(&mut simulation);
    for rank in 0..simulation.setup().scenario.robots.len() {
        simulation.agent_lost(RobotId(rank as u32), 1);
    }
    // The tick of the losses, and the one after it.
    assert_eq!(simulation.next_recipient(), None);
    simulation.finish();
    assert!(simulation.record(&mut Unrecorded).unwrap());
    assert_eq!(simulation.next_recipient(), None);
    for at_s in [300.0, 301.0] {
        simulation.order(mute(at_s)).unwrap();
    }
    assert_eq!(simulation.faults().len(), 3);
    simulation.end_if_idle();
    let applied: Vec<bool> = simulation
        .ending()
        .faults
        .iter()
        .map(|fault| fault.applied_ms.is_some())
        .collect();
    assert_eq!(applied, [true]);
}

#[test]
fn an_external_controller_cannot_fill_the_log_without_limit() {
    let mut setup = default_setup(1);
    setup.scenario.robots[BLUE.index()].controller = Some("verbose".to_owned());
    let mut simulation = start(setup);
    let robot = std::iter::from_fn(|| simulation.next_recipient())
        .find(|robot| *robot == BLUE)
        .unwrap();
    simulation.keep_broadcast(message_of(robot, 0, 5000));
    let message = simulation.message(robot);
    let report = Report {
        robot,
        incarnation: message.incarnation,
        tick: message.tick,
        broadcasts: 1,
        ..Report::default()
    };
    simulation.answer_bytes[BLUE.index()] = reports::ANSWER_BYTES_MAX + 1;
    assert_eq!(simulation.report(&report), Verdict::Malformed);
    assert_eq!(
        simulation.check(&report),
        Err("its answers exceed 1024 MiB, the limit of a run".to_owned())
    );
    simulation.answer_bytes[BLUE.index()] = 0;
    assert_eq!(simulation.report(&report), Verdict::Counted);
    let size = simulation.answer_bytes[BLUE.index()];
    assert!((5000..5200).contains(&size), "{size} bytes");
}

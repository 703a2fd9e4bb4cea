//! Actuator faults: a failed gripper, and robots that ignore commands.

use proto::mission::items::{Gripper, ItemsAction};
use proto::readings::Actuation;
use scenario::fault::{ActuatorFault, ActuatorMode, Fault};
use scenario::ids::RobotId;
use world_server::faults::actuators::Actuators;
use world_server::faults::schedule::FaultIndex;
use world_server::world::World;

use crate::waste::MISSION;
use crate::waste::data::default_setup;

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

fn actuator(mode: ActuatorMode) -> Fault {
    Fault::Actuator(ActuatorFault {
        robot: "blue".to_owned(),
        mode,
    })
}

fn apply_faults(faults: &[Fault], robot: RobotId, commanded: Actuation) -> (Actuation, Vec<usize>) {
    let mut actuators = Actuators::new(&default_setup(1));
    let faults = faults.iter().enumerate();
    actuators.begin_tick(faults.map(|(index, fault)| (FaultIndex(index), fault)));
    let mut command = Some(commanded);
    let world = World::new(&default_setup(1), MISSION.world);
    let hits = actuators.apply_to(world.mission(), robot, &mut command);
    let hits = hits.into_iter().map(|fault| fault.0).collect();
    (command.unwrap(), hits)
}

#[test]
fn a_failed_gripper_keeps_and_the_drive_goes_on() {
    let commanded = Actuation {
        speed_m_s: 0.3,
        action: Gripper::Pick.into(),
        ..Actuation::default()
    };
    let faults = [actuator(ActuatorMode::Gripper)];
    let (done, hits) = apply_faults(&faults, BLUE, commanded);
    assert_eq!(
        (done.speed_m_s, done.action.items().gripper),
        (0.3, Gripper::Keep)
    );
    assert_eq!(hits, [0]);
    assert_eq!(apply_faults(&faults, GOLD, commanded), (commanded, vec![]));
    let keeps = Actuation {
        action: Gripper::Keep.into(),
        ..commanded
    };
    assert_eq!(apply_faults(&faults, BLUE, keeps), (keeps, vec![]));
}

#[test]
fn a_robot_without_power_or_that_babbles_executes_no_command() {
    let commanded = Actuation {
        action: ItemsAction {
            report: true,
            ..ItemsAction::default()
        }
        .into(),
        ..Actuation::default()
    };
    for fault in [Fault::Power as fn(String) -> Fault, Fault::Babble] {
        let fault = fault("blue".to_owned());
        let (done, hits) = apply_faults(std::slice::from_ref(&fault), BLUE, commanded);
        assert_eq!((done, hits), (Actuation::default(), vec![0]));
        let (_, hits) = apply_faults(&[fault], BLUE, Actuation::default());
        assert!(hits.is_empty());
    }
    let mut none = None;
    let mut actuators = Actuators::new(&default_setup(1));
    let fault = Fault::Babble("blue".to_owned());
    actuators.begin_tick([(FaultIndex(0), &fault)].into_iter());
    let world = World::new(&default_setup(1), MISSION.world);
    assert!(
        actuators
            .apply_to(world.mission(), BLUE, &mut none)
            .is_empty()
    );
    assert_eq!(none, None);
}

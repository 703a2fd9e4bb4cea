//! A gripper that fails, and robots that do not obey.

use alliance_proto::fault::{ActuatorFault, ActuatorMode, Fault};
use alliance_proto::ids::RobotId;
use alliance_proto::mission::items::{Gripper, ItemsDeed};
use alliance_proto::readings::Actuation;
use world_server::faults::actuators::Actuators;
use world_server::faults::schedule::FaultIndex;
use world_server::world::World;

use crate::waste::data::default_setup;
use crate::waste::world::WASTE;

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

fn actuator(mode: ActuatorMode) -> Fault {
    Fault::Actuator(ActuatorFault {
        robot: "blue".to_owned(),
        mode,
    })
}

fn obeyed(faults: &[Fault], robot: RobotId, told: Actuation) -> (Actuation, Vec<usize>) {
    let mut actuators = Actuators::new(&default_setup(1));
    let faults = faults.iter().enumerate();
    actuators.begin(faults.map(|(index, fault)| (FaultIndex(index), fault)));
    let mut command = Some(told);
    let world = World::new(&default_setup(1), WASTE);
    let hits = actuators.disobey(world.mission(), robot, &mut command);
    let hits = hits.into_iter().map(|fault| fault.0).collect();
    (command.unwrap(), hits)
}

#[test]
fn a_failed_gripper_keeps_and_the_drive_goes_on() {
    let told = Actuation {
        speed_m_s: 0.3,
        deed: Gripper::Pick.into(),
        ..Actuation::default()
    };
    let faults = [actuator(ActuatorMode::Gripper)];
    let (done, hits) = obeyed(&faults, BLUE, told);
    assert_eq!(
        (done.speed_m_s, done.deed.items().gripper),
        (0.3, Gripper::Keep)
    );
    assert_eq!(hits, [0]);
    assert_eq!(obeyed(&faults, GOLD, told), (told, vec![]));
    let keeps = Actuation {
        deed: Gripper::Keep.into(),
        ..told
    };
    assert_eq!(obeyed(&faults, BLUE, keeps), (keeps, vec![]));
}

#[test]
fn without_power_and_while_it_babbles_nothing_is_obeyed() {
    let told = Actuation {
        deed: ItemsDeed {
            report: true,
            ..ItemsDeed::default()
        }
        .into(),
        ..Actuation::default()
    };
    for fault in [Fault::Power as fn(String) -> Fault, Fault::Babble] {
        let fault = fault("blue".to_owned());
        let (done, hits) = obeyed(std::slice::from_ref(&fault), BLUE, told);
        assert_eq!((done, hits), (Actuation::default(), vec![0]));
        let (_, hits) = obeyed(&[fault], BLUE, Actuation::default());
        assert!(hits.is_empty());
    }
    let mut none = None;
    let mut actuators = Actuators::new(&default_setup(1));
    let fault = Fault::Babble("blue".to_owned());
    actuators.begin([(FaultIndex(0), &fault)].into_iter());
    let world = World::new(&default_setup(1), WASTE);
    assert!(
        actuators
            .disobey(world.mission(), BLUE, &mut none)
            .is_empty()
    );
    assert_eq!(none, None);
}

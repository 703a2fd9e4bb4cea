//! Actuator faults: a failed gripper, and robots that ignore commands.

use proto::mission::items::Gripper;
use proto::readings::Actuation;
use scenario::fault::{ActuatorFault, ActuatorMode, Fault};
use scenario::ids::RobotId;
use world_server::faults::actuators::Actuators;
use world_server::faults::schedule::FaultIndex;
use world_server::world::World;

use super::floor::{BLUE, GOLD, REPORT, acts};
use crate::waste::MISSION;
use crate::waste::data::default_setup;

/// Applies a fault to a command. Returns the command and whether the fault has changed it.
fn apply(
    fault: &Fault,
    robot: RobotId,
    mut command: Option<Actuation>,
) -> (Option<Actuation>, bool) {
    let mut actuators = Actuators::new(&default_setup(1));
    actuators.begin_tick([(FaultIndex(0), fault)].into_iter());
    let world = World::new(&default_setup(1), MISSION.world);
    let hits = actuators.apply_to(world.mission(), robot, &mut command);
    (command, !hits.is_empty())
}

#[test]
fn a_failed_gripper_keeps_and_the_drive_goes_on() {
    let fault = Fault::Actuator(ActuatorFault {
        robot: "blue".to_owned(),
        mode: ActuatorMode::Gripper,
    });
    let moves = |gripper| {
        let speed_m_s = 0.3;
        acts(gripper).map(|command| Actuation {
            speed_m_s,
            ..command
        })
    };
    let (picks, keeps) = (moves(Gripper::Pick), moves(Gripper::Keep));
    assert_eq!(apply(&fault, BLUE, picks), (keeps, true));
    assert_eq!(apply(&fault, GOLD, picks), (picks, false));
    assert_eq!(apply(&fault, BLUE, keeps), (keeps, false));
}

#[test]
fn a_robot_without_power_or_that_babbles_executes_no_command() {
    let idle = Some(Actuation::default());
    for fault in [Fault::Power as fn(String) -> Fault, Fault::Babble] {
        let fault = fault("blue".to_owned());
        assert_eq!(apply(&fault, BLUE, acts(REPORT)), (idle, true));
        assert_eq!(apply(&fault, BLUE, idle), (idle, false));
        assert_eq!(apply(&fault, BLUE, None), (None, false));
    }
}

//! The data that a mission has at its start.

use scenario::ids::RobotId;
use scenario::testkit::unlike_robots;

use crate::drill::DRILL;
use crate::world::World;

/// Checks the data that `new` and every step of a mission receive.
#[test]
fn a_mission_receives_the_abilities_of_each_robot() {
    let setup = unlike_robots();
    let world = World::new(&setup, DRILL);
    let able = |robot: u32| {
        let spec = &setup.scenario.robots[robot as usize];
        let body = world.body_of(RobotId(robot));
        let driving = (body.speed_m_s, body.push_m_s, body.turn_deg_s);
        (driving, spec.has_device("horn"), spec.skill("lift"))
    };
    assert_eq!(able(0), ((0.5, 0.3, 90.0), true, Some(2.0)));
    assert_eq!(able(1), ((0.25, 0.1, 45.0), false, Some(0.0)));
}

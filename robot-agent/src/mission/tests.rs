//! The data that a controller has at its start.

use scenario::SetupFile;
use scenario::ids::RobotId;
use scenario::testkit::{unlike_robots, vocabulary};

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

/// The briefing from the bus is sufficient to create a controller.
#[test]
fn the_briefing_contains_the_abilities_of_all_robots() {
    let sent = serde_json::to_string(&unlike_robots().for_robots()).unwrap();
    let file: SetupFile = serde_json::from_str(&sent).unwrap();
    let setup = file.read(&vocabulary()).unwrap();
    setup.check().unwrap();
    let able = |robot: RobotId| {
        let spec = &setup.scenario.robots[robot.index()];
        let push_m_s = setup.scenario.body_of(spec).push_m_s;
        (push_m_s, spec.has_device("horn"), spec.skill("lift"))
    };
    assert_eq!(able(BLUE), (0.3, true, Some(2.0)));
    assert_eq!(able(GOLD), (0.1, false, Some(0.0)));
}

//! Faults for tests.

use crate::Obstacle;
use crate::fault::*;

/// Returns one fault of each kind, with every mode.
#[must_use]
pub fn one_of_each() -> Vec<Fault> {
    let robot = || "gold".to_owned();
    let from = || LinkEnd::Robot("green".to_owned());
    let error = SensorError { m: 0.5, deg: 3.0 };
    let sensor = |device, mode| {
        Fault::Sensor(SensorFault {
            robot: robot(),
            device: Device::new(device),
            mode,
        })
    };
    let actuator = |mode| {
        Fault::Actuator(ActuatorFault {
            robot: robot(),
            mode,
        })
    };
    vec![
        Fault::Kill(robot()),
        Fault::Terminate(robot()),
        Fault::Pause(robot()),
        Fault::Continue(robot()),
        Fault::Restart(robot()),
        Fault::Remove(robot()),
        Fault::Drop(Loss {
            from: from(),
            to: LinkEnd::All,
            p: 0.3,
            burst_s: 2.0,
        }),
        Fault::Delay(Delay {
            from: LinkEnd::All,
            to: from(),
            delay_s: 0.5,
            jitter_s: 1.5,
        }),
        Fault::Duplicate(LinkChance {
            from: LinkEnd::All,
            to: LinkEnd::All,
            p: 0.1,
        }),
        Fault::Reorder(LinkChance {
            from: from(),
            to: LinkEnd::All,
            p: 0.1,
        }),
        Fault::Hold(LinkSelection::default()),
        Fault::Partition(Partition {
            groups: vec![vec!["blue".to_owned(), robot()], vec!["green".to_owned()]],
            one_way: true,
        }),
        Fault::Mute(robot()),
        Fault::Deaf(robot()),
        Fault::Range(RangeFault { range_m: 3.5 }),
        Fault::Radio(RadioQuality::SevereRadio),
        Fault::Sensor(SensorFault {
            robot: "blue".to_owned(),
            device: Device::new(Device::SIDE_BORDER),
            mode: SensorMode::Dead,
        }),
        sensor(Device::FRONT_BORDER, SensorMode::Stuck),
        sensor(Device::POSITION, SensorMode::Noise(error)),
        sensor("eye", SensorMode::Bias(SensorError { m: -0.5, deg: 0.0 })),
        sensor(Device::GROUND, SensorMode::Dropout(0.25)),
        actuator(ActuatorMode::Dead),
        actuator(ActuatorMode::Slowed(0.2)),
        actuator(ActuatorMode::TurnBias(-10.0)),
        actuator(ActuatorMode::OneWheel(Side::Left)),
        actuator(ActuatorMode::Gripper),
        Fault::Skill(SkillFault {
            robot: robot(),
            skill: "lift".to_owned(),
            share: 0.3,
        }),
        Fault::Power(robot()),
        Fault::Babble(robot()),
        Fault::Obstacle(Obstacle {
            x_m: 2.0,
            y_m: 1.0,
            width_m: 0.5,
            height_m: 0.5,
            penetrability: 0.5,
        }),
        Fault::Mission(MissionFault::new(
            "shake",
            &[("x_m", 3.0), ("y_m", 4.5), ("times", 2.0)],
        )),
        Fault::MoveRobot(MoveRobot {
            robot: robot(),
            x_m: 3.0,
            y_m: 4.0,
            heading_deg: Some(-90.0),
        }),
    ]
}

//! One vocabulary in every form.

use super::*;
use crate::codec::{decode, encode};
use crate::mission::waste_data::default_scenario;
use crate::scenario::{Catalog, Scenario};

/// One fault of each kind, with every mode.
pub(crate) fn one_of_each() -> Vec<Fault> {
    let robot = || "gold".to_owned();
    let from = || Who::Robot("green".to_owned());
    let error = SensorError { m: 0.5, deg: 3.0 };
    let sensor = |device, mode| {
        Fault::Sensor(SensorFault {
            robot: robot(),
            device,
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
            to: Who::All,
            p: 0.3,
            burst_s: 2.0,
        }),
        Fault::Delay(Delay {
            from: Who::All,
            to: from(),
            delay_s: 0.5,
            jitter_s: 1.5,
        }),
        Fault::Duplicate(Chance {
            from: Who::All,
            to: Who::All,
            p: 0.1,
        }),
        Fault::Reorder(Chance {
            from: from(),
            to: Who::All,
            p: 0.1,
        }),
        Fault::Hold(Link::default()),
        Fault::Partition(Partition {
            groups: vec![vec!["blue".to_owned(), robot()], vec!["green".to_owned()]],
            one_way: true,
        }),
        Fault::Mute(robot()),
        Fault::Deaf(robot()),
        Fault::Range(RangeFault { range_m: 3.5 }),
        Fault::Radio(RadioQuality::SevereRadio),
        sensor(Device::SideBorder, SensorMode::Dead),
        sensor(Device::Gripper, SensorMode::Stuck),
        sensor(Device::Position, SensorMode::Noise(error)),
        sensor(
            Device::Waste,
            SensorMode::Bias(SensorError { m: -0.5, deg: 0.0 }),
        ),
        sensor(Device::Ground, SensorMode::Dropout(0.25)),
        actuator(ActuatorMode::Dead),
        actuator(ActuatorMode::Slowed(0.2)),
        actuator(ActuatorMode::TurnBias(-10.0)),
        actuator(ActuatorMode::OneWheel(Side::Left)),
        actuator(ActuatorMode::Gripper),
        Fault::Power(robot()),
        Fault::Babble(robot()),
        Fault::Obstacle(Obstacle {
            x_m: 2.0,
            y_m: 1.0,
            width_m: 0.5,
            height_m: 0.5,
            penetrability: 0.5,
        }),
        Fault::Waste(WasteFault {
            x_m: 3.0,
            y_m: 4.0,
            items: 2,
        }),
        Fault::MoveWaste(MoveWaste {
            item: 7,
            x_m: 3.0,
            y_m: 4.0,
        }),
        Fault::MoveRobot(MoveRobot {
            robot: robot(),
            x_m: 3.0,
            y_m: 4.0,
            heading_deg: Some(-90.0),
        }),
    ]
}

#[test]
fn every_fault_survives_bincode_and_json() {
    for fault in one_of_each() {
        let order = Order {
            when: Some("any delivers item-3".parse().unwrap()),
            for_s: Some(3.0),
            ..Order::now(fault)
        };
        assert_eq!(decode::<Order>(&encode(&order).unwrap()).unwrap(), order);
        let json = serde_json::to_string(&order).unwrap();
        assert_eq!(
            serde_json::from_str::<Order>(&json).unwrap(),
            order,
            "{json}"
        );
        let key = format!(r#""fault":{{"{}":"#, order.fault.name());
        assert!(json.contains(&key), "{json}");
    }
}

#[test]
fn the_default_team_can_be_ordered_all_of_them() {
    let scenario = default_scenario();
    for fault in one_of_each() {
        let order = Order::now(fault);
        assert_eq!(
            order.check(&scenario, &Catalog::of(&scenario)),
            Ok(()),
            "{order}"
        );
    }
}

#[track_caller]
fn refused(json: &str, line: &str) {
    let order: Order = serde_json::from_str(json).unwrap();
    let scenario = default_scenario();
    let error = order.check(&scenario, &Catalog::of(&scenario)).unwrap_err();
    assert_eq!(error.to_string(), line);
}

#[test]
fn mistakes_say_where_what_and_what_would_be_right() {
    refused(
        r#"{"fault":{"kill":"glod"}}"#,
        "fault.kill: the scenario has no robot 'glod'; did you mean 'gold'? (there are blue, gold, green)",
    );
    refused(
        r#"{"fault":{"add":"gold"}}"#,
        "fault.add: 'gold' is in the mission from its start; name a robot that the scenario calls absent: there are none",
    );
    refused(
        r#"{"fault":{"drop":{"p":1.5}}}"#,
        "fault.drop.p: 1.5 is out of range; it must be at least 0 and at most 1",
    );
    refused(
        r#"{"fault":{"drop":{"to":"red","p":0.5}}}"#,
        "fault.drop.to: the scenario has no robot 'red'; there are blue, gold, green",
    );
    refused(
        r#"{"fault":{"sensor":{"robot":"blue","device":"gripper","mode":{"noise":{"m":1}}}}}"#,
        "fault.sensor.mode: 'gripper' tells no lengths; use dead, stuck or dropout",
    );
    refused(
        r#"{"fault":{"waste":{"x_m":13,"y_m":1}}}"#,
        "fault.waste.x_m: 13 is out of range; it must be at least 0 and at most 12 m",
    );
    refused(
        r#"{"fault":{"waste":{"x_m":1,"y_m":1}},"for_s":3}"#,
        "for_s: 'waste' happens in a moment; leave the duration out",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"every_s":3}"#,
        "every_s: it comes again but never heals; give it a duration as well",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"every_s":3,"for_s":3}"#,
        "for_s: 3 s is no shorter than every 3 s; let it heal before it comes again",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"when":"gold activates report-progres"}"#,
        "when: there is no behavior set 'report-progres'; did you mean 'report-progress'? (there are \
         find-locations-methodical, find-locations-wander, move-spill(top), move-spill(bottom), report-progress)",
    );
    refused(
        r#"{"fault":{"mute":"blue"},"when":"gold dies","at_s":3}"#,
        "when: both an event and a time trigger it; give one of them",
    );
    refused(
        r#"{"fault":{"partition":{"groups":[["blue"],["gold","blue"]]}}}"#,
        "fault.partition.groups: 'blue' is in two groups; name it once",
    );
}

#[test]
fn events_are_read_as_people_write_them() {
    let when: When = "blue activates move-spill(top)".parse().unwrap();
    let expected = When {
        robot: Some("blue".to_owned()),
        what: Happening::Activates,
        subject: Some("move-spill(top)".to_owned()),
    };
    assert_eq!(when, expected);
    assert_eq!(when.to_string(), "blue activates move-spill(top)");
    let any = When {
        robot: None,
        what: Happening::Delivers,
        subject: None,
    };
    assert_eq!("any  delivers".parse(), Ok(any));
    for wrong in ["", "blue", "blue naps", "blue dies twice", "blue picks a b"] {
        assert!(wrong.parse::<When>().is_err(), "{wrong}");
    }
}

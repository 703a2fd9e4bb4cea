//! The readings and actions of all missions in one form, for controllers in other languages.

use proto::mission::items::{Gripper, ItemsAction};
use proto::mission::{Action, Reading, SensorReading};
use proto::readings::Readings;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::{observe, push, service};

/// An action besides driving. Each mission uses a part of it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MissionAction {
    /// The command to the gripper (waste).
    #[serde(with = "GripperWord")]
    pub gripper: Gripper,
    /// True to report the progress (waste).
    pub report: bool,
    /// The point to work on (service).
    pub work: Option<u16>,
    /// The last board line that the robot has read (service).
    pub read: Option<u32>,
    /// True to observe all targets in range (observe).
    pub watch: bool,
}

/// The words for commands to the gripper.
#[derive(Deserialize)]
#[serde(remote = "Gripper", rename_all = "lowercase")]
enum GripperWord {
    Keep,
    Pick,
    Drop,
}

impl MissionAction {
    /// Returns the action in the form of a mission. `readings` are those of the step.
    #[must_use]
    pub fn for_mission(&self, mission: &str, readings: &Readings) -> Action {
        match mission {
            "waste" => ItemsAction {
                gripper: self.gripper,
                report: self.report,
            }
            .into(),
            // A robot with a dead device cannot observe.
            "observe" if self.watch && sees_targets(readings) => {
                Action::new(&observe::bus::ObserveAction)
            }
            "service" => Action::new(&service::bus::Action {
                work: self.work,
                read: self.read,
            }),
            _ => Action::Nothing,
        }
    }
}

/// Returns whether the device that detects targets works.
fn sees_targets(readings: &Readings) -> bool {
    let sensed = readings.mission.value::<observe::bus::SensorReading>();
    sensed.targets.is_some()
}

/// Returns the readings of a mission's devices, by their names on the bus. For an unknown mission it returns the raw
/// bytes.
#[must_use]
pub fn reading_as_json(sensed: &SensorReading, mission: &str) -> Value {
    fn open<R: Reading>(sensed: &SensorReading) -> Value {
        serde_json::to_value(sensed.value::<R>()).unwrap_or_default()
    }
    match (mission, sensed) {
        ("waste", sensed) => serde_json::to_value(sensed.items()).unwrap_or_default(),
        ("observe", sensed) => open::<observe::bus::SensorReading>(sensed),
        ("push", sensed) => open::<push::bus::SensorReading>(sensed),
        ("service", sensed) => open::<service::bus::SensorReading>(sensed),
        (_, SensorReading::Open(open)) => json!({ "bytes": open.bytes().as_slice() }),
        _ => json!({}),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn action(text: &str) -> Result<MissionAction, String> {
        serde_json::from_str(text).map_err(|error| error.to_string())
    }

    #[test]
    fn each_mission_uses_its_part_of_an_action() {
        let all = action(r#"{ "gripper": "pick", "work": 3, "watch": true }"#).unwrap();
        let readings = Readings::default();
        assert_eq!(
            all.for_mission("waste", &readings),
            Action::from(Gripper::Pick)
        );
        let work = service::bus::Action {
            work: Some(3),
            read: None,
        };
        assert_eq!(all.for_mission("service", &readings), Action::new(&work));
        // The device is dead.
        assert_eq!(all.for_mission("observe", &readings), Action::Nothing);
        assert_eq!(all.for_mission("push", &readings), Action::Nothing);
    }

    #[test]
    fn unknown_words_are_refused() {
        assert_eq!(action("{}"), Ok(MissionAction::default()));
        for (text, wrong) in [
            (r#"{ "gripper": "open" }"#, "unknown variant `open`"),
            (r#"{ "griper": "pick" }"#, "unknown field `griper`"),
            (r#"{ "work": -1 }"#, "invalid value"),
        ] {
            let error = action(text).unwrap_err();
            assert!(error.contains(wrong), "{text}: {error}");
        }
    }
}

//! The readings and actions of all missions in one form, for controllers in other languages.

use proto::codec;
use proto::mission::items::{Gripper, ItemsAction};
use proto::mission::{Action, Reading, SensorReading, SharedKnowledge};
use proto::readings::Readings;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
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
    pub work: Option<u32>,
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
        (_, SensorReading::Open(open)) => {
            open.with_bytes(|bytes| json!({ "bytes": bytes.as_slice() }))
        }
        _ => json!({}),
    }
}

/// Returns the shared knowledge of a mission, by its names on the bus. For an unknown mission it returns the raw bytes, and
/// null for knowledge that is absent or has another form.
#[must_use]
pub fn knowledge_as_json(knowledge: &SharedKnowledge, mission: &str) -> Value {
    fn open<K: DeserializeOwned + Serialize>(bytes: &[u8]) -> Value {
        let known = codec::decode::<K>(bytes).ok();
        known.map_or(Value::Null, |known| {
            serde_json::to_value(known).unwrap_or_default()
        })
    }
    match (mission, knowledge) {
        (_, SharedKnowledge::Nothing) => Value::Null,
        (_, SharedKnowledge::Items(known)) => serde_json::to_value(known).unwrap_or_default(),
        ("observe", SharedKnowledge::Open(bytes)) => open::<observe::bus::SharedSightings>(bytes),
        ("push", SharedKnowledge::Open(bytes)) => open::<push::bus::SharedKnowledge>(bytes),
        ("service", SharedKnowledge::Open(bytes)) => open::<service::bus::SharedKnowledge>(bytes),
        (_, SharedKnowledge::Open(bytes)) => json!({ "bytes": bytes }),
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
    fn knowledge_has_its_names_and_damaged_bytes_are_absent() {
        let fact = service::bus::PointFact {
            point: 3,
            kind: 1,
            round: 0,
            at: glam::Vec2::new(1.5, 2.0),
            left_s: 4.0,
        };
        let observed = service::bus::ObservedFact {
            fact,
            sensed: scenario::time::SimTime(250),
        };
        let mut known = SharedKnowledge::default();
        known.set(&service::bus::SharedKnowledge::from_iter([observed]));
        let fact = json!({ "point": 3, "kind": 1, "round": 0, "at": [1.5, 2.0], "left_s": 4.0 });
        let expected = json!([{ "fact": fact, "sensed": 250 }]);
        assert_eq!(knowledge_as_json(&known, "service"), expected);
        let SharedKnowledge::Open(bytes) = &known else {
            panic!("{known:?}")
        };
        let cut = SharedKnowledge::Open(bytes[..5].to_vec());
        assert_eq!(knowledge_as_json(&cut, "service"), Value::Null);
        let raw = json!({ "bytes": bytes[..5] });
        assert_eq!(knowledge_as_json(&cut, "another"), raw);
        let nothing = SharedKnowledge::Nothing;
        assert_eq!(knowledge_as_json(&nothing, "waste"), Value::Null);
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

//! What a robot senses, as Python has it.

use alliance_proto::mission::Sensed;
use alliance_proto::readings::{Hit, Readings};
use alliance_proto::scenario::Setup;
use glam::Vec2;
use missions::{observe, push, service};
use pyo3::intern;
use pyo3::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

/// `alliance_agent.Readings`. Numbers are those of the bus, to the bit.
pub fn to_python<'py>(
    py: Python<'py>,
    readings: &Readings,
    setup: &Setup,
) -> PyResult<Bound<'py, PyAny>> {
    let text = told(readings, setup).to_string();
    let minds = py.import(intern!(py, "alliance_agent._minds"))?;
    minds.call_method1(intern!(py, "readings"), (text,))
}

fn told(readings: &Readings, setup: &Setup) -> Value {
    let number = |it: f32| f64::from(it);
    let hits = |hits: [Option<Hit>; 3]| {
        hits.map(|hit| hit.map(|hit| [number(hit.distance_m), number(hit.normal_rad)]))
    };
    // `false`: the device works, and there is nothing in range.
    let border = |it: Option<Option<f32>>| match it {
        None => Value::Null,
        Some(None) => Value::Bool(false),
        Some(Some(distance_m)) => number(distance_m).into(),
    };
    json!({
        "position": readings.pose.map(|pose| point(pose.position)),
        "heading": readings.pose.map(|pose| number(pose.heading_rad)),
        "front_border": border(readings.front_border),
        "side_border": border(readings.side_border),
        "ahead": readings.proximity.map(|it| hits(it.ahead)),
        "left": readings.proximity.map(|it| hits(it.left)),
        "right": readings.proximity.map(|it| hits(it.right)),
        "ground": readings.ground.map(|it| [number(it.here), number(it.ahead)]),
        "energy": readings.energy_j.map(number),
        "mission": mission(&readings.mission, setup),
    })
}

fn point(at: Vec2) -> [f64; 2] {
    at.to_array().map(f64::from)
}

/// What the devices of the mission tell, by their names on the bus; the bytes of a mission that is not known here.
fn mission(sensed: &Sensed, setup: &Setup) -> Value {
    fn open<T: DeserializeOwned + Default + Serialize>(sensed: &Sensed) -> Value {
        let sensed: T = match sensed {
            Sensed::Open(bytes) => bytes.decode().unwrap_or_default(),
            _ => T::default(),
        };
        serde_json::to_value(sensed).unwrap_or_default()
    }
    match (setup.catalog.mission.name(), sensed) {
        ("waste", sensed) => serde_json::to_value(sensed.items()).unwrap_or_default(),
        ("observe", sensed) => open::<observe::bus::Sensed>(sensed),
        ("push", sensed) => open::<push::bus::Sensed>(sensed),
        ("service", sensed) => open::<service::bus::Sensed>(sensed),
        (_, Sensed::Open(bytes)) => json!({ "bytes": bytes.as_slice() }),
        _ => json!({}),
    }
}

/// Whether the device that senses targets works.
pub fn sees_targets(readings: &Readings) -> bool {
    match &readings.mission {
        Sensed::Open(bytes) => bytes
            .decode::<observe::bus::Sensed>()
            .is_ok_and(|sensed| sensed.targets.is_some()),
        _ => false,
    }
}

//! Sensor readings as Python objects.

use glam::Vec2;
use missions::external::reading_as_json;
use proto::readings::{Hit, Readings};
use pyo3::intern;
use pyo3::prelude::*;
use scenario::Setup;
use serde_json::{Value, json};

/// Returns `alliance_sim.Readings`. Numbers are bitwise equal to those on the bus.
pub fn to_python<'py>(
    py: Python<'py>,
    readings: &Readings,
    setup: &Setup,
) -> PyResult<Bound<'py, PyAny>> {
    let text = to_json(readings, setup).to_string();
    let module = py.import(intern!(py, "alliance_sim._controllers"))?;
    module.call_method1(intern!(py, "readings"), (text,))
}

fn to_json(readings: &Readings, setup: &Setup) -> Value {
    let number = |value: f32| f64::from(value);
    let hits = |hits: [Option<Hit>; 3]| {
        hits.map(|hit| hit.map(|hit| [number(hit.distance_m), number(hit.normal_rad)]))
    };
    // `false` means that the device works and nothing is in range.
    let border = |reading: Option<Option<f32>>| match reading {
        None => Value::Null,
        Some(None) => Value::Bool(false),
        Some(Some(distance_m)) => number(distance_m).into(),
    };
    json!({
        "position": readings.pose.map(|pose| point(pose.position)),
        "heading": readings.pose.map(|pose| number(pose.heading_rad)),
        "front_border": border(readings.front_border),
        "side_border": border(readings.side_border),
        "ahead": readings.proximity.map(|proximity| hits(proximity.ahead)),
        "left": readings.proximity.map(|proximity| hits(proximity.left)),
        "right": readings.proximity.map(|proximity| hits(proximity.right)),
        "ground": readings.ground.map(|ground| [number(ground.here), number(ground.ahead)]),
        "energy": readings.energy_j.map(number),
        "mission": reading_as_json(&readings.mission, setup.catalog.mission.name()),
    })
}

fn point(position: Vec2) -> [f64; 2] {
    position.to_array().map(f64::from)
}

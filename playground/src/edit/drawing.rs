//! The drawing of a scenario: the start of its run, and the items that a person can change.

use std::time::Duration;

use proto::view::View;
use serde_json::{Value, json};
use toml_edit::{DocumentMut, TableLike};

use super::document::{self, Tables};
use super::kinds::{Fresh, ItemKind, KINDS, OutlineKind, Place, X, Y};
use crate::choice::Choice;
use crate::engine::{Engine, OpenError};

/// Returns the drawing of a text, whose run `choice` is: `run` and `view` as for the page of a run, the `items` from the
/// floor up, and the kinds that can be added.
pub fn draw(choice: &Choice, text: &str) -> Result<Value, OpenError> {
    let mut engine = Engine::open(choice, Duration::ZERO)?;
    let view = engine.view();
    let run = engine.about();
    let scenario = &run["scenario"];
    // The scenario has no problem, so its text is a document.
    let mut document = text.parse::<DocumentMut>().unwrap_or_default();
    let items = KINDS.iter().flat_map(|kind| match kind.place {
        Place::Start => blocks(kind, &mut document, scenario, &view),
        _ => places(kind, &mut document, scenario),
    });
    let items: Vec<Value> = items.collect();
    // Robots first.
    let kinds = KINDS
        .iter()
        .rev()
        .filter(|kind| is_possible(kind, scenario));
    let kinds = kinds.flat_map(|kind| match kind.fresh {
        Fresh::Kinds(list) => {
            let names = scenario.pointer(list).and_then(Value::as_array);
            let names = names.into_iter().flatten();
            names
                .map(|entry| json!({"kind": kind.name, "variant": entry["name"]}))
                .collect()
        }
        _ => vec![json!({"kind": kind.name, "variant": null})],
    });
    let kinds: Vec<Value> = kinds.collect();
    Ok(json!({"run": run, "view": view, "items": items, "kinds": kinds}))
}

/// Returns true if the mission has items of the kind, and more can be added.
fn is_possible(kind: &ItemKind, scenario: &Value) -> bool {
    let is_of_mission = match kind.path {
        [mission, _] => scenario.get(mission).is_some(),
        _ => true,
    };
    is_of_mission && !matches!(kind.fresh, Fresh::Never)
}

/// Returns the items of a kind with one place each.
fn places(kind: &ItemKind, document: &mut DocumentMut, scenario: &Value) -> Vec<Value> {
    let stated = Tables::find(document, kind.path).map_or(0, |tables| tables.len());
    let entries: Vec<&Value> = match (kind.path, scenario.pointer(&kind.pointer())) {
        // A zone is one of the obstacles, after the stated ones.
        (["zones"], _) => {
            let all = scenario["obstacles"].as_array();
            let all = all.map_or(&[][..], Vec::as_slice);
            all[all.len().saturating_sub(stated)..].iter().collect()
        }
        (["obstacles"], Some(Value::Array(all))) => all.iter().take(stated).collect(),
        (_, Some(Value::Array(all))) => all.iter().collect(),
        (_, Some(single)) => vec![single],
        (_, None) => Vec::new(),
    };
    let described = entries.into_iter().enumerate();
    let described = described.map(|(index, entry)| {
        let room = &scenario["room"];
        let (x_m, y_m) = match kind.place {
            Place::Fractions => (
                number(&room[X]) + number(&entry["x_fraction"]) * number(&room["width_m"]),
                number(&room[Y]) + number(&entry["y_fraction"]) * number(&room["height_m"]),
            ),
            _ => (number(&entry[X]), number(&entry[Y])),
        };
        let outline = outline(kind, entry, scenario, x_m, y_m);
        let name = entry.get("name").or(entry.get("kind")).and_then(Value::as_str);
        let label = match (name, kind.is_list) {
            (Some(name), _) => format!("{} {name}", kind.name),
            (None, true) => format!("{} {}", kind.name, index + 1),
            (None, false) => kind.name.to_owned(),
        };
        let numbers = kind.numbers.iter().filter_map(|key| {
            // The factor of a zone is the penetrability of its obstacle.
            let stated = entry.get(match *key {
                "speed_factor" => "penetrability",
                key => key,
            })?;
            Some(((*key).to_owned(), json!(shortest(number(stated)))))
        });
        json!({
            "kind": kind.name, "index": index, "label": label, "x_m": shortest(x_m), "y_m": shortest(y_m),
            "numbers": numbers.collect::<serde_json::Map<_, _>>(), "outlines": [outline],
        })
    });
    described.collect()
}

/// Returns the outline of an item, as of a mark.
fn outline(kind: &ItemKind, entry: &Value, scenario: &Value, x_m: f64, y_m: f64) -> Value {
    match kind.outline {
        OutlineKind::Rectangle => {
            let (width_m, height_m) = (number(&entry["width_m"]), number(&entry["height_m"]));
            json!({"rectangle": {"min": [x_m, y_m], "max": [x_m + width_m, y_m + height_m]}})
        }
        OutlineKind::Bar => {
            let half_m = number(&scenario["push"]["length_m"]) / 2.0;
            let half_width_m = &scenario["push"]["half_width_m"];
            json!({"bar": {"from": [x_m, y_m - half_m], "to": [x_m, y_m + half_m], "half_width_m": half_width_m}})
        }
        OutlineKind::Disc(radius) => disc(x_m, y_m, scenario.pointer(radius)),
        OutlineKind::Bodies => Value::Null,
    }
}

fn disc(x_m: f64, y_m: f64, radius_m: Option<&Value>) -> Value {
    json!({"disc": {"center": [x_m, y_m], "radius_m": radius_m}})
}

/// Returns the blocks of robots. A block with a count is one item.
fn blocks(
    kind: &ItemKind,
    document: &mut DocumentMut,
    scenario: &Value,
    view: &View,
) -> Vec<Value> {
    let stated = Tables::find(document, kind.path).map_or(0, |tables| tables.len());
    let robots = scenario["robots"].as_array().map_or(0, Vec::len);
    let mut rank = 0;
    let mut items = Vec::new();
    // Without stated robots, each default robot is a block.
    for index in 0..if stated == 0 { robots } else { stated } {
        let block = stated_block(document, kind, index);
        let members = rank..(rank + block.count.unwrap_or(1)).min(robots);
        let poses: Vec<_> = view.robots[members.clone()]
            .iter()
            .map(|robot| robot.pose)
            .collect();
        let Some(first) = poses.first() else { break };
        let mean = |at: fn(&proto::readings::Pose) -> f32| {
            poses.iter().map(|pose| f64::from(at(pose))).sum::<f64>() / poses.len() as f64
        };
        let (x_m, y_m) = block
            .place
            .unwrap_or_else(|| (mean(|pose| pose.position.x), mean(|pose| pose.position.y)));
        let heading_deg = f64::from(first.heading_rad.to_degrees().round());
        let name = |rank: usize| {
            scenario["robots"][rank]["name"]
                .as_str()
                .unwrap_or_default()
        };
        let label = match block.count {
            Some(2..) => format!("robots {} to {}", name(rank), name(members.end - 1)),
            _ => format!("robot {}", name(rank)),
        };
        let body = scenario["body"].get("radius_m");
        let bodies = poses
            .iter()
            .map(|pose| disc(pose.position.x.into(), pose.position.y.into(), body));
        items.push(json!({
            "kind": kind.name, "index": index, "label": label, "x_m": shortest(x_m), "y_m": shortest(y_m),
            "numbers": {"heading_deg": heading_deg}, "outlines": bodies.collect::<Vec<_>>(),
        }));
        rank = members.end;
    }
    items
}

/// The count and the start of a block, as the text states them.
#[derive(Default)]
struct StatedBlock {
    count: Option<usize>,
    place: Option<(f64, f64)>,
}

fn stated_block(document: &mut DocumentMut, kind: &ItemKind, index: usize) -> StatedBlock {
    let of_kind = |document: &mut DocumentMut, name: &str| {
        let table = document::find(document, &["kinds", name])?.as_table_like()?;
        place_of(table)
    };
    let Some(block) = Tables::find(document, kind.path).and_then(|it| it.into_entry(index)) else {
        return StatedBlock::default();
    };
    let count = block.get("count").and_then(toml_edit::Item::as_integer);
    let place = place_of(block);
    let name = block
        .get("kind")
        .and_then(|name| name.as_str())
        .map(str::to_owned);
    StatedBlock {
        count: count.and_then(|count| usize::try_from(count).ok()),
        place: place.or_else(|| of_kind(document, &name?)),
    }
}

fn place_of(block: &dyn TableLike) -> Option<(f64, f64)> {
    let start = block.get("start")?.as_table_like()?;
    let number = |key| {
        let item = start.get(key)?;
        item.as_float()
            .or(item.as_integer().map(|whole| whole as f64))
    };
    Some((number(X)?, number(Y)?))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_default()
}

/// Returns a number of single precision as it was written.
fn shortest(number: f64) -> f64 {
    (number * 1e5).round() / 1e5
}

//! The constant description of a run for the page.

use scenario::fault::{
    ArgumentForm, Device, Fault, FaultArgument, FaultRange, FaultSpec, ModeSize, ValueKind,
};
use scenario::mission::registry::Mission;
use scenario::names::ALL;
use scenario::{Scenario, Setup};
use serde_json::{Value, json};

use super::colors;

/// Returns the answer to `GET /api/run`: catalog, setup and possible faults. `mode`, `folder` and `log` depend on the source of the run.
#[must_use]
pub fn about(mode: &str, run: &str, folder: &str, setup: &Setup, log: Value) -> Value {
    let catalog = &setup.catalog;
    let tasks: Vec<Value> = catalog
        .tasks
        .iter()
        .map(|task| {
            json!({"name": task.name, "max_robots": task.max_robots, "priority": task.priority})
        })
        .collect();
    let sets: Vec<Value> = catalog
        .sets
        .iter()
        .map(|set| json!({"name": set.name, "task": set.task}))
        .collect();
    let terms = catalog.mission.vocabulary();
    let mission_faults = terms.faults.iter();
    let mission = json!({
        "name": catalog.mission.name(),
        "columns": terms.columns,
        "events": terms.events,
        "bulletins": terms.bulletins,
        "faults": mission_faults.map(|spec| fault(spec, &setup.scenario)).collect::<Vec<_>>(),
    });
    let robots = setup.scenario.robots.iter().map(|robot| &*robot.name);
    let robot_colors = colors::colors(robots).into_iter().map(colors::Rgb::css);
    let colors = json!({"robots": robot_colors.collect::<Vec<_>>(), "tasks": colors::task_hues()});
    let setup_file = json!(setup);
    json!({
        "mode": mode,
        "run": run,
        "folder": folder,
        "seed": setup_file["seed"],
        "scenario": setup_file["scenario"],
        "alliance": setup_file["alliance"],
        "colors": colors,
        "catalog": {"tasks": tasks, "sets": sets},
        "devices": devices(catalog.mission),
        "skills": catalog.mission.skills(&setup.scenario),
        "momentary": momentary(catalog.mission),
        "faults": Fault::KINDS.map(|kind| fault(&kind.spec, &setup.scenario)),
        "mission": mission,
        "log": log,
    })
}

/// Returns the sensing devices that can fail, in display order.
fn devices(mission: Mission) -> Vec<Value> {
    let devices = Device::names_for(mission).map(|name| {
        json!({
            "name": name,
            "label": Device::display_name(name),
            "tells_lengths": Device::new(name).measures_lengths(mission),
            "tells_heading": name == Device::POSITION,
            "is_optional": Device::is_optional(name, mission),
        })
    });
    devices.collect()
}

/// Returns the names of the faults without a duration.
fn momentary(mission: Mission) -> Vec<&'static str> {
    let mission_names = mission.vocabulary().faults.iter().map(|spec| spec.name);
    let all = Fault::COMMON_NAMES.into_iter().chain(mission_names);
    all.filter(|name| Fault::is_instantaneous_name(name))
        .collect()
}

/// Returns a fault with its arguments. `place` and `item` name the arguments that select a position or an item.
fn fault(spec: &FaultSpec, scenario: &Scenario) -> Value {
    let arguments = spec.arguments.iter().map(|argument| {
        let (stem, unit) = argument.stem_and_unit();
        let range = argument.numbers(scenario.room);
        json!({
            "key": argument.key,
            "label": stem.replace('_', " "),
            "unit": unit,
            "about": argument.about,
            "from": range.map(|range| range.from),
            "to": range.map(|range| range.to),
            "is_whole": range.is_some_and(|range| range.is_whole),
            "default": argument.default,
            "form": form(argument),
            "is_required": argument.is_required(),
            "names": names(argument, scenario),
            "modes": modes(argument),
            "option": match argument.form {
                ArgumentForm::Option(name) | ArgumentForm::Optional(name) => Some(name),
                ArgumentForm::Either | ArgumentForm::Position => None,
            },
            "is_time": argument.range == FaultRange::Time,
        })
    });
    json!({
        "name": spec.name,
        "about": spec.about,
        "arguments": arguments.collect::<Vec<_>>(),
        "place": spec.place(),
        "item": spec.item(),
    })
}

/// Returns the names that an argument accepts; `None` if it is no name.
fn names(argument: &FaultArgument, scenario: &Scenario) -> Option<Vec<String>> {
    let robots = || scenario.robots.iter().map(|robot| robot.name.clone());
    let mission = scenario.mission();
    Some(match argument.range {
        FaultRange::Name => mission.fault_names(scenario, argument.key),
        FaultRange::Robot => robots().collect(),
        FaultRange::From | FaultRange::To => [ALL.to_owned()].into_iter().chain(robots()).collect(),
        FaultRange::Choice(choices) => choices.iter().map(|(name, _)| (*name).to_owned()).collect(),
        FaultRange::Device => Device::names_for(mission).map(str::to_owned).collect(),
        FaultRange::Skill => mission.skills(scenario),
        _ => return None,
    })
}

/// Returns the kind of control for an argument.
fn form(argument: &FaultArgument) -> &'static str {
    match argument.range.value_kind() {
        ValueKind::Name => "name",
        ValueKind::Number => "number",
        ValueKind::Groups => "groups",
        ValueKind::Flag => "flag",
        ValueKind::Mode(_) => "mode",
    }
}

/// Returns the modes of an argument with their sizes; `None` if it is no mode.
fn modes(argument: &FaultArgument) -> Option<Vec<Value>> {
    let FaultRange::Mode(form) = argument.range else {
        return None;
    };
    let modes = form.modes.iter().map(|mode| {
        let (range, words) = match mode.size {
            ModeSize::None => (None, None),
            ModeSize::Number(range) | ModeSize::Error { m: range, .. } => (Some(range), None),
            ModeSize::Word(words) => (None, Some(words)),
        };
        json!({
            "name": mode.name,
            "from": range.map(|range| range.from),
            "to": range.map(|range| range.to),
            "words": words,
            "takes_deg": matches!(mode.size, ModeSize::Error { .. }),
        })
    });
    Some(modes.collect())
}

#[cfg(test)]
mod tests {
    use scenario::testkit::default_setup;

    use super::*;

    /// The drill mission is used only through its declarations.
    #[test]
    fn devices_and_faults_come_from_the_mission() {
        let about = about("live", "r", "runs/r", &default_setup(1), Value::Null);
        let list = |pointer: &str, flag: &str| -> Vec<String> {
            let all = about.pointer(pointer).and_then(Value::as_array).unwrap();
            let selected = all
                .iter()
                .filter(|item| item[flag] == true || flag.is_empty());
            selected
                .map(|it| it["name"].as_str().unwrap_or_default().to_owned())
                .collect()
        };
        let devices = [
            "position",
            "front-border",
            "side-border",
            "avoidance",
            "eye",
            "hand",
            "gripper",
            "ground",
        ];
        assert_eq!(list("/devices", ""), devices);
        assert_eq!(list("/devices", "tells_lengths"), devices[..5]);
        assert_eq!(list("/devices", "tells_heading"), ["position"]);
        assert_eq!(list("/devices", "is_optional"), ["side-border"]);
        let momentary = ["continue", "restart", "move-robot", "shake"];
        assert_eq!(about["momentary"], json!(momentary));
        let shake = &about["mission"]["faults"][0];
        assert_eq!(shake["name"], "shake");
        assert_eq!(shake["place"], json!(["x_m", "y_m"]));
        assert_eq!(shake["item"], Value::Null);
        let argument = |key: &str, label: &str, unit: &str, about: &str| {
            json!({
                "key": key, "label": label, "unit": unit, "about": about,
                "from": 0.0, "to": 12.0, "is_whole": false, "default": null, "names": null,
                "form": "number", "is_required": true, "modes": null, "option": null, "is_time": false,
            })
        };
        assert_eq!(shake["arguments"][0], argument("x_m", "x", "m", "where, m"));
        assert_eq!(
            shake["arguments"][2],
            json!({
                "key": "times", "label": "times", "unit": "", "about": "how often",
                "from": 1.0, "to": 9.0, "is_whole": true, "default": 1.0, "names": null,
                "form": "number", "is_required": false, "modes": null, "option": null, "is_time": false,
            })
        );
    }
}

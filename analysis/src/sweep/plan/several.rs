//! Several missions, each with its faults, as one factor of the design.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Context;
use scenario::limits::whole;
use scenario::{KeyPath, MAX_ROBOTS, Scenario, TomlFile};
use toml::Value;

use super::factors::{CheckedSetting, Columns, class_changes};
use super::file::{FaultClass, MissionFile};
use super::leaves::leaves;
use super::{table_of, vocabulary};
use crate::distinct;
use crate::sweep::design::{Cell, Change, FAULTS, Factor, Level, MISSION, apply_change};

/// The largest amount of work in a scaled mission.
const MAX_SIZE: usize = 10_000;

/// The contents of `[missions]`.
pub(super) struct Missions {
    /// The scenario of each mission with all defaults filled in.
    pub(super) bases: Vec<toml::Table>,
    /// Every mission under every class of faults.
    pub(super) factor: Factor,
}

/// Reads the missions in line order. `common` contains the faults for all missions; `scenario` loads a scenario by name or file.
pub(super) fn missions(
    file: &TomlFile<'_>,
    missions: BTreeMap<String, MissionFile>,
    common: &BTreeMap<String, FaultClass>,
    limit_s: Option<f64>,
    scenario: &impl Fn(&str) -> anyhow::Result<Scenario>,
    (stated, columns): (&mut Vec<CheckedSetting>, &mut Columns),
) -> anyhow::Result<Missions> {
    let at = |name: &str| KeyPath::new(["missions", name]);
    let mut missions: Vec<(String, MissionFile)> = missions.into_iter().collect();
    missions.sort_by_key(|(name, _)| file.line_of(at(name)));
    let classes = classes(file, &missions, common);
    let mut found = Missions {
        bases: Vec::new(),
        factor: Factor {
            columns: vec![MISSION.to_owned()],
            levels: Vec::new(),
        },
    };
    if !classes.is_empty() {
        found.factor.columns.push(FAULTS.to_owned());
    }
    for (name, mission) in missions {
        let base = base(file, &at(&name), &mission, limit_s, scenario)?;
        let whole = Change {
            path: Vec::new(),
            value: Value::Table(base.clone()),
        };
        found.bases.push(base);
        if classes.is_empty() {
            found.factor.levels.push(Level {
                cells: vec![Cell::Text(name)],
                changes: vec![whole],
            });
            continue;
        }
        for class in &classes {
            let specific = mission.faults.get(class);
            let Some(faults) = specific.or_else(|| common.get(class)) else {
                let what =
                    format!("the mission lacks the faults '{class}' that other missions have");
                let remedy = format!(
                    "write [missions.{name}.faults.{class}], or [faults.{class}] for all missions"
                );
                return Err(file.error_at(at(&name), what, remedy).into());
            };
            let place = match specific {
                Some(_) => at(&name).key("faults").key(class),
                None => KeyPath::new(["faults", class]),
            };
            let mut changes = vec![whole.clone()];
            changes.extend(class_changes(file, &place, faults, columns)?);
            stated.push(CheckedSetting {
                at: place,
                changes: changes.clone(),
            });
            found.factor.levels.push(Level {
                cells: vec![Cell::Text(name.clone()), Cell::Text(class.clone())],
                changes,
            });
        }
    }
    Ok(found)
}

/// Returns all classes of faults in the order of their first line.
fn classes(
    file: &TomlFile<'_>,
    missions: &[(String, MissionFile)],
    common: &BTreeMap<String, FaultClass>,
) -> Vec<String> {
    let for_all = common.keys().map(|class| {
        let line = file.line_of(["faults", class]);
        (line, class)
    });
    let for_one = missions.iter().flat_map(|(name, mission)| {
        mission
            .faults
            .keys()
            .map(move |class| (file.line_of(["missions", name, "faults", class]), class))
    });
    let all: BTreeSet<(usize, &String)> = for_all.chain(for_one).collect();
    distinct(all.into_iter().map(|(_, class)| class.clone()))
}

fn base(
    file: &TomlFile<'_>,
    at: &KeyPath,
    mission: &MissionFile,
    limit_s: Option<f64>,
    scenario: &impl Fn(&str) -> anyhow::Result<Scenario>,
) -> anyhow::Result<toml::Table> {
    let below = |name: &str| at.key(name);
    let place = |at: &KeyPath| format!("{}:{}", file.name(), file.line_of(at));
    let mut base = match (mission.robots, mission.size, &mission.scenario) {
        (None, None, None) => vocabulary().default_scenario()?,
        (None, None, Some(name)) => scenario(name).with_context(|| place(&below("scenario")))?,
        _ => sized(file, at, mission)?,
    };
    if let Some(limit_s) = limit_s {
        base.limit_s = limit_s;
    }
    let mut table = table_of(&base)?;
    let mut latest = below("scenario");
    for leaf in leaves(file, &below("set"), mission.set.clone(), |_| false) {
        latest = leaf.at.clone();
        apply_change(&mut table, &leaf.change()).with_context(|| place(&latest))?;
        Scenario::from_table(&table, &vocabulary()).with_context(|| place(&latest))?;
    }
    let complete = Scenario::from_table(&table, &vocabulary()).with_context(|| place(&latest))?;
    table_of(&complete)
}

/// Returns a mission scaled to the given number of robots and amount of work.
fn sized(file: &TomlFile<'_>, at: &KeyPath, mission: &MissionFile) -> anyhow::Result<Scenario> {
    let vocabulary = vocabulary();
    let robots = mission.robots.unwrap_or(3);
    let size = mission.size.unwrap_or((2 * robots).div_ceil(3));
    for (name, number, most) in [("robots", robots, MAX_ROBOTS), ("size", size, MAX_SIZE)] {
        let checked = whole(1, most as i64, "").check(at.key(name), number as f64);
        checked.map_err(|problem| file.locate(problem))?;
    }
    let mut families = vocabulary
        .missions
        .iter()
        .filter(|mission| mission.family(1, 1).is_some());
    let known: Vec<&str> = families
        .clone()
        .map(|mission| mission.scenario_name())
        .collect();
    let family = match &mission.scenario {
        None => families.next(),
        Some(name) => families.find(|mission| mission.scenario_name() == name),
    };
    let Some(scenario) = family.and_then(|mission| mission.family(robots, size)) else {
        let what = "robots and size require a mission that can be scaled";
        let remedy = format!("write scenario = '{}'", known.join("' or '"));
        return Err(file.error_at(at, what, remedy).into());
    };
    Ok(scenario)
}

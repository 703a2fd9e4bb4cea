//! The factors of the design, as read from the plan file.

use std::collections::BTreeMap;

use scenario::fault::Faults;
use scenario::limits::whole;
use scenario::{KeyPath, Preset, Problem, TomlFile};
use serde::Deserialize;
use toml::Value;

use super::file::FaultClass;
use super::leaves::{Leaf, leaves, path};
use super::seeds::Seeds;
use super::{MAX_RUNS, table_of};
use crate::random_mission::RandomMission;
use crate::sweep::design::{Cell, Change, FAULTS, Factor, Level, PRESET, SEED};
use crate::sweep::sampling::{Distribution, draw};

/// One setting of a factor, which is validated by itself.
pub(super) struct CheckedSetting {
    pub(super) at: KeyPath,
    pub(super) changes: Vec<Change>,
}

pub(super) fn grid(
    file: &TomlFile<'_>,
    leaf: Leaf,
    stated: &mut Vec<CheckedSetting>,
) -> Result<Factor, Problem> {
    let Leaf { at, path, value } = leaf;
    let Value::Array(values) = value else {
        let what = format!("{value} is not a list of values");
        return Err(file.error_at(&at, what, format!("write [{value}], or more of them")));
    };
    distinct(file, &at, &values)?;
    let mut levels = Vec::new();
    for (place, value) in values.into_iter().enumerate() {
        let level = Level::of(&path, value);
        stated.push(CheckedSetting {
            at: at.index(place),
            changes: level.changes.clone(),
        });
        levels.push(level);
    }
    Ok(Factor {
        columns: vec![path.join(".")],
        levels,
    })
}

impl Level {
    fn of(path: &[String], value: Value) -> Self {
        Self {
            cells: vec![Cell::from_toml(&value)],
            changes: vec![Change {
                path: path.to_vec(),
                value,
            }],
        }
    }

    fn combined(levels: impl IntoIterator<Item = Self>) -> Self {
        let mut all = Self {
            cells: Vec::new(),
            changes: Vec::new(),
        };
        for level in levels {
            all.cells.extend(level.cells);
            all.changes.extend(level.changes);
        }
        all
    }
}

/// The positions of the swept keys in the file and their paths in the scenario.
pub(super) type Columns = Vec<(KeyPath, Vec<String>)>;

pub(super) fn list(
    file: &TomlFile<'_>,
    points: Vec<toml::Table>,
    stated: &mut Vec<CheckedSetting>,
    columns: &mut Columns,
) -> Result<Option<Factor>, Problem> {
    let mut factor: Option<Factor> = None;
    for (place, point) in points.into_iter().enumerate() {
        let at = KeyPath::new(["list"]).index(place);
        let mut leaves = leaves(file, &at, point, |_| false);
        // The keys of a point may be in any order.
        leaves.sort_by(|a, b| a.path.cmp(&b.path));
        let names: Vec<String> = leaves.iter().map(|leaf| leaf.path.join(".")).collect();
        if names.is_empty() {
            let remedy = "write a key of the scenario with its value";
            return Err(file.error_at(&at, "the point is empty", remedy));
        }
        let known = factor.get_or_insert_with(|| {
            let places = leaves.iter();
            columns.extend(places.map(|leaf| (leaf.at.clone(), leaf.path.clone())));
            Factor {
                columns: names.clone(),
                levels: Vec::new(),
            }
        });
        if known.columns != names {
            let what = format!("the point has the keys {}", names.join(", "));
            let remedy = format!(
                "write the same keys in every point: {}",
                known.columns.join(", ")
            );
            return Err(file.error_at(&at, what, remedy));
        }
        let leaves = leaves.into_iter();
        let level = Level::combined(leaves.map(|leaf| Level::of(&leaf.path, leaf.value)));
        if known.levels.contains(&level) {
            return Err(file.error_at(&at, "the point occurs twice", "write it once"));
        }
        stated.push(CheckedSetting {
            at,
            changes: level.changes.clone(),
        });
        known.levels.push(level);
    }
    Ok(factor)
}

pub(super) fn sample(
    file: &TomlFile<'_>,
    mut table: toml::Table,
    stated: &mut Vec<CheckedSetting>,
    columns: &mut Columns,
) -> Result<Option<Factor>, Problem> {
    let at = KeyPath::new(["random"]);
    let mut number = |name: &str, default: Option<i64>| {
        let at = ["random", name];
        match (table.remove(name), default) {
            (Some(Value::Integer(number)), _) if number >= 0 => Ok(number as u64),
            (Some(value), _) => Err(file.error_at(
                at,
                format!("{value} is not valid"),
                "write a whole number of at least 0",
            )),
            (None, Some(default)) => Ok(default as u64),
            (None, None) => {
                Err(file.error_at(at, "the key is missing", "write the number of points"))
            }
        }
    };
    let (count, seed) = (number("n", None)?, number("seed", Some(1))?);
    let count = usize::try_from(count).unwrap_or(usize::MAX);
    let checked = whole(1, MAX_RUNS as i64, "").check(["random", "n"], count as f64);
    checked.map_err(|problem| file.locate(problem))?;
    let states_range = |table: &toml::Table| {
        let mut keys = ["min", "max", "choose"].iter();
        keys.any(|key| table.contains_key(*key))
    };
    let leaves = leaves(file, &at, table, states_range);
    if leaves.is_empty() {
        let remedy = "write a key of the scenario with { min = …, max = … } or { choose = […] }";
        return Err(file.error_at(&at, "no key is drawn", remedy));
    }
    let mut names = Vec::new();
    let mut drawn = Vec::new();
    for leaf in leaves {
        let distribution = distribution(file, &leaf)?;
        for value in distribution.limits() {
            stated.push(CheckedSetting {
                at: leaf.at.clone(),
                changes: Level::of(&leaf.path, value).changes,
            });
        }
        let name = leaf.path.join(".");
        let values = draw(seed, &name, &distribution, count).into_iter();
        let levels = values.map(|value| Level::of(&leaf.path, value));
        drawn.push(levels.collect::<Vec<_>>());
        names.push(name);
        columns.push((leaf.at, leaf.path));
    }
    let point = |place: usize| Level::combined(drawn.iter().map(|levels| levels[place].clone()));
    Ok(Some(Factor {
        columns: names,
        levels: (0..count).map(point).collect(),
    }))
}

fn distribution(file: &TomlFile<'_>, leaf: &Leaf) -> Result<Distribution, Problem> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Levels {
        min: Option<Value>,
        max: Option<Value>,
        #[serde(default)]
        log: bool,
        choose: Option<Vec<Value>>,
    }
    let forms = "write { min = …, max = … }, optionally with log = true, or { choose = […] }";
    let mistake = |what: String| file.error_at(&leaf.at, what, forms);
    let other = || mistake(format!("{} does not describe a distribution", leaf.value));
    let range: Levels = leaf.value.clone().try_into().map_err(|_| other())?;
    match range {
        Levels {
            min: None,
            max: None,
            log: false,
            choose: Some(values),
        } => {
            distinct(file, &leaf.at, &values)?;
            Ok(Distribution::Choice(values))
        }
        Levels {
            min: Some(Value::Integer(min)),
            max: Some(Value::Integer(max)),
            log: false,
            choose: None,
        } if min < max => Ok(Distribution::Integer(min, max)),
        Levels {
            min: Some(min),
            max: Some(max),
            log,
            choose: None,
        } => {
            let refused = |what| {
                Err(mistake(format!(
                    "from {min} to {max} is not a range of {what}"
                )))
            };
            match (
                Cell::from_toml(&min).number(),
                Cell::from_toml(&max).number(),
            ) {
                (Some(min), Some(max)) if min < max && !log => Ok(Distribution::Uniform(min, max)),
                (Some(min), Some(max)) if min < max && min > 0.0 => Ok(Distribution::Log(min, max)),
                (Some(_), Some(_)) if log => refused("positive numbers"),
                _ => refused("numbers"),
            }
        }
        _ => Err(other()),
    }
}

pub(super) fn presets(file: &TomlFile<'_>, presets: &[Preset]) -> Result<Factor, Problem> {
    let names = presets
        .iter()
        .filter_map(|preset| Value::try_from(preset).ok());
    let names: Vec<Value> = names.collect();
    distinct(file, &KeyPath::new(["presets"]), &names)?;
    let levels = names
        .into_iter()
        .map(|name| Level::of(&path("alliance.preset"), name));
    Ok(Factor {
        columns: vec![PRESET.to_owned()],
        levels: levels.collect(),
    })
}

/// Returns the changes of the scenario under a class of faults, and adds the keys that its `set` varies to the columns.
/// Several classes may set the same key.
pub(super) fn class_changes(
    file: &TomlFile<'_>,
    at: &KeyPath,
    class: &FaultClass,
    columns: &mut Columns,
) -> anyhow::Result<Vec<Change>> {
    let faults = Faults {
        timeline: class.timeline.clone(),
        random: class.random,
    };
    let mut changes = vec![Change {
        path: path("faults"),
        value: Value::Table(table_of(&faults)?),
    }];
    for leaf in leaves(file, &at.key("set"), class.set.clone(), |_| false) {
        if !columns.iter().any(|(_, path)| *path == leaf.path) {
            columns.push((leaf.at.clone(), leaf.path.clone()));
        }
        changes.push(leaf.change());
    }
    Ok(changes)
}

/// Creates the factor of the classes of faults. Each class replaces the scenario's faults.
pub(super) fn faults(
    file: &TomlFile<'_>,
    classes: BTreeMap<String, FaultClass>,
    stated: &mut Vec<CheckedSetting>,
    columns: &mut Columns,
) -> anyhow::Result<Factor> {
    let mut levels = Vec::new();
    // A key that also another factor varies must stay a second column.
    let mut set = Columns::new();
    for (name, class) in classes {
        let at = KeyPath::new(["faults", &name]);
        let changes = class_changes(file, &at, &class, &mut set)?;
        stated.push(CheckedSetting {
            at,
            changes: changes.clone(),
        });
        levels.push(Level {
            cells: vec![Cell::Text(name)],
            changes,
        });
    }
    columns.extend(set);
    Ok(Factor {
        columns: vec![FAULTS.to_owned()],
        levels,
    })
}

pub(super) fn seeds(file: &TomlFile<'_>, Seeds(seeds): Seeds) -> Result<Factor, Problem> {
    let values: Vec<Value> = seeds.iter().copied().map(Value::Integer).collect();
    distinct(file, &KeyPath::new(["seeds"]), &values)?;
    let levels = seeds.into_iter().map(|seed| Level {
        cells: vec![Cell::Integer(seed)],
        changes: Vec::new(),
    });
    Ok(Factor {
        columns: vec![SEED.to_owned()],
        levels: levels.collect(),
    })
}

/// Returns the columns that `[random_mission]` draws, so that no other factor varies them.
pub(super) fn drawn(file: &TomlFile<'_>, mission: &RandomMission) -> Result<Columns, Problem> {
    let at = |name: &str| KeyPath::new(["random_mission", name]);
    let checked = mission.check();
    checked.map_err(|problem| file.locate(problem.under(["random_mission"])))?;
    let section = mission.mission.iter();
    let section = section.map(|name| (at("mission"), path(name)));
    let keys = [
        ("room", mission.room.is_some()),
        ("obstacles", mission.obstacles.is_some()),
        ("robots", mission.robots.is_some()),
        ("faults", mission.faults.is_some()),
    ];
    let drawn = keys.into_iter().filter(|(_, drawn)| *drawn);
    let drawn = drawn.map(|(name, _)| (at(name), path(name)));
    Ok(drawn.chain(section).collect())
}

/// Returns the columns that `randomise` draws with `start`, so that no other factor varies them.
pub(super) fn drawn_starts(bases: &[toml::Table]) -> Columns {
    let robots = |base: &toml::Table| base.get("robots").and_then(Value::as_array).map(Vec::len);
    let most = bases.iter().filter_map(robots).max().unwrap_or(0);
    let at = KeyPath::new(["randomise"]);
    let start = |number| (at.clone(), path(&format!("robots.{number}.start")));
    (0..most).map(start).collect()
}

/// Checks that a list is not empty and has no duplicates, which would count twice.
fn distinct(file: &TomlFile<'_>, at: &KeyPath, values: &[Value]) -> Result<(), Problem> {
    if values.is_empty() {
        let remedy = "write at least one value, or leave the key out";
        return Err(file.error_at(at, "the list is empty", remedy));
    }
    let mut seen = std::collections::BTreeSet::new();
    match values.iter().find(|value| !seen.insert(value.to_string())) {
        Some(value) => {
            Err(file.error_at(at, format!("{value} occurs twice"), "write each value once"))
        }
        None => Ok(()),
    }
}

/// Checks that no key is varied twice; one value would overwrite the other.
pub(super) fn disjoint(file: &TomlFile<'_>, columns: &Columns) -> Result<(), Problem> {
    for (place, (at, path)) in columns.iter().enumerate() {
        let mut others = columns[..place].iter();
        let same = others.find(|(_, other)| other.starts_with(path) || path.starts_with(other));
        if let Some((other, _)) = same {
            let what = format!("line {} varies the same key", file.line_of(other));
            return Err(file.error_at(at, what, "vary each key in one place"));
        }
    }
    Ok(())
}

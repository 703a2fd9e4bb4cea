//! Which runs a sweep is made of: every combination of the levels of its factors, numbered.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The column of the preset.
pub const PRESET: &str = "preset";

/// The column of the mission.
pub const MISSION: &str = "mission";

/// The column of the fault plan.
pub const FAULTS: &str = "faults";

/// The column of the seed.
pub const SEED: &str = "seed";

/// All factors. Runs are numbered from 0, and the last factor changes fastest; that is the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Design {
    /// In the order of the columns.
    pub factors: Vec<Factor>,
}

/// What is varied together: one key of the scenario, or several as a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Factor {
    /// Names of its columns: keys of the scenario, [`MISSION`], [`PRESET`], [`FAULTS`] or [`SEED`].
    pub columns: Vec<String>,
    /// What it is set to in turn; never empty.
    pub levels: Vec<Level>,
}

/// One setting of a factor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// How it reads, by column.
    pub cells: Vec<Cell>,
    /// What it changes in the scenario. Only whoever runs it needs them.
    #[serde(skip)]
    pub changes: Vec<Change>,
}

/// A value of the scenario, and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Keys from the scenario's top down; a number is a place in an array. Without any, the whole scenario.
    pub path: Vec<String>,
    /// What stands there then.
    pub value: toml::Value,
}

/// A setting in a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    /// True or false.
    Flag(bool),
    /// A whole number.
    Integer(i64),
    /// A finite number.
    Number(f64),
    /// A name, or whatever else there is, as TOML.
    Text(String),
}

impl Cell {
    /// Of a value of a scenario.
    #[must_use]
    pub fn of(value: &toml::Value) -> Self {
        match value {
            toml::Value::Boolean(flag) => Self::Flag(*flag),
            toml::Value::Integer(number) => Self::Integer(*number),
            toml::Value::Float(number) if number.is_finite() => Self::Number(*number),
            toml::Value::String(text) => Self::Text(text.clone()),
            other => Self::Text(other.to_string()),
        }
    }

    /// As a number, if it is one.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(number) => Some(*number as f64),
            Self::Number(number) => Some(*number),
            Self::Flag(_) | Self::Text(_) => None,
        }
    }
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(flag) => flag.fmt(f),
            Self::Integer(number) => number.fmt(f),
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl Design {
    /// Number of runs; `None` if it is beyond all numbers.
    #[must_use]
    pub fn runs(&self) -> Option<usize> {
        let mut levels = self.factors.iter().map(|factor| factor.levels.len());
        levels.try_fold(1_usize, usize::checked_mul)
    }

    /// Number of runs that differ in nothing but the seed.
    #[must_use]
    pub fn repetitions(&self) -> usize {
        self.factors.last().map_or(1, |seeds| seeds.levels.len())
    }

    /// Which level of each factor a run has.
    #[must_use]
    pub fn places(&self, run: usize) -> Vec<usize> {
        let mut rest = run;
        let mut places: Vec<usize> = self
            .factors
            .iter()
            .rev()
            .map(|factor| {
                let place = rest % factor.levels.len();
                rest /= factor.levels.len();
                place
            })
            .collect();
        places.reverse();
        places
    }

    /// The level of each factor of a run.
    pub fn levels(&self, run: usize) -> impl Iterator<Item = &Level> {
        let places = self.places(run).into_iter();
        let factors = self.factors.iter();
        factors
            .zip(places)
            .map(|(factor, place)| &factor.levels[place])
    }

    /// Names of all columns.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let factors = self.factors.iter();
        factors.flat_map(|factor| factor.columns.iter().map(String::as_str))
    }

    /// The settings of a run, by column.
    pub fn cells(&self, run: usize) -> impl Iterator<Item = &Cell> {
        self.levels(run).flat_map(|level| &level.cells)
    }

    /// The seed of a run.
    #[must_use]
    pub fn seed(&self, run: usize) -> u64 {
        match self.cells(run).last() {
            Some(Cell::Integer(seed)) => u64::try_from(*seed).unwrap_or_default(),
            _ => 0,
        }
    }
}

/// Puts a value into a scenario.
///
/// # Errors
/// What is wrong with its path, and what would be right.
pub fn change(scenario: &mut toml::Table, change: &Change) -> Result<(), String> {
    let Some((last, way)) = change.path.split_last() else {
        if let toml::Value::Table(whole) = &change.value {
            scenario.clone_from(whole);
        }
        return Ok(());
    };
    let Some((first, way)) = way.split_first() else {
        scenario.insert(last.clone(), change.value.clone());
        return Ok(());
    };
    let empty = || toml::Value::Table(toml::Table::new());
    let mut place = scenario.entry(first.clone()).or_insert_with(empty);
    for key in way {
        place = match place {
            toml::Value::Table(table) => table.entry(key.clone()).or_insert_with(empty),
            other => element(other, key, &change.path)?,
        };
    }
    match place {
        toml::Value::Table(table) => {
            table.insert(last.clone(), change.value.clone());
        }
        other => *element(other, last, &change.path)? = change.value.clone(),
    }
    Ok(())
}

/// An element of an array.
fn element<'v>(
    value: &'v mut toml::Value,
    key: &str,
    path: &[String],
) -> Result<&'v mut toml::Value, String> {
    let path = path.join(".");
    let toml::Value::Array(array) = value else {
        return Err(format!(
            "{path}: there is nothing below the {} before '{key}'; `alliance scenarios reference` has every key",
            value.type_str()
        ));
    };
    let count = array.len();
    let there = match count {
        0 => "it is empty".to_owned(),
        _ => format!("use a place from 0 to {}", count - 1),
    };
    let found = key
        .parse()
        .ok()
        .and_then(|place: usize| array.get_mut(place));
    found.ok_or_else(|| format!("{path}: the array has no place '{key}'; {there}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(name: &str, levels: &[i64]) -> Factor {
        Factor {
            columns: vec![name.to_owned()],
            levels: levels
                .iter()
                .map(|level| Level {
                    cells: vec![Cell::Integer(*level)],
                    changes: Vec::new(),
                })
                .collect(),
        }
    }

    #[test]
    fn every_combination_once_and_the_seed_changes_fastest() {
        let design = Design {
            factors: vec![
                factor("a", &[1, 2]),
                factor("b", &[5]),
                factor(SEED, &[7, 8, 9]),
            ],
        };
        assert_eq!(design.runs(), Some(6));
        assert_eq!(design.repetitions(), 3);
        let runs: Vec<String> = (0..6)
            .map(|run| {
                let cells: Vec<String> = design.cells(run).map(Cell::to_string).collect();
                cells.join(" ")
            })
            .collect();
        assert_eq!(runs, ["1 5 7", "1 5 8", "1 5 9", "2 5 7", "2 5 8", "2 5 9"]);
        assert_eq!(design.places(5), [1, 0, 2]);
        assert_eq!(design.seed(4), 8);
    }

    #[test]
    fn more_runs_than_there_are_numbers() {
        let many: Vec<i64> = (0..1 << 16).collect();
        let factors = ["a", "b", "c", "d"].map(|name| factor(name, &many));
        let design = Design {
            factors: factors.into(),
        };
        assert_eq!(design.runs(), None);
    }

    #[test]
    fn cells_survive_json() {
        for cell in [
            Cell::Flag(true),
            Cell::Integer(4),
            Cell::Number(4.0),
            Cell::Number(0.1),
            Cell::Text("4".to_owned()),
            Cell::of(&toml::Value::Float(f64::INFINITY)),
        ] {
            let json = serde_json::to_string(&cell).unwrap();
            assert_eq!(serde_json::from_str::<Cell>(&json).unwrap(), cell, "{json}");
        }
    }

    #[track_caller]
    fn check(path: &str, expected: Result<&str, &str>) {
        let mut scenario: toml::Table =
            toml::from_str("name = 'a'\n[waste]\nspills = [{ items = 1 }, { items = 2 }]").unwrap();
        let changed = change(
            &mut scenario,
            &Change {
                path: path.split('.').map(str::to_owned).collect(),
                value: toml::Value::Integer(9),
            },
        );
        match expected {
            Ok(text) => {
                assert_eq!(changed, Ok(()));
                assert_eq!(scenario, toml::from_str(text).unwrap());
            }
            Err(error) => assert_eq!(changed.unwrap_err(), error),
        }
    }

    #[test]
    fn values_at_any_depth() {
        let spills = "spills = [{ items = 1 }, { items = 2 }]";
        check("name", Ok(&format!("name = 9\n[waste]\n{spills}")));
        check(
            "room.width_m",
            Ok(&format!("name = 'a'\nroom.width_m = 9\n[waste]\n{spills}")),
        );
        check(
            "waste.spills.1.items",
            Ok("name = 'a'\n[waste]\nspills = [{ items = 1 }, { items = 9 }]"),
        );
        check(
            "waste.spills.0",
            Ok("name = 'a'\n[waste]\nspills = [9, { items = 2 }]"),
        );
        check(
            "waste.spills.2.items",
            Err("waste.spills.2.items: the array has no place '2'; use a place from 0 to 1"),
        );
        check(
            "name.first",
            Err(
                "name.first: there is nothing below the string before 'first'; `alliance scenarios reference` has every key",
            ),
        );
    }
}

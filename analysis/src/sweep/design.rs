//! The runs of a sweep: the numbered combinations of all levels of its factors.

use std::fmt;

use scenario::{KeyPath, Problem};
use serde::{Deserialize, Serialize};

pub const PRESET: &str = "preset";

pub const MISSION: &str = "mission";

pub const FAULTS: &str = "faults";

pub const SEED: &str = "seed";

/// The number of characters up to which a table shows a list.
const LONGEST_LIST: usize = 32;

/// The factors of a sweep. Runs are numbered from 0; the last factor is the seed and changes fastest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Design {
    pub factors: Vec<Factor>,
}

/// A set of scenario keys that vary together: one key, or several that form a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Factor {
    /// The names of its columns: scenario keys, [`MISSION`], [`PRESET`], [`FAULTS`] or [`SEED`].
    pub columns: Vec<String>,
    /// The settings of the factor; never empty.
    pub levels: Vec<Level>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// The displayed values, one per column.
    pub cells: Vec<Cell>,
    /// The changes of the scenario. They are not serialized; only the process that runs the sweep needs them.
    #[serde(skip)]
    pub changes: Vec<Change>,
}

/// A new value for one place of the scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Keys from the top of the scenario downwards. A number is an array index. An empty path replaces the entire scenario.
    pub path: Vec<String>,
    pub value: toml::Value,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Cell {
    Flag(bool),
    Integer(i64),
    Number(f64),
    /// A name, or any other TOML value as text.
    Text(String),
}

impl Cell {
    #[must_use]
    pub fn from_toml(value: &toml::Value) -> Self {
        match value {
            toml::Value::Boolean(flag) => Self::Flag(*flag),
            toml::Value::Integer(number) => Self::Integer(*number),
            toml::Value::Float(number) if number.is_finite() => Self::Number(*number),
            toml::Value::String(text) => Self::Text(text.clone()),
            other => Self::Text(other.to_string()),
        }
    }

    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(number) => Some(*number as f64),
            Self::Number(number) => Some(*number),
            Self::Flag(_) | Self::Text(_) => None,
        }
    }

    /// Returns the value for tables and labels: of a long list, such as the robots of a team, the number of entries.
    #[must_use]
    pub fn short(&self) -> String {
        short(&self.to_string())
    }
}

/// Returns the text of a value for tables and labels, as [`Cell::short`].
#[must_use]
pub fn short(text: &str) -> String {
    let is_long = text.chars().count() > LONGEST_LIST;
    let table = || toml::from_str::<toml::Table>(&format!("list = {text}")).ok();
    let table = is_long.then(table).flatten();
    let entries = table.and_then(|table| Some(table["list"].as_array()?.len()));
    entries.map_or_else(|| text.to_owned(), |entries| format!("{entries} entries"))
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
    /// Returns the number of runs, or `None` on overflow.
    #[must_use]
    pub fn runs(&self) -> Option<usize> {
        let mut levels = self.factors.iter().map(|factor| factor.levels.len());
        levels.try_fold(1_usize, usize::checked_mul)
    }

    #[must_use]
    pub fn seeds_per_condition(&self) -> usize {
        self.factors.last().map_or(1, |seeds| seeds.levels.len())
    }

    #[must_use]
    pub fn level_indices(&self, run: usize) -> Vec<usize> {
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

    pub fn levels(&self, run: usize) -> impl Iterator<Item = &Level> {
        let places = self.level_indices(run).into_iter();
        let factors = self.factors.iter();
        factors
            .zip(places)
            .map(|(factor, place)| &factor.levels[place])
    }

    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let factors = self.factors.iter();
        factors.flat_map(|factor| factor.columns.iter().map(String::as_str))
    }

    pub fn cells(&self, run: usize) -> impl Iterator<Item = &Cell> {
        self.levels(run).flat_map(|level| &level.cells)
    }

    #[must_use]
    pub fn seed(&self, run: usize) -> u64 {
        match self.cells(run).last() {
            Some(Cell::Integer(seed)) => u64::try_from(*seed).unwrap_or_default(),
            _ => 0,
        }
    }
}

/// Applies a change to a scenario.
///
/// # Errors
/// Returns the problem with the path and its remedy.
pub fn apply_change(scenario: &mut toml::Table, change: &Change) -> Result<(), Problem> {
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

/// Returns the array element with index `key`.
fn element<'v>(
    value: &'v mut toml::Value,
    key: &str,
    path: &[String],
) -> Result<&'v mut toml::Value, Problem> {
    let at = KeyPath::verbatim(path.join("."));
    let toml::Value::Array(array) = value else {
        let kind = value.type_str();
        let what = format!("the value above '{key}' has the type {kind} and no keys");
        let remedy = "`alliance list scenarios reference` has every key";
        return Err(Problem::at(at, what, remedy));
    };
    let count = array.len();
    let there = match count {
        0 => "it is empty".to_owned(),
        _ => format!("use an index from 0 to {}", count - 1),
    };
    let found = key
        .parse()
        .ok()
        .and_then(|place: usize| array.get_mut(place));
    let what = || format!("the array has no index '{key}'");
    found.ok_or_else(|| Problem::at(at, what(), there))
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
    fn a_long_list_is_shown_by_its_length() {
        let team = "[{ name = \"r1\" }, { name = \"r2\" }, { name = \"r3\" }]";
        assert_eq!(Cell::Text(team.to_owned()).short(), "3 entries");
        for text in ["[1, 2]", "a name of more than thirty-two letters", ""] {
            assert_eq!(short(text), text);
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
        assert_eq!(design.seeds_per_condition(), 3);
        let runs = [0, 1, 2, 3, 4, 5].map(|run| {
            let cells: Vec<String> = design.cells(run).map(Cell::to_string).collect();
            cells.join(" ")
        });
        assert_eq!(runs, ["1 5 7", "1 5 8", "1 5 9", "2 5 7", "2 5 8", "2 5 9"]);
        assert_eq!(design.level_indices(5), [1, 0, 2]);
        assert_eq!(design.seed(4), 8);
    }

    #[test]
    fn too_many_combinations_give_no_number_of_runs() {
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
            Cell::from_toml(&toml::Value::Float(f64::INFINITY)),
        ] {
            let json = serde_json::to_string(&cell).unwrap();
            assert_eq!(serde_json::from_str::<Cell>(&json).unwrap(), cell, "{json}");
        }
    }

    #[test]
    fn changes_apply_at_any_depth() {
        let spills = "spills = [{ items = 1 }, { items = 2 }]";
        let changed = |path: &str| {
            let mut scenario: toml::Table =
                toml::from_str(&format!("name = 'a'\n[waste]\n{spills}")).unwrap();
            let path = path.split('.').map(str::to_owned).collect();
            let value = toml::Value::Integer(9);
            apply_change(&mut scenario, &Change { path, value }).map(|()| scenario)
        };
        for (path, text) in [
            ("name", format!("name = 9\n[waste]\n{spills}")),
            (
                "room.width_m",
                format!("name = 'a'\nroom.width_m = 9\n[waste]\n{spills}"),
            ),
            (
                "waste.spills.1.items",
                format!("name = 'a'\n[waste]\n{}", spills.replace('2', "9")),
            ),
            (
                "waste.spills.0",
                "name = 'a'\n[waste]\nspills = [9, { items = 2 }]".to_owned(),
            ),
        ] {
            assert_eq!(changed(path).unwrap(), toml::from_str(&text).unwrap());
        }
        for (path, error) in [
            (
                "waste.spills.2.items",
                "the array has no index '2'; use an index from 0 to 1",
            ),
            (
                "name.first",
                "the value above 'first' has the type string and no keys; `alliance list scenarios reference` has every key",
            ),
        ] {
            let found = changed(path).unwrap_err().to_string();
            assert_eq!(found, format!("{path}: {error}"));
        }
    }
}

//! A change of one item in the text of a scenario.

use std::collections::{BTreeMap, BTreeSet};

use scenario::{Problem, Room, Scenario};
use serde::Deserialize;
use serde_json::{Value, json};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike};

use super::document::{self, Tables};
use super::kinds::{Fresh, ItemKind, Place, X, Y};
use super::unknown;

/// Numbers are rounded to the inverse of this unit: 1 µm, below the resolution of a large room.
const ROUNDING: f64 = 1e6;

/// Numbers of an item by key. A place is always `x_m` and `y_m`.
pub type Numbers = BTreeMap<String, f64>;

/// A change of one item.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Change {
    Add {
        kind: String,
        /// The name of the mission's kind, for items that have one; by default the first.
        #[serde(default)]
        variant: Option<String>,
        values: Numbers,
    },
    Set {
        kind: String,
        index: usize,
        values: Numbers,
    },
    Delete {
        kind: String,
        index: usize,
    },
}

impl Change {
    /// Returns the changed text of a scenario.
    ///
    /// # Errors
    /// If the item does not exist, or must not be deleted.
    pub fn apply(&self, text: &str, scenario: &Scenario) -> Result<String, Problem> {
        let mut document = parse(text)?;
        let (Self::Add { kind, .. } | Self::Set { kind, .. } | Self::Delete { kind, .. }) = self;
        let kind = ItemKind::find(kind).ok_or_else(|| unknown(kind))?;
        if kind.is_list {
            state_list(&mut document, kind, scenario)?;
        }
        match self {
            Self::Add {
                variant, values, ..
            } => {
                let table = new_item(&mut document, kind, variant.as_deref(), scenario)?;
                add(&mut document, kind, table, values, &scenario.room)?;
            }
            Self::Set { index, values, .. } => {
                let table = table(&mut document, kind, *index).ok_or_else(|| unknown(kind.name))?;
                write(kind, table, values, &scenario.room)?;
            }
            Self::Delete { index, .. } => delete(&mut document, kind, *index)?,
        }
        Ok(document.to_string())
    }
}

fn parse(text: &str) -> Result<DocumentMut, Problem> {
    let parsed = text.parse::<DocumentMut>();
    parsed.map_err(|error| Problem::of_value(error.message(), ""))
}

/// Writes a list that the text does not state: with its default entries, because one stated entry replaces them all.
fn state_list(
    document: &mut DocumentMut,
    kind: &ItemKind,
    scenario: &Scenario,
) -> Result<(), Problem> {
    if Tables::find(document, kind.path).is_some() {
        return Ok(());
    }
    let complete = scenario.to_toml();
    let complete = complete.map_err(|error| Problem::of_value(error.to_string(), ""))?;
    let mut complete = parse(&complete)?;
    let defaults = document::find(&mut complete, kind.path).filter(|_| kind.needs_one);
    let mut list = defaults.map_or_else(
        || Item::ArrayOfTables(ArrayOfTables::new()),
        |list| list.clone(),
    );
    document::forget_positions(&mut list);
    document::insert(document, kind.path, list).ok_or_else(|| unknown(kind.name))
}

/// Returns the table of an item.
fn table<'d>(
    document: &'d mut DocumentMut,
    kind: &ItemKind,
    index: usize,
) -> Option<&'d mut dyn TableLike> {
    if kind.is_list {
        return Tables::find(document, kind.path)?.into_entry(index);
    }
    if document::find(document, kind.path).is_none() {
        document::insert(document, kind.path, Item::Table(Table::new()))?;
    }
    document::find(document, kind.path)?.as_table_like_mut()
}

/// Returns the contents of a new item besides its numbers.
fn new_item(
    document: &mut DocumentMut,
    kind: &ItemKind,
    variant: Option<&str>,
    scenario: &Scenario,
) -> Result<Table, Problem> {
    let values = json!(scenario);
    let mut new = Table::new();
    let prefix = match kind.fresh {
        Fresh::Never => return Err(unknown(&format!("place for another {}", kind.name))),
        Fresh::Copy(prefix) => {
            let last = Tables::find(document, kind.path).and_then(|tables| {
                let last = tables.len().checked_sub(1)?;
                tables.into_entry(last)
            });
            new = document::bare_copy(last.ok_or_else(|| unknown(kind.name))?);
            for key in ["count", "absent", "start"] {
                new.remove(key);
            }
            prefix
        }
        Fresh::Numbers(prefix, _) => prefix,
        Fresh::Kinds(list) => {
            let first = values.pointer(&format!("{list}/0/name"));
            let name = variant.or(first.and_then(Value::as_str));
            new.insert("kind", toml_edit::value(name.unwrap_or_default()));
            None
        }
    };
    if let Some(prefix) = prefix {
        new.insert("name", toml_edit::value(free_name(kind, prefix, &values)));
        new.sort_values_by(|a, _, b, _| (a.get() != "name").cmp(&(b.get() != "name")));
    }
    Ok(new)
}

/// Returns the first free name of an item: the prefix with a number. `values`: the scenario in JSON.
fn free_name(kind: &ItemKind, prefix: &str, values: &Value) -> String {
    let entries = values.pointer(&kind.pointer()).and_then(Value::as_array);
    let entries = entries.into_iter().flatten();
    let taken: BTreeSet<&str> = entries.filter_map(|entry| entry["name"].as_str()).collect();
    let mut number = 1;
    while taken.contains(format!("{prefix}{number}").as_str()) {
        number += 1;
    }
    format!("{prefix}{number}")
}

fn add(
    document: &mut DocumentMut,
    kind: &ItemKind,
    mut new: Table,
    values: &Numbers,
    room: &Room,
) -> Result<(), Problem> {
    write(kind, &mut new, values, room)?;
    if let Fresh::Numbers(_, defaults) = kind.fresh {
        for (key, number) in defaults
            .iter()
            .filter(|(key, _)| !values.contains_key(*key))
        {
            document::set_number(&mut new, key, *number);
        }
    }
    let mut tables = Tables::find(document, kind.path).ok_or_else(|| unknown(kind.name))?;
    tables.push(new);
    Ok(())
}

fn delete(document: &mut DocumentMut, kind: &ItemKind, index: usize) -> Result<(), Problem> {
    let name = kind.name;
    let tables = Tables::find(document, kind.path).filter(|_| kind.is_list);
    let mut tables = tables.ok_or_else(|| {
        let what = format!("the {name} cannot be deleted");
        Problem::of_value(what, "move it")
    })?;
    if index >= tables.len() {
        return Err(unknown(name));
    }
    if tables.len() == 1 && kind.needs_one {
        let what = format!("the last {name} cannot be deleted");
        let remedy = "add another one first";
        return Err(Problem::of_value(what, remedy));
    }
    tables.remove(index);
    if tables.is_empty() {
        document::remove(document, kind.path);
    }
    Ok(())
}

/// Writes numbers into the table of an item.
fn write(
    kind: &ItemKind,
    table: &mut dyn TableLike,
    values: &Numbers,
    room: &Room,
) -> Result<(), Problem> {
    if kind.place == Place::Start && table.get("start").is_none() {
        let start = InlineTable::new();
        table.insert("start", Item::Value(start.into()));
    }
    // As people write them: the place first.
    let known = [X, Y].iter().chain(kind.numbers).copied();
    if let Some(key) = values
        .keys()
        .find(|key| !known.clone().any(|it| it == *key))
    {
        return Err(unknown(&format!("number '{key}' of a {}", kind.name)));
    }
    let numbers = known.filter_map(|key| Some((key, *values.get(key)?)));
    for (key, number) in numbers {
        match (kind.place, key) {
            (Place::Start, _) => {
                let start = table.get_mut("start");
                let start = start.and_then(Item::as_table_like_mut);
                document::set_number(start.ok_or_else(|| unknown("start"))?, key, rounded(number));
            }
            (Place::Fractions, X) => {
                let share = (number - f64::from(room.x_m)) / f64::from(room.width_m);
                document::set_number(table, "x_fraction", rounded(share));
            }
            (Place::Fractions, Y) => {
                let share = (number - f64::from(room.y_m)) / f64::from(room.height_m);
                document::set_number(table, "y_fraction", rounded(share));
            }
            _ => document::set_number(table, key, rounded(number)),
        }
    }
    Ok(())
}

fn rounded(number: f64) -> f64 {
    (number * ROUNDING).round() / ROUNDING
}

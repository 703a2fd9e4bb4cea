//! The values of a plan file, with their positions and their paths in the scenario.

use scenario::{KeyPath, TomlFile};
use toml::Value;

use crate::sweep::design::Change;

/// A value and its position in the file.
pub(super) struct Leaf {
    pub(super) at: KeyPath,
    pub(super) path: Vec<String>,
    pub(super) value: Value,
}

impl Leaf {
    pub(super) fn change(self) -> Change {
        Change {
            path: self.path,
            value: self.value,
        }
    }
}

pub(super) fn path(text: &str) -> Vec<String> {
    text.split('.').map(str::to_owned).collect()
}

/// Returns all values below a table in line order, as [`leaves_below`].
pub(super) fn leaves(
    file: &TomlFile<'_>,
    at: &KeyPath,
    table: toml::Table,
    ends: fn(&toml::Table) -> bool,
) -> Vec<Leaf> {
    let mut found = leaves_below(at, &[], table, ends);
    found.sort_by_cached_key(|leaf| (file.line_of(&leaf.at), leaf.path.clone()));
    found
}

/// Returns all values below a table. Keys may be nested tables or dotted, also within quotes. A table for which `ends` is
/// true is a value itself.
pub(super) fn leaves_below(
    at: &KeyPath,
    way: &[String],
    table: toml::Table,
    ends: fn(&toml::Table) -> bool,
) -> Vec<Leaf> {
    let below = table.into_iter().flat_map(|(name, value)| {
        let at = at.key(&name);
        let path = [way, &path(&name)].concat();
        match value {
            Value::Table(table) if !ends(&table) => leaves_below(&at, &path, table, ends),
            value => vec![Leaf { at, path, value }],
        }
    });
    below.collect()
}

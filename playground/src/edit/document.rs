//! The text of a scenario file as a document: a change leaves all comments and the order as they are.

use toml_edit::{Array, ArrayOfTables, DocumentMut, Item, Table, TableLike, Value};

/// A list of tables in either of its forms: `[[robots]]` or `robots = [{}]`.
pub enum Tables<'d> {
    Blocks(&'d mut ArrayOfTables),
    Inline(&'d mut Array),
}

impl<'d> Tables<'d> {
    /// Returns the list at these keys, if the text has one.
    pub fn find(document: &'d mut DocumentMut, path: &[&str]) -> Option<Self> {
        match find(document, path)? {
            Item::ArrayOfTables(blocks) => Some(Self::Blocks(blocks)),
            Item::Value(Value::Array(array)) => Some(Self::Inline(array)),
            _ => None,
        }
    }

    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Blocks(blocks) => blocks.len(),
            Self::Inline(array) => array.len(),
        }
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the table of an entry.
    #[must_use]
    pub fn into_entry(self, index: usize) -> Option<&'d mut dyn TableLike> {
        match self {
            Self::Blocks(blocks) => Some(blocks.get_mut(index)?),
            Self::Inline(array) => Some(array.get_mut(index)?.as_inline_table_mut()?),
        }
    }

    /// Adds an entry. In a list over several lines, the entry has a line of its own.
    pub fn push(&mut self, table: Table) {
        match self {
            Self::Blocks(blocks) => blocks.push(table),
            Self::Inline(array) => {
                let mut entry = Value::InlineTable(table.into_inline_table());
                let decor = array.iter().last().map(|last| last.decor().clone());
                if let Some(decor) = decor.filter(|_| array.len() > 1 || array.trailing_comma()) {
                    *entry.decor_mut() = decor;
                }
                array.push_formatted(entry);
            }
        }
    }

    /// Removes an entry. Comments above it stay, above the next entry.
    pub fn remove(&mut self, index: usize) {
        match self {
            Self::Inline(array) => {
                array.remove(index);
            }
            Self::Blocks(blocks) => {
                let removed = blocks.remove(index);
                let above = removed.decor().prefix().and_then(|prefix| prefix.as_str());
                if let (Some(above), Some(next)) = (above, blocks.get_mut(index)) {
                    let own = next.decor().prefix().and_then(|prefix| prefix.as_str());
                    if above.contains('#') && !own.unwrap_or_default().contains('#') {
                        next.decor_mut().set_prefix(above.to_owned());
                    }
                }
            }
        }
    }
}

/// Returns the item at these keys.
pub fn find<'d>(document: &'d mut DocumentMut, path: &[&str]) -> Option<&'d mut Item> {
    let mut item = document.as_item_mut();
    for key in path {
        item = item.as_table_like_mut()?.get_mut(key)?;
    }
    Some(item)
}

/// Adds an item at these keys, below tables that may be missing. Returns `None` if a key on the way is no table.
pub fn insert(document: &mut DocumentMut, path: &[&str], item: Item) -> Option<()> {
    let (last, tables) = path.split_last()?;
    let mut place: &mut dyn TableLike = document.as_table_mut();
    for key in tables {
        let missing = || {
            let mut table = Table::new();
            table.set_implicit(true);
            Item::Table(table)
        };
        place = place
            .entry(key)
            .or_insert_with(missing)
            .as_table_like_mut()?;
    }
    place.insert(last, item);
    Some(())
}

/// Removes the item at these keys.
pub fn remove(document: &mut DocumentMut, path: &[&str]) {
    if let Some((last, tables)) = path.split_last()
        && let Some(table) = find(document, tables).and_then(Item::as_table_like_mut)
    {
        table.remove(last);
    }
}

/// Sets a number, and leaves the comment behind it. A whole number stays one if it can.
pub fn set_number(table: &mut dyn TableLike, key: &str, number: f64) {
    let old = table.get_mut(key);
    let stays_whole = old.as_ref().is_some_and(|old| old.is_integer()) || key == "items";
    let mut value = match stays_whole && number.fract() == 0.0 {
        true => Value::from(number as i64),
        false => Value::from(number),
    };
    match old {
        Some(old) => {
            if let Some(old) = old.as_value() {
                *value.decor_mut() = old.decor().clone();
            }
            *old = Item::Value(value);
        }
        None => {
            table.insert(key, Item::Value(value));
        }
    }
}

/// Returns a copy of a table without comments.
#[must_use]
pub fn bare_copy(table: &dyn TableLike) -> Table {
    let mut copy = Table::new();
    for (key, item) in table.iter() {
        copy.insert(key, bare(item));
    }
    copy
}

/// Returns a copy of an item without comments. A table is in one line, so that its place in the file does not matter.
fn bare(item: &Item) -> Item {
    match (item, item.as_table_like()) {
        (_, Some(table)) => Item::Value(Value::InlineTable(bare_copy(table).into_inline_table())),
        (Item::Value(value), None) => Item::Value(value.clone().decorated(" ", "")),
        (other, None) => other.clone(),
    }
}

/// Forgets the places of tables in the text that they were read from.
pub fn forget_positions(item: &mut Item) {
    match item {
        Item::Table(table) => {
            table.set_position(None);
            for (_, below) in table.iter_mut() {
                forget_positions(below);
            }
        }
        Item::ArrayOfTables(blocks) => {
            for table in blocks.iter_mut() {
                table.set_position(None);
                for (_, below) in table.iter_mut() {
                    forget_positions(below);
                }
            }
        }
        Item::Value(_) | Item::None => {}
    }
}

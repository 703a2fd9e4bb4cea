//! TOML files with their values by path and their lines.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::Problem;
use super::path::{KeyPath, PathStep};
use super::toml_value::TomlValue;
use super::{Scenario, Vocabulary};

/// A parsed TOML file with its text and its name, which stands in error messages.
pub struct TomlFile<'t> {
    name: &'t str,
    text: &'t str,
    root: DeValue<'t>,
}

impl<'t> TomlFile<'t> {
    /// Parses the text; `name` is for error messages. Returns an error with the line that is not TOML.
    pub fn parse(name: &'t str, text: &'t str) -> Result<Self, Problem> {
        let table = DeTable::parse(text).map_err(|error| syntax_error(name, text, &error))?;
        let root = DeValue::Table(table.into_inner());
        Ok(Self { name, text, root })
    }

    #[must_use]
    pub fn name(&self) -> &'t str {
        self.name
    }

    /// Returns true if the file states this key at its top.
    #[must_use]
    pub fn has_key(&self, key: &str) -> bool {
        self.table().contains_key(key)
    }

    /// Returns the contents as a value of type `T`.
    ///
    /// # Errors
    /// Returns the first value that does not fit, with its line.
    pub fn deserialize<T: DeserializeOwned>(&self) -> Result<T, Problem> {
        T::deserialize(TomlValue(&self.root)).map_err(|problem| self.locate(problem))
    }

    /// Returns the scenario in the table with this key, without checks.
    pub fn scenario(&self, key: &str, vocabulary: &Vocabulary) -> Result<Scenario, Problem> {
        let empty = DeTable::new();
        let table = match self.table().get(key).map(Spanned::get_ref) {
            Some(DeValue::Table(table)) => table,
            _ => &empty,
        };
        Scenario::from_toml(table, vocabulary).map_err(|problem| self.locate(problem.under([key])))
    }

    /// Creates an error for a value of the file.
    #[must_use]
    pub fn error_at(
        &self,
        at: impl Into<KeyPath>,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Problem {
        self.locate(Problem::at(at, what, remedy))
    }

    /// Adds the file and the line of its key to a problem with a value of the file.
    #[must_use]
    pub fn locate(&self, mut problem: Problem) -> Problem {
        problem.place.source = Some(self.name.to_owned());
        problem.place.line = self.find_line(&problem.place.key.0);
        problem
    }

    /// Returns the line of a value, from 1. For a missing value, it is the line of the innermost table on the way.
    #[must_use]
    pub fn line_of(&self, at: impl Into<KeyPath>) -> usize {
        self.find_line(&at.into().0).unwrap_or(1)
    }

    fn find_line(&self, path: &[PathStep]) -> Option<usize> {
        let mut value = &self.root;
        let mut span = None;
        for step in path {
            let (next_span, next) = match (step, value) {
                (PathStep::Key(key), DeValue::Table(table)) => {
                    match table.get_key_value(key.as_str()) {
                        Some((key, next)) => (key.span(), next),
                        None => break,
                    }
                }
                (PathStep::Index(index), DeValue::Array(array)) => match array.get(*index) {
                    Some(next) => (next.span(), next),
                    None => break,
                },
                _ => break,
            };
            span = Some(next_span);
            value = next.get_ref();
        }
        span.map(|span| line_at(self.text, span.start))
    }

    pub(super) fn table(&self) -> &DeTable<'t> {
        match &self.root {
            DeValue::Table(table) => table,
            _ => unreachable!("the root of a document is a table"),
        }
    }
}

fn syntax_error(file_name: &str, text: &str, error: &toml::de::Error) -> Problem {
    let span = error.span().unwrap_or(0..0);
    let line = line_at(text, span.start);
    let message = error.message();
    let (mut what, remedy) = match message.split_once(", expected ") {
        Some((what, wanted)) => (what.to_owned(), format!("TOML expects {wanted} here")),
        None if message == "duplicate key" => (message.to_owned(), "state it once".to_owned()),
        None => (
            message.to_owned(),
            "write it as TOML, https://toml.io".to_owned(),
        ),
    };
    let found = text.get(span).unwrap_or_default().trim();
    if !found.is_empty() && found.len() <= 40 {
        what += &format!(", '{found}'");
    }
    Problem::with_source(file_name, what, remedy).on_line(line)
}

/// Returns the line of a byte of the text, counted from 1.
fn line_at(text: &str, byte: usize) -> usize {
    let before = text.as_bytes().iter().take(byte);
    before.filter(|byte| **byte == b'\n').count() + 1
}

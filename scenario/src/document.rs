//! The text of a scenario file, with its values by path and their lines.

use serde::de::Deserialize;
use toml::de::{DeTable, DeValue};

use super::error::{Location, Problem, ScenarioError};
use super::path::{KeyPath, PathStep};
use super::toml_value::TomlValue;

/// A parsed file with its text.
pub(super) struct Document<'t> {
    text: &'t str,
    root: DeValue<'t>,
}

impl<'t> Document<'t> {
    /// Parses the text. Returns an error with the line that is not TOML.
    pub fn parse(file_name: &str, text: &'t str) -> Result<Self, ScenarioError> {
        DeTable::parse(text)
            .map(|table| Self {
                text,
                root: DeValue::Table(table.into_inner()),
            })
            .map_err(|error| syntax_error(file_name, text, &error))
    }

    /// Returns the line of the value at a path, or of the innermost table or array on the way.
    pub fn line_of(&self, path: &KeyPath) -> Option<usize> {
        let mut value = &self.root;
        let mut span = None;
        for step in &path.0 {
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

    pub fn table(&self) -> &DeTable<'t> {
        match &self.root {
            DeValue::Table(table) => table,
            _ => unreachable!("the root of a document is a table"),
        }
    }

    pub fn to<'d, T: Deserialize<'d>>(&'d self) -> Result<T, Problem> {
        T::deserialize(TomlValue(&self.root)).map_err(Problem::from)
    }
}

impl Problem {
    /// Converts the problem into an error. `file` is the name of the scenario's file and its contents.
    pub(super) fn located(self, file: Option<(&str, &Document<'_>)>) -> ScenarioError {
        let (name, line, key) = match self.place {
            Location::Scenario(path) => (
                file.map(|(name, _)| name.to_owned()),
                file.and_then(|(_, document)| document.line_of(&path)),
                path.to_string(),
            ),
            Location::Parameters { file, line, key } => (Some(file), Some(line), key),
        };
        ScenarioError {
            file: name,
            line,
            key,
            problem: self.problem,
            remedy: self.remedy,
        }
    }
}

fn syntax_error(file_name: &str, text: &str, error: &toml::de::Error) -> ScenarioError {
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
    ScenarioError::in_file(file_name, line, what, remedy)
}

/// Returns the line of a byte of the text, counted from 1.
fn line_at(text: &str, byte: usize) -> usize {
    let before = text.as_bytes().iter().take(byte);
    before.filter(|byte| **byte == b'\n').count() + 1
}

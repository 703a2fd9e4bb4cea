//! Loading of scenario files and other TOML files, with the same form of error messages.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::Document;
use super::error::{Problem, ScenarioError};
use super::path::{KeyPath, PathStep};
use super::resolve::check;
use super::{Catalog, Scenario, Vocabulary};

impl Scenario {
    /// Reads a scenario file; `file_name` is for error messages. Keys that the file omits have their defaults.
    ///
    /// # Errors
    /// Returns the first mistake: invalid TOML, an unknown key or name, a value of the wrong type or out of range,
    /// robots that do not fit, or parameters that violate a rule of ALLIANCE.md §1.
    pub fn parse(
        file_name: &str,
        text: &str,
        vocabulary: &Vocabulary,
    ) -> Result<Self, ScenarioError> {
        let document = Document::parse(file_name, text)?;
        Self::from_toml(document.table(), vocabulary)
            .and_then(|scenario| checked(scenario, vocabulary))
            .map_err(|problem| problem.located(Some((file_name, &document))))
    }

    /// Reads a scenario from values without a file. Errors name only the key.
    pub fn from_table(table: &toml::Table, vocabulary: &Vocabulary) -> Result<Self, ScenarioError> {
        let text = table.to_string();
        let document = Document::parse("scenario", &text)?;
        Self::from_toml(document.table(), vocabulary)
            .and_then(|scenario| checked(scenario, vocabulary))
            .map_err(|problem| problem.located(None))
    }
}

/// Returns the scenario if it has no mistakes.
fn checked(scenario: Scenario, vocabulary: &Vocabulary) -> Result<Scenario, Problem> {
    scenario.check_allocators_with_path(&vocabulary.allocators)?;
    let mut complete = scenario.clone();
    complete.apply_team_defaults();
    check(&complete, &Catalog::new(&complete), None)?;
    Ok(scenario)
}

/// A TOML file with the lines of its values.
pub struct TomlFile<'t> {
    name: &'t str,
    document: Document<'t>,
}

impl<'t> TomlFile<'t> {
    /// Parses the text; `name` is for error messages.
    pub fn parse(name: &'t str, text: &'t str) -> Result<Self, ScenarioError> {
        let document = Document::parse(name, text)?;
        Ok(Self { name, document })
    }

    #[must_use]
    pub fn name(&self) -> &'t str {
        self.name
    }

    /// Returns true if the file states this key at its top.
    #[must_use]
    pub fn has_key(&self, key: &str) -> bool {
        self.document.table().contains_key(key)
    }

    /// Returns the contents as a value of type `T`.
    ///
    /// # Errors
    /// Returns the first value that does not fit, with its line.
    pub fn deserialize<T: DeserializeOwned>(&self) -> Result<T, ScenarioError> {
        self.document
            .to()
            .map_err(|problem| problem.located(Some((self.name, &self.document))))
    }

    /// Returns the scenario in the table with this key, without checks.
    pub fn scenario(&self, key: &str, vocabulary: &Vocabulary) -> Result<Scenario, ScenarioError> {
        let empty = DeTable::new();
        let table = match self.document.table().get(key).map(Spanned::get_ref) {
            Some(DeValue::Table(table)) => table,
            _ => &empty,
        };
        Scenario::from_toml(table, vocabulary).map_err(|problem| {
            problem
                .under_key(key)
                .located(Some((self.name, &self.document)))
        })
    }

    /// Creates an error for a value of the file.
    #[must_use]
    pub fn error_at(
        &self,
        at: &[PathStep],
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> ScenarioError {
        Problem::at(KeyPath(at.to_vec()), what, remedy).located(Some((self.name, &self.document)))
    }

    /// Returns the line of a value, from 1. For a missing value, it is the line of the innermost table on the way.
    #[must_use]
    pub fn line_of(&self, at: &[PathStep]) -> usize {
        self.document.line_of(&KeyPath(at.to_vec())).unwrap_or(1)
    }
}

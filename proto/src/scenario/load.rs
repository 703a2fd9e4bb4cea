//! Scenario files, and other files in TOML whose mistakes are answered like theirs.

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::Document;
use super::error::{Problem, ScenarioError};
use super::path::{Path, Step};
use super::resolve::check;
use super::{Catalog, Scenario, Vocabulary};

impl Scenario {
    /// Reads a scenario file; `file_name` is for error messages. What the file does not mention has its default.
    ///
    /// # Errors
    /// The first mistake: not TOML, an unknown key or name, a value of the wrong type or out of range, robots that do not
    /// fit, or parameters that break a rule of ALLIANCE.md §1.
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

    /// The same for values that stand in no file: errors name the key alone.
    ///
    /// # Errors
    /// Those of [`Scenario::parse`].
    pub fn from_table(table: &toml::Table, vocabulary: &Vocabulary) -> Result<Self, ScenarioError> {
        let text = table.to_string();
        let document = Document::parse("scenario", &text)?;
        Self::from_toml(document.table(), vocabulary)
            .and_then(|scenario| checked(scenario, vocabulary))
            .map_err(|problem| problem.located(None))
    }
}

/// The scenario, if nothing is wrong with it.
fn checked(scenario: Scenario, vocabulary: &Vocabulary) -> Result<Scenario, Problem> {
    scenario.allocator_problem(&vocabulary.allocators)?;
    let mut complete = scenario.clone();
    complete.hand_down();
    check(&complete, &Catalog::of(&complete), None)?;
    Ok(scenario)
}

/// A file in TOML, with the lines of its values.
pub struct TomlFile<'t> {
    name: &'t str,
    document: Document<'t>,
}

impl<'t> TomlFile<'t> {
    /// Parses the text; `name` is for error messages.
    ///
    /// # Errors
    /// When it is not TOML.
    pub fn parse(name: &'t str, text: &'t str) -> Result<Self, ScenarioError> {
        let document = Document::parse(name, text)?;
        Ok(Self { name, document })
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &'t str {
        self.name
    }

    /// Its contents as a value of that type.
    ///
    /// # Errors
    /// The first value that does not fit, with its line.
    pub fn to<T: DeserializeOwned>(&self) -> Result<T, ScenarioError> {
        self.document
            .to()
            .map_err(|problem| problem.located(Some((self.name, &self.document))))
    }

    /// The scenario that is its table of that key. It has not been checked.
    ///
    /// # Errors
    /// The first key or value that does not fit, with its line.
    pub fn scenario(&self, key: &str, vocabulary: &Vocabulary) -> Result<Scenario, ScenarioError> {
        let empty = DeTable::new();
        let table = match self.document.table().get(key).map(Spanned::get_ref) {
            Some(DeValue::Table(table)) => table,
            _ => &empty,
        };
        Scenario::from_toml(table, vocabulary).map_err(|problem| {
            problem
                .below(key)
                .located(Some((self.name, &self.document)))
        })
    }

    /// What is wrong with a value of it, and what would be right.
    #[must_use]
    pub fn mistake(
        &self,
        at: &[Step],
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> ScenarioError {
        Problem::at(Path(at.to_vec()), what, remedy).located(Some((self.name, &self.document)))
    }

    /// The line of a value, from 1, or of what is nearest to it on the way there.
    #[must_use]
    pub fn line_of(&self, at: &[Step]) -> usize {
        self.document.line_of(&Path(at.to_vec())).unwrap_or(1)
    }
}

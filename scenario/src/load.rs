//! Loading of scenarios with all checks.

use toml::de::DeTable;

use super::error::Problem;
use super::resolve::check;
use super::team;
use super::toml_file::TomlFile;
use super::{Catalog, Scenario, Vocabulary};

impl Scenario {
    /// Reads a scenario file; `file_name` is for error messages. Keys that the file omits have their defaults.
    ///
    /// # Errors
    /// Returns the first mistake: invalid TOML, an unknown key or name, a value of the wrong type or out of range,
    /// robots that do not fit, or parameters that violate a rule of ALLIANCE.md §1.
    pub fn parse(file_name: &str, text: &str, vocabulary: &Vocabulary) -> Result<Self, Problem> {
        let file = TomlFile::parse(file_name, text)?;
        read(file.table(), vocabulary).map_err(|problem| file.locate(problem))
    }

    /// Reads a scenario from values without a file. Errors name only the key.
    pub fn from_table(table: &toml::Table, vocabulary: &Vocabulary) -> Result<Self, Problem> {
        let text = table.to_string();
        let file = TomlFile::parse("scenario", &text)?;
        read(file.table(), vocabulary)
    }

    /// Returns the scenario as the reader of its file would, with all checks.
    pub fn checked(&self, vocabulary: &Vocabulary) -> Result<Self, Problem> {
        let table = toml::Table::try_from(self);
        let table = table.map_err(|error| Problem::of_value(error.to_string(), ""))?;
        Self::from_table(&table, vocabulary)
    }
}

/// Reads a scenario with all checks. Errors have the keys of the file.
fn read(file: &DeTable<'_>, vocabulary: &Vocabulary) -> Result<Scenario, Problem> {
    let scenario = Scenario::from_toml(file, vocabulary)?;
    check_complete(&scenario, vocabulary).map_err(|problem| team::as_stated(file, problem))?;
    Ok(scenario)
}

/// Rejects the first mistake of a scenario that the reader accepts.
fn check_complete(scenario: &Scenario, vocabulary: &Vocabulary) -> Result<(), Problem> {
    scenario.check_allocators(&vocabulary.allocators)?;
    let mut complete = scenario.clone();
    complete.apply_team_defaults();
    check(&complete, &Catalog::new(&complete), None)?;
    Ok(())
}

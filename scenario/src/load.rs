//! Loading of scenarios with all checks.

use super::error::Problem;
use super::resolve::check;
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
        Self::from_toml(file.table(), vocabulary)
            .and_then(|scenario| checked(scenario, vocabulary))
            .map_err(|problem| file.locate(problem))
    }

    /// Reads a scenario from values without a file. Errors name only the key.
    pub fn from_table(table: &toml::Table, vocabulary: &Vocabulary) -> Result<Self, Problem> {
        let text = table.to_string();
        let file = TomlFile::parse("scenario", &text)?;
        Self::from_toml(file.table(), vocabulary).and_then(|scenario| checked(scenario, vocabulary))
    }
}

/// Returns the scenario if it has no mistakes.
fn checked(scenario: Scenario, vocabulary: &Vocabulary) -> Result<Scenario, Problem> {
    scenario.check_allocators(&vocabulary.allocators)?;
    let mut complete = scenario.clone();
    complete.apply_team_defaults();
    check(&complete, &Catalog::new(&complete), None)?;
    Ok(scenario)
}

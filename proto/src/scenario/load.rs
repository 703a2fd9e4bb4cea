//! Scenario files.

use super::Scenario;
use super::document::Document;
use super::error::ScenarioError;
use super::resolve::check;

impl Scenario {
    /// Reads a scenario file; `file_name` is for error messages. What the file does not mention has its default.
    ///
    /// # Errors
    /// The first mistake: not TOML, an unknown key or name, a value of the wrong type or out of range, robots that do not
    /// fit, or parameters that break a rule of ALLIANCE.md §1.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, ScenarioError> {
        let document = Document::parse(file_name, text)?;
        document
            .to()
            .and_then(|scenario| check(&scenario, None).map(|_| scenario))
            .map_err(|problem| problem.located(Some((file_name, &document))))
    }
}

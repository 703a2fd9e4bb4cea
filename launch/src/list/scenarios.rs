//! `alliance list scenarios`: the built-in scenarios, or the file of one.

use analysis::table;
use anyhow::bail;
use clap::Args;
use missions::Registry;
use scenario::{Scenario, name_remedy};
use world_server::size::SizeArgs;

/// List the built-in scenarios, or print one
#[derive(Args, Clone, Debug, Default)]
pub struct ScenariosCommand {
    /// Scenario to print with its comments, as a start for your own
    #[arg(value_name = "SCENARIO")]
    scenario: Option<String>,
    #[command(flatten)]
    size: SizeArgs,
}

impl ScenariosCommand {
    /// Returns the list, or the text of the scenario.
    pub fn text(&self) -> anyhow::Result<String> {
        let vocabulary = Registry::current().vocabulary();
        if let Some(sized) = self.size.scenario(self.scenario.as_deref(), &vocabulary)? {
            return Ok(sized.to_toml()?);
        }
        let Some(name) = &self.scenario else {
            let listed = vocabulary.builtins().map(|scenario| {
                let description = Scenario::parse(scenario.name, scenario.text, &vocabulary)
                    .map_or_else(|error| error.to_string(), |parsed| parsed.description);
                (scenario.name, description)
            });
            return Ok(table::list(listed));
        };
        match vocabulary.builtin(name) {
            Some(scenario) => Ok(scenario.text.to_owned()),
            None => {
                let known = vocabulary.builtins().map(|scenario| scenario.name);
                bail!(
                    "no built-in scenario '{name}'; {}",
                    name_remedy(name, known)
                )
            }
        }
    }
}

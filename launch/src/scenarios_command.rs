//! `alliance scenarios`: lists the built-in scenarios, or prints the file of one.

use std::fmt::Display;
use std::process::ExitCode;

use clap::Args;
use scenario::{Scenario, Vocabulary, name_remedy};
use terminal::stderr_line;

use analysis::table;
use missions::Registry;
use world_server::size::SizeArgs;

/// List the built-in scenarios, or print one.
#[derive(Args, Clone, Debug)]
pub struct ScenariosCommand {
    /// Scenario to print with its comments, as a start for your own
    name: Option<String>,
    #[command(flatten)]
    size: SizeArgs,
}

impl ScenariosCommand {
    /// Prints the list or the scenario. Exit status 0, or 2 for an unknown name.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let vocabulary = Registry::current().vocabulary();
        match self.size.scenario(self.name.as_deref(), &vocabulary) {
            Ok(None) => self.list_or_print(&vocabulary),
            Ok(Some(sized)) => {
                // Serialization to memory cannot fail, because all keys are strings.
                say(sized.to_toml().expect("a scenario can be written"))
            }
            Err(error) => {
                stderr_line!("alliance scenarios: {error:#}");
                ExitCode::from(2)
            }
        }
    }

    fn list_or_print(&self, vocabulary: &Vocabulary) -> ExitCode {
        let Some(name) = &self.name else {
            let listed = vocabulary.builtins().map(|scenario| {
                let description = Scenario::parse(scenario.name, scenario.text, vocabulary)
                    .map_or_else(|error| error.to_string(), |parsed| parsed.description);
                (scenario.name, description)
            });
            return say(table::list(listed));
        };
        if let Some(scenario) = vocabulary.builtin(name) {
            return say(scenario.text);
        }
        let known = vocabulary.builtins().map(|scenario| scenario.name);
        stderr_line!(
            "alliance scenarios: no built-in scenario '{name}'; {}",
            name_remedy(name, known)
        );
        ExitCode::from(2)
    }
}

fn say(text: impl Display) -> ExitCode {
    terminal::print_result("alliance scenarios", text, ExitCode::SUCCESS)
}

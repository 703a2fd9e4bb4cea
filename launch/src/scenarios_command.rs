//! `alliance scenarios`: lists the built-in scenarios, or prints the file of one.

use std::process::ExitCode;

use alliance_proto::scenario::Scenario;
use clap::Args;

use crate::scenarios::{builtin, builtins};

/// List the built-in scenarios, or print one.
#[derive(Args, Clone, Debug)]
pub struct ScenariosCommand {
    /// Scenario to print, comments and all: a start for one of your own
    name: Option<String>,
}

impl ScenariosCommand {
    /// Exit status 0, or 2 for an unknown name.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let Some(name) = &self.name else {
            for scenario in builtins() {
                let description = Scenario::parse(&scenario.file_name(), scenario.text)
                    .map_or_else(|error| error.to_string(), |parsed| parsed.description);
                println!("{:<24} {description}", scenario.name);
            }
            return ExitCode::SUCCESS;
        };
        if let Some(scenario) = builtin(name) {
            print!("{}", scenario.text);
            return ExitCode::SUCCESS;
        }
        let known: Vec<&str> = builtins().iter().map(|scenario| scenario.name).collect();
        eprintln!(
            "alliance scenarios: no built-in scenario '{name}'; there are {}",
            known.join(", ")
        );
        ExitCode::from(2)
    }
}

//! `alliance list`: the scenarios, allocators, missions and runs.

mod allocators;
mod missions;
mod parameters;
mod runs;
mod scenarios;

use std::process::ExitCode;

use clap::{Args, Subcommand};
use terminal::fail;
use world_server::size::SizeArgs;

use runs::RunsCommand;

/// List scenarios, allocators, missions and runs, or describe one
#[derive(Args, Clone, Debug)]
pub struct ListCommand {
    #[command(subcommand)]
    what: Option<What>,
}

#[derive(Subcommand, Clone, Debug)]
enum What {
    /// List the built-in scenarios, or print one
    Scenarios {
        /// Scenario to print with its comments, as a start for your own
        scenario: Option<String>,
        #[command(flatten)]
        size: SizeArgs,
    },
    /// List the allocators, or the parameters of one
    Allocators {
        /// Allocator whose parameters to list
        allocator: Option<String>,
    },
    /// List the missions, or the parameters of one
    Missions {
        /// Mission whose parameters to list: the keys of its section in a scenario file
        mission: Option<String>,
    },
    /// List live and recorded runs, newest first
    Runs(RunsCommand),
}

impl ListCommand {
    /// Prints the list or the description. Exit status 0, 2 for an unknown name, 3 if a folder cannot be read.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let (name, text, status) = match &self.what {
            None => ("list", everything(), 3),
            Some(What::Scenarios { scenario, size }) => {
                let text = scenarios::text(scenario.as_deref(), size);
                ("list scenarios", text, 2)
            }
            Some(What::Allocators { allocator }) => {
                ("list allocators", allocators::text(allocator.as_deref()), 2)
            }
            Some(What::Missions { mission }) => {
                ("list missions", missions::text(mission.as_deref()), 2)
            }
            Some(What::Runs(command)) => ("list runs", command.text(), 3),
        };
        let command = format!("alliance {name}");
        match text {
            Ok(text) => terminal::print_result(&command, text, ExitCode::SUCCESS),
            Err(error) => fail(&command, &error, status),
        }
    }
}

/// Returns all four lists, each below a line with the option or argument that accepts its names.
fn everything() -> anyhow::Result<String> {
    let lists = [
        (
            "Scenarios: alliance run SCENARIO",
            scenarios::text(None, &SizeArgs::default())?,
        ),
        (
            "Allocators: alliance run --allocator ALLOCATOR",
            allocators::text(None)?,
        ),
        (
            "Missions: section [MISSION] of a scenario",
            missions::text(None)?,
        ),
        ("Runs: alliance watch RUN", RunsCommand::default().text()?),
    ];
    let lists = lists.map(|(heading, list)| format!("{heading}\n\n{list}"));
    Ok(lists.join("\n"))
}

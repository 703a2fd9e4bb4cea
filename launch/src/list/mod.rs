//! `alliance list`: the scenarios, allocators, missions and runs.

mod allocators;
mod missions;
mod parameters;
mod runs;
mod scenarios;

use std::process::ExitCode;

use clap::{Args, Subcommand};
use terminal::fail;

use allocators::AllocatorsCommand;
use missions::MissionsCommand;
use runs::RunsCommand;
use scenarios::ScenariosCommand;

/// List scenarios, allocators, missions and runs, or describe one
#[derive(Args, Clone, Debug)]
pub struct ListCommand {
    #[command(subcommand)]
    what: Option<What>,
}

#[derive(Subcommand, Clone, Debug)]
enum What {
    /// List the built-in scenarios, or print one
    Scenarios(ScenariosCommand),
    /// List the allocators, or the parameters of one
    Allocators(AllocatorsCommand),
    /// List the missions, or the parameters of one
    Missions(MissionsCommand),
    /// List live and recorded runs, newest first
    Runs(RunsCommand),
}

impl ListCommand {
    /// Prints the list or the description. Exit status 0, 2 for an unknown name, 3 if a folder cannot be read.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let (name, text, status) = match &self.what {
            None => ("list", everything(), 3),
            Some(What::Scenarios(command)) => ("list scenarios", command.text(), 2),
            Some(What::Allocators(command)) => ("list allocators", command.text(), 2),
            Some(What::Missions(command)) => ("list missions", command.text(), 2),
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
            ScenariosCommand::default().text()?,
        ),
        (
            "Allocators: alliance run --allocator ALLOCATOR",
            AllocatorsCommand::default().text()?,
        ),
        (
            "Missions: mission = \"MISSION\" in a scenario",
            MissionsCommand::default().text()?,
        ),
        ("Runs: alliance watch RUN", RunsCommand::default().text()?),
    ];
    let lists = lists.map(|(heading, list)| format!("{heading}\n\n{list}"));
    Ok(lists.join("\n"))
}

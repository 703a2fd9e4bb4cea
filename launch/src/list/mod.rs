//! `alliance list`: the scenarios, allocators, missions and runs.

mod allocators;
mod missions;
mod parameters;
mod runs;
mod scenarios;

use std::process::ExitCode;

use ::missions::Registry;
use clap::{Args, Subcommand};
use scenario::{Problem, name_remedy};
use terminal::fail;
use world_server::size::SizeArgs;

use runs::RunsCommand;

/// The names of the subcommands.
const LISTS: [&str; 4] = ["scenarios", "allocators", "missions", "runs"];

/// List scenarios, allocators, missions and runs, or describe one
#[derive(Args, Clone, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub struct ListCommand {
    #[command(subcommand)]
    what: Option<What>,
    /// Scenario to print, or allocator or mission whose parameters to list
    #[arg(value_name = "SCENARIO|ALLOCATOR|MISSION")]
    name: Option<String>,
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
    /// Prints the list or the description. Exit status 0, 2 for an unknown name or folder, 3 if a folder cannot be read.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let (name, text) = match &self.what {
            None => match &self.name {
                None => ("list", everything()),
                Some(name) => ("list", described(name)),
            },
            Some(What::Scenarios { scenario, size }) => {
                ("list scenarios", scenarios::text(scenario.as_deref(), size))
            }
            Some(What::Allocators { allocator }) => {
                ("list allocators", allocators::text(allocator.as_deref()))
            }
            Some(What::Missions { mission }) => {
                ("list missions", missions::text(mission.as_deref()))
            }
            Some(What::Runs(command)) => ("list runs", command.text()),
        };
        let command = format!("alliance {name}");
        match text {
            Ok(text) => terminal::print_result(&command, text, ExitCode::SUCCESS),
            Err(error) => {
                let status = if error.is::<Problem>() { 2 } else { 3 };
                fail(&command, &error, status)
            }
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
    Ok(lists.join("\n") + "\nOne of them: alliance list NAME\n")
}

/// Returns the description of the scenario, allocator or mission with this name.
fn described(name: &str) -> anyhow::Result<String> {
    let vocabulary = Registry::current().vocabulary();
    let scenarios = vocabulary.builtins().map(|scenario| scenario.name);
    let allocators = vocabulary.allocators.iter().map(|spec| spec.name);
    let missions = vocabulary.missions.iter().map(|mission| mission.name());
    let [scenarios, allocators, missions]: [Vec<&str>; 3] = [
        scenarios.collect(),
        allocators.collect(),
        missions.collect(),
    ];
    if scenarios.contains(&name) {
        return scenarios::text(Some(name), &SizeArgs::default());
    }
    if allocators.contains(&name) {
        return allocators::text(Some(name));
    }
    if missions.contains(&name) {
        return missions::text(Some(name));
    }
    let known = [&scenarios[..], &allocators, &missions, &LISTS].concat();
    let remedy = name_remedy(name, known);
    let what = format!("there is no scenario, allocator or mission '{name}'");
    Err(Problem::at((), what, remedy).into())
}

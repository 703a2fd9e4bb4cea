//! The `alliance` command and its subcommands.
//!
//! - [`run`]: starts the world and the agents as further processes of this program, supervises them and prints the result.
//! - [`cluster`], [`keys`]: runs over several machines, and their certificates and secrets.
//! - [`control`]: a client of a live run, for `fault`, `clock` and `status`.
//! - [`page`]: a page in the browser for a live or finished run. [`observer`]: subscriptions of the page and the launcher.
//! - The crate [`analysis`] contains the analysis of recorded runs.

// These macros panic if the output is closed; `terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
pub use missions::Registry;
use robot_agent::args::AgentArgs;
use terminal::stderr_line;
use world_server::args::{WorldArgs, log_to_stderr};
use world_server::mission_args::Known;
use world_server::size::with_size_options;

mod allocators_command;
pub mod arguments;
mod clock;
pub mod cluster_command;
mod completions_command;
pub mod control;
mod fault;
mod limits;
mod ls_command;
mod man_command;
mod missions_command;
pub mod observer;
pub mod page;
mod parameters;
mod replay_controllers;
pub mod run;
mod runtime;
mod scenarios_command;
mod status;
#[cfg(test)]
mod tampered;

/// Compare task allocation in multi-robot teams under reproducible faults, with one process per robot.
#[derive(Parser)]
#[command(name = "alliance", version)]
struct AllianceCli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a mission with one world process and one process per robot
    Run(run::args::RunCommand),
    /// Start the world process of a run: physics, sensing and the step clock
    World(WorldArgs),
    /// Start one robot process of a live run
    Agent(AgentArgs),
    /// Start and watch the agents of one host in runs over several machines
    Host(cluster_command::host::HostCommand),
    /// Route messages between a remote host's robots and the world
    Router(cluster_command::host::RouterCommand),
    /// Run a mission over several machines, described by a cluster file
    Cluster(cluster_command::ClusterCommand),
    #[command(hide = true)]
    Shell(run::shell::ShellCommand),
    /// Create certificates and secrets for a team on several machines
    Keys(cluster_command::keys::KeysCommand),
    /// Replay a logged run and compare every tick
    Replay(analysis::replay::ReplayCommand),
    /// Find the first difference between two runs
    Diff(analysis::diff::DiffCommand),
    /// Inject, list and clear faults in a live run
    Fault(fault::FaultArgs),
    /// Pause, resume, step or change the speed of a live run
    Clock(clock::ClockArgs),
    /// Show the state of a live run: robots, processes, tasks, motivations, faults
    Status(status::StatusArgs),
    /// List live runs and the recorded runs in a folder
    Ls(ls_command::LsCommand),
    /// Serve a page to watch and control a live run
    Watch(page::watch::WatchCommand),
    /// Show a finished run on a page
    View(page::view::ViewCommand),
    /// Create a page with figures and metrics of one or two runs
    Report(analysis::report::command::ReportCommand),
    /// Export a run as MCAP or Parquet for other tools, or as a scenario to run again
    Export(analysis::export::ExportCommand),
    /// Run many variants of a mission with many seeds, on all cores
    Sweep(analysis::sweep::command::SweepCommand),
    /// Compare allocators under the same faults, with the significance of the differences
    Compare(analysis::compare::command::CompareCommand),
    /// Search for good allocator parameters and test them on unseen seeds
    Tune(analysis::tune::command::TuneCommand),
    LallianceStrategies(analysis::strategies::command::StrategiesCommand),
    /// Explain the parameters of a scenario and report conflicts between them
    Check(analysis::check::CheckCommand),
    /// List the built-in scenarios, or print one
    Scenarios(scenarios_command::ScenariosCommand),
    /// List the allocators, or the parameters of one
    Allocators(allocators_command::AllocatorsCommand),
    /// List the missions, or the parameters of one
    Missions(missions_command::MissionsCommand),
    /// Print a completion script for a shell
    Completions(completions_command::CompletionsCommand),
    /// Write manual pages of all commands
    Man(man_command::ManCommand),
}

/// Returns the scenarios, missions and allocators of this program.
#[must_use]
pub fn program_content() -> Known {
    Known {
        vocabulary: Registry::current().vocabulary(),
        worlds: Registry::current().worlds().clone(),
    }
}

/// Returns the command with the size options of this program's missions.
fn full_command() -> clap::Command {
    with_size_options(AllianceCli::command(), &Registry::current().vocabulary())
}

/// Parses the arguments of this process and executes the command. The registry contains the missions and allocators. Child processes
/// run the same program, so they have the same registry.
#[must_use]
pub fn main(registry: Registry) -> ExitCode {
    registry.install();
    cluster::session::prepare_process();
    // First, so that a child of a dead launcher does not start.
    let ready =
        run::child_processes::die_with_launcher().and_then(|()| limits::check_process_limits());
    if let Err(error) = ready {
        stderr_line!("alliance: {error:#}");
        return ExitCode::from(3);
    }
    log_to_stderr();
    let command: AllianceCli = match arguments::parse(&Registry::current().vocabulary()) {
        Ok(command) => command,
        Err(status) => return status,
    };
    match command.command {
        Command::Run(command) => command.run(),
        Command::World(world) => world.run(&program_content()),
        Command::Agent(agent) => agent.run(Registry::current().agents()),
        Command::Host(host) => host.run(),
        Command::Router(router) => router.run(),
        Command::Cluster(cluster) => cluster.run(),
        Command::Shell(command) => command.run(),
        Command::Keys(command) => command.run(),
        Command::Replay(command) => command.run(replay_controllers::compare),
        Command::Diff(command) => command.run(),
        Command::Fault(command) => command.run(),
        Command::Clock(command) => command.run(),
        Command::Status(command) => command.run(),
        Command::Ls(command) => command.run(),
        Command::Watch(command) => command.run(),
        Command::View(command) => command.run(),
        Command::Report(command) => command.run(),
        Command::Export(command) => command.run(),
        Command::Sweep(command) => command.run(&program_content()),
        Command::Compare(command) => command.run(&program_content()),
        Command::Tune(command) => command.run(&program_content()),
        Command::LallianceStrategies(command) => command.run(),
        Command::Check(command) => command.run(&program_content()),
        Command::Scenarios(command) => command.run(),
        Command::Allocators(command) => command.run(),
        Command::Missions(command) => command.run(),
        Command::Completions(command) => command.run(full_command()),
        Command::Man(command) => command.run(full_command()),
    }
}

//! The `alliance` command and its subcommands.
//!
//! - [`run`]: starts the world and the agents as further processes of this program, supervises them and prints the result.
//! - [`cluster_command`]: runs over several machines, and single processes by hand.
//! - `commands`: the table from which help, manual pages and completions are generated. `list`: the content of this program.
//! - [`control`]: a client of a live run, for `fault`, `clock` and `status`.
//! - `ros`: the topics of a live run in ROS 2. `foxglove`: its channels for Foxglove. `follow`: a process that follows the
//!   log of a live run.
//! - [`page`]: a page in the browser for a live or finished run. [`observer`]: subscriptions of the page and the launcher.
//! - `python`: the hand-over of a command with controllers in Python to the Python package.
//! - The crate [`analysis`] contains the analysis of recorded runs.

// These macros panic if the output is closed; `terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;

use analysis::controllers::ControllerFiles;
use clap::{CommandFactory, Parser, Subcommand};
use cluster::process_log::{LogArgs, log_to_stderr};
pub use missions::Registry;
use proto::program_build;
use terminal::{fail, stderr_line};
use world_server::mission_args::Known;
use world_server::size::with_size_options;

pub mod arguments;
mod clock;
pub mod cluster_command;
mod commands;
pub mod control;
mod fault;
#[cfg(any(feature = "ros", feature = "foxglove"))]
mod follow;
mod foxglove;
mod generate;
mod limits;
mod list;
pub mod observer;
pub mod page;
mod python;
#[cfg(any(feature = "ros", feature = "foxglove"))]
mod relay;
mod replay_controllers;
mod ros;
pub mod run;
mod runtime;
mod status;
#[cfg(test)]
mod tampered;

/// The identity of this build: a hash of the sources and of Cargo.lock, 16 hexadecimal digits.
pub const BUILD: &str = env!("ALLIANCE_BUILD");

/// The version and the build of all programs of this package.
pub const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    " (build ",
    env!("ALLIANCE_BUILD"),
    ")"
);

/// Compare task allocation in multi-robot teams under reproducible faults
#[derive(Parser)]
#[command(name = "alliance", version = VERSION)]
struct AllianceCli {
    #[command(subcommand)]
    command: Command,
}

// The order is that of `commands::HEADINGS`.
#[derive(Subcommand)]
enum Command {
    /// Run a mission with one process per robot
    Run(Box<run::args::RunCommand>),
    /// Show a live or finished run on a page in the browser
    Watch(page::watch::WatchCommand),
    /// Inject, list and clear faults in a live run
    Fault(fault::FaultArgs),
    /// Pause, resume, step or change the speed of a live run
    Clock(clock::ClockArgs),
    /// Show robots, processes, tasks and faults of a live run
    Status(status::StatusArgs),
    /// Replay a logged run and compare every tick
    Replay(analysis::replay::ReplayCommand),
    /// Find the first difference between two runs
    Diff(analysis::diff::DiffCommand),
    /// Create a page with figures and metrics of one or two runs
    Report(analysis::report::command::ReportCommand),
    /// Export a run to other formats
    Export(analysis::export::ExportCommand),
    /// Run many variants of a mission with many seeds
    Sweep(analysis::sweep::command::SweepCommand),
    /// Compare allocators under the same faults, with significance
    Compare(analysis::compare::command::CompareCommand),
    /// Search for good allocator parameters, tested on unseen seeds
    Tune(analysis::tune::command::TuneCommand),
    /// Search for faults that break an allocator, and shrink them
    Hunt(analysis::hunt::command::HuntCommand),
    /// Run a suite that never changes, or check a result of it
    Bench(analysis::bench::command::BenchCommand),
    /// Explain a scenario's parameters and report conflicts
    Check(analysis::check::CheckCommand),
    /// Convert an instance of other programs into a scenario
    Import(analysis::instance::command::ImportCommand),
    /// List scenarios, allocators, missions and runs, or describe one
    List(list::ListCommand),
    /// Start a run on several machines, or single processes by hand
    Cluster(cluster_command::ClusterCommand),
    /// Generate completion scripts and manual pages
    Generate(generate::GenerateCommand),
    #[command(hide = true)]
    Shell(run::shell::ShellCommand),
}

/// Returns the scenarios, missions and allocators of this program.
#[must_use]
pub fn program_content() -> Known {
    Known {
        vocabulary: Registry::current().vocabulary(),
        worlds: Registry::current().worlds().clone(),
    }
}

/// Returns the command with the size options of this program's missions, headings and examples.
fn full_command() -> clap::Command {
    let vocabulary = Registry::current().vocabulary();
    commands::complete(with_size_options(AllianceCli::command(), &vocabulary))
}

/// Returns the controllers in Python of a command that executes a plan.
fn plan_controllers(command: &mut Command) -> Option<&mut ControllerFiles> {
    match command {
        Command::Sweep(command) => Some(command.controllers()),
        Command::Compare(command) => Some(command.controllers()),
        Command::Tune(command) => Some(command.controllers()),
        Command::Bench(command) => Some(command.controllers()),
        _ => None,
    }
}

/// Executes a plan command in a process of the Python package. The registry contains its controllers. `modules`: the files
/// that the files of the controllers have imported.
#[must_use]
pub fn execute_plan(registry: Registry, words: &[OsString], modules: Vec<PathBuf>) -> ExitCode {
    registry.install();
    cluster::session::prepare_process();
    log_to_stderr(LogArgs::default(), "alliance");
    let mut command: AllianceCli = match arguments::parse_words(&full_command(), words) {
        Ok(command) => command,
        Err(status) => return status,
    };
    if let Some(controllers) = plan_controllers(&mut command.command) {
        controllers.modules = modules;
    }
    match command.command {
        Command::Sweep(command) => command.run(&program_content()),
        Command::Compare(command) => command.run(&program_content()),
        Command::Tune(command) => command.run(&program_content()),
        Command::Bench(command) => command.run(&program_content()),
        _ => {
            stderr_line!(
                "alliance: the Python package executes sweep, compare, tune and bench; use the program `alliance`"
            );
            ExitCode::from(2)
        }
    }
}

/// Parses the arguments of this process and executes the command. The registry contains the missions and allocators. Child processes
/// run the same program, so they have the same registry.
#[must_use]
pub fn main(registry: Registry) -> ExitCode {
    registry.install();
    program_build::set(BUILD);
    cluster::session::prepare_process();
    // First, so that a child of a dead launcher does not start.
    let ready =
        run::child_processes::die_with_launcher().and_then(|()| limits::check_process_limits());
    if let Err(error) = ready {
        return fail("alliance", &error, 3);
    }
    let mut command: AllianceCli = match arguments::parse(&full_command()) {
        Ok(command) => command,
        Err(status) => return status,
    };
    match &command.command {
        Command::Run(command) => command.start_log(),
        Command::Cluster(command) => command.start_log(),
        _ => log_to_stderr(LogArgs::default(), "alliance"),
    }
    if let Some(controllers) = plan_controllers(&mut command.command) {
        match controllers.need_python(&Registry::current().vocabulary()) {
            Ok(false) => {}
            Ok(true) => return python::execute_this_command(),
            Err(problem) => return fail("alliance", &problem, 2),
        }
    }
    match command.command {
        Command::Run(command) => command.run(),
        Command::Watch(command) => command.run(),
        Command::Fault(command) => command.run(),
        Command::Clock(command) => command.run(),
        Command::Status(command) => command.run(),
        Command::Replay(command) => command.run(replay_controllers::compare),
        Command::Diff(command) => command.run(),
        Command::Report(command) => command.run(),
        Command::Export(command) => command.run(page::file::write),
        Command::Sweep(command) => command.run(&program_content()),
        Command::Compare(command) => command.run(&program_content()),
        Command::Tune(command) => command.run(&program_content()),
        Command::Hunt(command) => command.run(&program_content()),
        Command::Bench(command) => command.run(&program_content()),
        Command::Check(command) => command.run(&program_content()),
        Command::Import(command) => command.run(&program_content()),
        Command::List(command) => command.run(),
        Command::Cluster(command) => command.run(),
        Command::Generate(command) => command.run(full_command()),
        Command::Shell(command) => command.run(),
    }
}

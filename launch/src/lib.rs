//! The `alliance` command: runs a mission with one process per robot, or one part of it by hand.
//!
//! - [`run`]: starts world and agents by running this very program again, watches them, and shows how it went.
//! - [`cluster`], [`keys`]: a team on several machines, and what its members prove by who they are.
//! - `control`: a client of a live run, for `fault`, `clock` and `status`.
//! - [`page`]: a run in the browser, live or from its log; [`observer`]: what it and the launcher see of a live run.
//! - What is made of runs is [`study`]'s.

// They panic where nothing can be written; `alliance_proto::terminal` does not.
#![warn(clippy::print_stdout, clippy::print_stderr)]

use std::process::ExitCode;

use alliance_proto::tell;
use clap::{CommandFactory, Parser, Subcommand};
pub use missions::Registry;
use robot_agent::args::AgentArgs;
use world_server::args::{Known, WorldArgs, log_to_stderr};
use world_server::size::with_size_words;

mod allocators_command;
pub mod arguments;
mod clock;
pub mod cluster;
mod completions_command;
pub mod control;
mod fault;
pub mod keys;
mod limits;
mod ls_command;
mod man_command;
mod missions_command;
pub mod observer;
pub mod page;
mod parameters;
mod replay_minds;
pub mod run;
mod runtime;
mod scenarios_command;
mod status;
#[cfg(test)]
mod tampered;

/// Studies fault-tolerant robot teams: a world, one process per robot, ALLIANCE, and faults that repeat exactly.
#[derive(Parser)]
#[command(name = "alliance", version)]
struct AllianceCli {
    #[command(subcommand)]
    part: Part,
}

#[derive(Subcommand)]
enum Part {
    /// Run a mission: one world and one process per robot
    Run(run::args::RunCommand),
    /// Own a run by hand: physics, sensing and the step clock
    World(WorldArgs),
    /// Be one robot of a live run by hand
    Agent(AgentArgs),
    /// Be a host of runs over a network: start and watch the agents of its robots
    Host(cluster::host::HostCommand),
    /// Be a router on the way to the world of a run over a network
    Router(cluster::host::RouterCommand),
    /// Run over several machines, as a cluster file says
    Cluster(cluster::ClusterCommand),
    #[command(hide = true)]
    Shell(run::shell::ShellCommand),
    /// Make certificates and secrets of a team on several machines
    Keys(keys::KeysCommand),
    /// Run a logged run again and compare every tick
    Replay(study::replay::ReplayCommand),
    /// Name the first difference between two runs
    Diff(study::diff::DiffCommand),
    /// Break things in a live run, list and heal them
    Fault(fault::FaultArgs),
    /// Hold and drive the step clock of a live run
    Clock(clock::ClockArgs),
    /// Show how a live run goes: robots, processes, tasks, motivations, faults
    Status(status::StatusArgs),
    /// List live runs, and those whose logs lie in a folder
    Ls(ls_command::LsCommand),
    /// Serve a page on which a live run is watched and interfered with
    Watch(page::watch::WatchCommand),
    /// Show a finished run on a page
    View(page::view::ViewCommand),
    /// Show what happened in a run, or in two: figures and metrics on a page
    Report(study::report::command::ReportCommand),
    /// Write a run as MCAP or Parquet, for other tools, or as a scenario to run again
    Export(study::export::ExportCommand),
    /// Run a mission in many variants and with many seeds, on all cores
    Sweep(study::sweep::command::SweepCommand),
    /// Compare allocators under the same faults, and say how sure the differences are
    Compare(study::compare::command::CompareCommand),
    /// Find good parameters of allocators, and judge them on seeds that the search has never seen
    Tune(study::tune::command::TuneCommand),
    LallianceStrategies(study::strategies::command::StrategiesCommand),
    /// Say what the parameters of a scenario mean, and which of them do not go together
    Check(study::check::CheckCommand),
    /// List the built-in scenarios, or print one
    Scenarios(scenarios_command::ScenariosCommand),
    /// List the allocators, or the parameters of one
    Allocators(allocators_command::AllocatorsCommand),
    /// List the missions, or the parameters of one
    Missions(missions_command::MissionsCommand),
    /// Print what a shell needs to complete the command line
    Completions(completions_command::CompletionsCommand),
    /// Write manual pages of the command and of each of its parts
    Man(man_command::ManCommand),
}

/// What scenarios of this program may speak of, and which are built in.
#[must_use]
pub fn known() -> Known {
    Known {
        vocabulary: Registry::of_this_program().vocabulary(),
        worlds: Registry::of_this_program().worlds().clone(),
    }
}

/// The command as this program has it, with the words of its missions.
fn whole() -> clap::Command {
    with_size_words(
        AllianceCli::command(),
        &Registry::of_this_program().vocabulary(),
    )
}

/// The whole command: reads the arguments of this process and does what they say. The registry says which allocators there are; every
/// process that the command starts is this program again, so it knows them too.
#[must_use]
pub fn main(registry: Registry) -> ExitCode {
    registry.install();
    alliance_proto::session::prepare_process();
    // Before anything else: a child whose launcher has died meanwhile shall not begin.
    let ready = run::children::die_with_launcher().and_then(|()| limits::allow_a_process());
    if let Err(error) = ready {
        tell!("alliance: {error:#}");
        return ExitCode::from(3);
    }
    log_to_stderr();
    let command: AllianceCli = match arguments::parse(&Registry::of_this_program().vocabulary()) {
        Ok(command) => command,
        Err(status) => return status,
    };
    match command.part {
        Part::Run(command) => command.run(),
        Part::World(world) => world.run(&known()),
        Part::Agent(agent) => agent.run(Registry::of_this_program().agents()),
        Part::Host(host) => host.run(),
        Part::Router(router) => router.run(),
        Part::Cluster(cluster) => cluster.run(),
        Part::Shell(command) => command.run(),
        Part::Keys(command) => command.run(),
        Part::Replay(command) => command.run(replay_minds::ask),
        Part::Diff(command) => command.run(),
        Part::Fault(command) => command.run(),
        Part::Clock(command) => command.run(),
        Part::Status(command) => command.run(),
        Part::Ls(command) => command.run(),
        Part::Watch(command) => command.run(),
        Part::View(command) => command.run(),
        Part::Report(command) => command.run(),
        Part::Export(command) => command.run(),
        Part::Sweep(command) => command.run(&known()),
        Part::Compare(command) => command.run(&known()),
        Part::Tune(command) => command.run(&known()),
        Part::LallianceStrategies(command) => command.run(),
        Part::Check(command) => command.run(&known()),
        Part::Scenarios(command) => command.run(),
        Part::Allocators(command) => command.run(),
        Part::Missions(command) => command.run(),
        Part::Completions(command) => command.run(whole()),
        Part::Man(command) => command.run(whole()),
    }
}

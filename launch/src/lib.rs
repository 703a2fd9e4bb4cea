//! The `alliance` command: runs a mission with one process per robot, or one part of it by hand.
//!
//! - [`run`]: starts world and agents by running this very program again, watches them, and shows how it went.
//! - [`in_process`]: the same run without processes and sockets.
//! - [`check`]: what a scenario's parameters mean, before anything runs.
//! - [`scenarios`]: the built-in ones.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use robot_agent::args::AgentArgs;
use world_server::args::{WorldArgs, log_to_stderr};

mod arguments;
pub mod check;
pub mod in_process;
pub mod run;
pub mod scenarios;
mod scenarios_command;

/// Studies fault-tolerant robot teams: a world, one process per robot, ALLIANCE, and faults that repeat exactly.
#[derive(Parser)]
#[command(name = "alliance", version)]
struct Command {
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
    /// Say what the parameters of a scenario mean, and which of them do not go together
    Check(check::CheckCommand),
    /// List the built-in scenarios, or print one
    Scenarios(scenarios_command::ScenariosCommand),
}

/// The whole command: reads the arguments of this process and does what they say.
#[must_use]
pub fn main() -> ExitCode {
    alliance_proto::session::prepare_process();
    // Before anything else: a child whose launcher has died meanwhile shall not begin.
    if let Err(error) = run::children::die_with_launcher() {
        eprintln!("alliance: {error:#}");
        return ExitCode::from(3);
    }
    log_to_stderr();
    let command: Command = match arguments::parse() {
        Ok(command) => command,
        Err(status) => return status,
    };
    match command.part {
        Part::Run(command) => command.run(),
        Part::World(world) => world.run(scenarios::text_of),
        Part::Agent(agent) => agent.run(),
        Part::Check(command) => command.run(),
        Part::Scenarios(command) => command.run(),
    }
}

//! `alliance cluster`: runs on several machines, and single processes by hand. `up` starts a run, `host` is the daemon on each other
//! host, [`keys`] makes certificates, [`check`] checks a machine.

pub mod check;
pub mod host;
pub mod keys;
mod up;

use std::process::ExitCode;

use clap::{Args, Subcommand};
use missions::Registry;
use robot_agent::args::AgentArgs;
use world_server::args::WorldArgs;

use crate::program_content;

/// Start a run on several machines, or single processes by hand
#[derive(Args, Clone, Debug)]
#[command(arg_required_else_help = true)]
pub struct ClusterCommand {
    #[command(subcommand)]
    action: ClusterAction,
}

#[derive(Subcommand, Clone, Debug)]
enum ClusterAction {
    /// Start the world and this host's robots, and wait for other hosts
    Up(Box<up::Up>),
    /// Start and watch one host's agents, in one run after another
    Host(host::HostCommand),
    /// Connect one host's robots, started by hand, to the world
    Router(host::RouterCommand),
    /// Check one machine before a run: keys, address, clock and build
    Check(check::CheckCommand),
    /// Create certificates and secrets for a team on several machines
    Keys(keys::KeysCommand),
    /// Start the world process of a run: physics, sensing, step clock
    World(Box<WorldArgs>),
    /// Start one robot process of a live run
    Agent(AgentArgs),
}

impl ClusterCommand {
    #[must_use]
    pub fn run(&self) -> ExitCode {
        match &self.action {
            ClusterAction::Up(command) => command.run(),
            ClusterAction::Host(command) => command.run(),
            ClusterAction::Router(command) => command.run(),
            ClusterAction::Check(command) => command.run(),
            ClusterAction::Keys(command) => command.run(),
            ClusterAction::World(world) => world.run(&program_content()),
            ClusterAction::Agent(agent) => agent.run(Registry::current().agents()),
        }
    }
}

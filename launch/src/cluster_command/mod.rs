//! `alliance cluster`: runs on several machines, and single processes by hand. `up` starts a run, `host` is the daemon on each other
//! host, [`keys`] makes certificates, [`check`] checks a machine.

pub mod check;
pub mod host;
pub mod keys;
mod up;

use std::process::ExitCode;

use analysis::branch::BranchRequest;
use clap::{Args, Subcommand};
use cluster::process_log::{LogArgs, log_to_stderr};
use missions::Registry;
use robot_agent::args::AgentArgs;
use terminal::fail;
use world_server::args::WorldArgs;
use world_server::run_state::RunState;

use crate::foxglove::FoxgloveCommand;
use crate::program_content;
use crate::ros::{RosAgentArgs, RosCommand};

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
    World(Box<WorldCommand>),
    /// Publish a live run to ROS 2
    #[command(hide = !cfg!(feature = "ros"))]
    Ros(RosCommand),
    /// Serve a run to Foxglove
    #[command(hide = !cfg!(feature = "foxglove"))]
    Foxglove(FoxgloveCommand),
    /// Start one robot process of a live run
    Agent(Box<AgentCommand>),
}

/// Start the world process of a run: physics, sensing, step clock
#[derive(Args, Clone, Debug)]
struct WorldCommand {
    #[command(flatten)]
    world: WorldArgs,
    #[command(flatten)]
    branch: RepeatedRun,
}

/// Start one robot process of a live run
#[derive(Args, Clone, Debug)]
struct AgentCommand {
    #[command(flatten)]
    agent: AgentArgs,
    #[command(flatten)]
    ros: RosAgentArgs,
    #[command(flatten)]
    branch: RepeatedRun,
}

/// The run that a process repeats before it takes part.
#[derive(Args, Clone, Debug)]
struct RepeatedRun {
    /// Branch as JSON, from the launcher
    #[arg(long, hide = true, value_name = "JSON", value_parser = branch_request)]
    branch: Option<BranchRequest>,
}

fn branch_request(text: &str) -> Result<BranchRequest, String> {
    BranchRequest::from_json(text).map_err(|error| error.to_string())
}

impl WorldCommand {
    fn run(&self) -> ExitCode {
        match &self.branch.branch {
            None => self.world.run(&program_content()),
            Some(request) => self.world.continue_run(|folder| {
                let team = request.clone().open()?.world(folder)?;
                let (simulation, recorder, broadcasts) = team.into_world();
                Ok(RunState {
                    simulation,
                    recorder,
                    broadcasts,
                })
            }),
        }
    }
}

impl AgentCommand {
    fn run(&self) -> ExitCode {
        if self.ros.is_on() {
            return self.ros.run(&self.agent);
        }
        let registry = Registry::current().agents();
        let Some(request) = &self.branch.branch else {
            return self.agent.run(registry);
        };
        let robot = self.agent.robot.clone().unwrap_or_default();
        match request.clone().open().and_then(|plan| plan.agent(&robot)) {
            Ok(snapshot) => self.agent.run_from(registry, snapshot),
            Err(error) => fail("robot-agent", &error, 3),
        }
    }
}

impl ClusterCommand {
    /// Starts the log of this process.
    pub fn start_log(&self) {
        match &self.action {
            ClusterAction::Up(command) => command.start_log(),
            ClusterAction::Host(command) => command.start_log(),
            ClusterAction::Router(command) => command.start_log(),
            ClusterAction::Check(_) | ClusterAction::Keys(_) => {
                log_to_stderr(LogArgs::default(), "alliance");
            }
            ClusterAction::Ros(command) => command.start_log(),
            ClusterAction::Foxglove(command) => command.start_log(),
            ClusterAction::World(command) => command.world.start_log(),
            ClusterAction::Agent(command) => command.agent.start_log(),
        }
    }

    #[must_use]
    pub fn run(&self) -> ExitCode {
        match &self.action {
            ClusterAction::Up(command) => command.run(),
            ClusterAction::Host(command) => command.run(),
            ClusterAction::Router(command) => command.run(),
            ClusterAction::Check(command) => command.run(),
            ClusterAction::Keys(command) => command.run(),
            ClusterAction::Ros(command) => command.run(),
            ClusterAction::Foxglove(command) => command.run("alliance cluster foxglove"),
            ClusterAction::World(command) => command.run(),
            ClusterAction::Agent(command) => command.run(),
        }
    }
}

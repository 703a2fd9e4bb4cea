//! The executable of a single robot process.

use std::process::ExitCode;

use clap::Parser;
use robot_agent::args::AgentArgs;

/// Run one robot of a mission, with its allocator and controller, connected to the world and the team over zenoh.
#[derive(Parser)]
#[command(name = "robot-agent", version = launch::VERSION)]
struct AgentCli {
    #[command(flatten)]
    agent: AgentArgs,
}

fn main() -> ExitCode {
    proto::program_build::set(launch::BUILD);
    cluster::session::prepare_process();
    let agent = AgentCli::parse().agent;
    agent.start_log();
    agent.run(launch::Registry::current().agents())
}

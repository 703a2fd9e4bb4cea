//! The executable of a single world process.

use std::process::ExitCode;

use clap::Parser;
use world_server::args::{WorldArgs, log_to_stderr};

/// Run the world of a mission: physics, sensing and the step clock. Without a scenario it runs the default mission.
#[derive(Parser)]
#[command(version)]
struct WorldCli {
    #[command(flatten)]
    world: WorldArgs,
}

fn main() -> ExitCode {
    cluster::session::prepare_process();
    log_to_stderr();
    WorldCli::parse().world.run(&launch::program_content())
}

//! The executable of a single world process.

use std::process::ExitCode;

use clap::Parser;
use world_server::args::WorldArgs;

/// Run the world of a mission: physics, sensing and the step clock. Without a scenario it runs the default mission.
#[derive(Parser)]
#[command(name = "world-server", version = launch::VERSION)]
struct WorldCli {
    #[command(flatten)]
    world: WorldArgs,
}

fn main() -> ExitCode {
    proto::program_build::set(launch::BUILD);
    cluster::session::prepare_process();
    let world = WorldCli::parse().world;
    world.start_log();
    world.run(&launch::program_content())
}

//! The world as a process of its own.

use std::process::ExitCode;

use clap::Parser;
use world_server::args::{WorldArgs, log_to_stderr};

/// The world of a mission: physics, sensing and the step clock. Scenarios are files; without one, the default mission.
#[derive(Parser)]
#[command(version)]
struct WorldCli {
    #[command(flatten)]
    world: WorldArgs,
}

fn main() -> ExitCode {
    alliance_proto::session::prepare_process();
    log_to_stderr();
    WorldCli::parse().world.run(&launch::known())
}

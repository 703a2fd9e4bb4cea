//! The agent of a robot whose controller is a node of ROS.
//!
//! For the run, it is an external controller as any other. In each tick it publishes the readings of the robot, and
//! answers with a command that it has received. `commands` selects the command, `node` is the connection to ROS,
//! `clock` decides which agent publishes the time, and `controller` is the robot's side.

mod clock;
mod commands;
mod controller;
mod node;

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, bail};
use cluster::locator::Locator;
use missions::Registry;
use robot_agent::allocator::{AllocatorKind, ConfigError};
use robot_agent::args::AgentArgs;
use scenario::AllocatorSpec;
use terminal::fail;
use tokio::runtime::Handle;
use tokio::task::spawn_blocking;
use tokio::time::timeout;
use zenoh::Session;

use super::dropped::DroppedCommands;
use super::topics::connect_with_patience;
use super::{RosAgentArgs, no_router};
use crate::runtime::start_runtime;
use controller::{FollowingAllocator, RosController};
use node::{Connection, RosNode};

/// The name of the controller in the registry. No scenario can contain it, because it is two words.
const CONTROLLER: &str = "ROS node";

/// The time to wait for the router of ROS.
const CONNECT_PATIENCE: Duration = Duration::from_secs(10);

/// The time to wait for a full queue before a message is dropped. The team waits, too.
const SEND_PATIENCE: Duration = Duration::from_millis(20);

/// Controls the robot by a node of ROS until the run ends. Returns the exit status.
pub fn run_robot(name: &str, args: &RosAgentArgs, agent: &AgentArgs) -> ExitCode {
    let session = match open_session(args.router()) {
        Ok(session) => session,
        Err(error) => return fail(name, &error, 3),
    };
    let dropped = Arc::new(DroppedCommands::default());
    let connection = Connection {
        session,
        domain: args.domain(),
        lockstep: args.lockstep_s().map(Duration::from_secs_f64),
        dropped: Arc::clone(&dropped),
    };
    let registry = Registry::current().agents().clone();
    let registry = registry.with_controller(controller_kind(connection));
    let status = agent.run_as(&registry, Some(CONTROLLER));
    dropped.report();
    ExitCode::from(status)
}

fn open_session(router: &Locator) -> anyhow::Result<Session> {
    let runtime = start_runtime()?;
    let wanted = router.clone();
    let opened = runtime.block_on(async {
        // Opening a session blocks its thread until there is a router.
        let connecting = spawn_blocking(move || {
            Handle::current().block_on(connect_with_patience(&wanted, SEND_PATIENCE))
        });
        timeout(CONNECT_PATIENCE, connecting).await
    });
    runtime.shutdown_background();
    let Ok(opened) = opened else {
        bail!(no_router(router));
    };
    opened.context("the thread that connects to the router of ROS")?
}

fn controller_kind(connection: Connection) -> AllocatorKind {
    let spec = AllocatorSpec {
        name: CONTROLLER,
        about: "a node of ROS 2",
        parameters: [].into(),
        needs_ground_truth: false,
        learns_times: false,
    };
    AllocatorKind::with_controller::<FollowingAllocator, RosController>(
        spec,
        move |setup| {
            let mut robots = setup.scenario.robots.iter();
            let robot = robots.position(|robot| robot.controller.as_deref() == Some(CONTROLLER));
            let node = robot
                .context("the robot is not in the scenario")
                .and_then(|robot| RosNode::new(&connection, robot, setup));
            node.map(Arc::new).map_err(|error| ConfigError {
                subject: CONTROLLER.to_owned(),
                why: format!("{error:#}"),
            })
        },
        |node, robot, setup| RosController::new(Arc::clone(node), robot, setup),
    )
}

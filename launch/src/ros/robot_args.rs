//! The options of an agent whose robot a node of ROS controls.

use std::process::ExitCode;

use clap::Args;
use cluster::locator::Locator;
use robot_agent::args::AgentArgs;
use terminal::fail;
use world_server::mission_args::positive_time;

#[cfg(not(feature = "ros"))]
use super::publish::run_robot;
#[cfg(feature = "ros")]
use super::robot::run_robot;
use super::{OPTION, ROUTER, check_feature, domain, router};

/// The options of an agent whose robot a node of ROS controls.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "ROS 2")]
#[cfg_attr(not(feature = "ros"), allow(dead_code, reason = "only ROS needs them"))]
pub struct RosAgentArgs {
    /// Let a node in this domain of ROS 2 control the robot [default: 0]
    #[arg(
        long,
        value_name = "DOMAIN",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0",
        value_parser = domain(),
        hide = !cfg!(feature = "ros")
    )]
    ros: Option<u8>,
    /// Address of the zenoh router of ROS
    #[arg(
        long,
        value_name = "LOCATOR",
        requires = "ros",
        default_value = ROUTER,
        value_parser = router,
        hide = !cfg!(feature = "ros")
    )]
    ros_router: Locator,
    /// Wait in each tick for the command with its stamp, at most this wall-clock time [default: 2s]
    #[arg(
        long,
        value_name = "TIME",
        requires = "ros",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "2s",
        value_parser = positive_time,
        hide = !cfg!(feature = "ros")
    )]
    ros_lockstep: Option<f64>,
}

impl RosAgentArgs {
    /// Returns whether a node of ROS controls the robot.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.ros.is_some()
    }

    /// Returns the domain of ROS.
    #[cfg(feature = "ros")]
    pub(super) fn domain(&self) -> u8 {
        self.ros.unwrap_or_default()
    }

    /// Returns the address of the router of ROS.
    #[cfg(feature = "ros")]
    pub(super) fn router(&self) -> &Locator {
        &self.ros_router
    }

    /// Returns the longest wait for a stamped command, s; `None` without lockstep.
    #[cfg(feature = "ros")]
    pub(super) fn lockstep_s(&self) -> Option<f64> {
        self.ros_lockstep
    }

    /// Joins the run, and passes readings and commands between the robot and ROS until the run ends.
    ///
    /// The exit statuses are those of an agent, and 3 without a router.
    #[must_use]
    pub fn run(&self, agent: &AgentArgs) -> ExitCode {
        const NAME: &str = "alliance cluster agent";
        match check_feature(OPTION) {
            Ok(()) => run_robot(NAME, self, agent),
            Err(error) => fail(NAME, &error, 2),
        }
    }
}

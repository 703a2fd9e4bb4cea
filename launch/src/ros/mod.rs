//! The topics of a live run in ROS 2: a process that reads the log of the run and publishes it over `rmw_zenoh`.
//! [`bodies`] is the connection to bodies of another world.
//!
//! The process has a zenoh session of its own, to the router of ROS. It takes part neither in the bus of the team nor in
//! that of the operators, so nothing in ROS reaches the run. Only with control, it offers services that send commands on
//! the control topic of the run.
//!
//! `robot` is the agent of a robot whose controller is a node of ROS.

pub mod bodies;
#[cfg(feature = "ros")]
mod control;
#[cfg(feature = "ros")]
mod dropped;
#[cfg(feature = "ros")]
mod publish;
#[cfg(not(feature = "ros"))]
#[path = "without_ros.rs"]
mod publish;
#[cfg(feature = "ros")]
mod robot;
mod robot_args;
#[cfg(feature = "ros")]
mod topics;

use std::path::PathBuf;
use std::process::ExitCode;

use analysis::{LATEST, optional};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use cluster::locator::{Locator, Transport};
use cluster::process_log::{LogArgs, log_to_stderr};
pub use robot_args::RosAgentArgs;
use run_log::LogLevel;
use scenario::{Problem, Setup};
use terminal::fail;

use crate::run::observers::ObserverCommand;
use bodies::BridgeSettings;

/// The name of the process and of the feature.
const ROS: &str = "ros";

/// The option of a run and of an agent, for error messages.
const OPTION: &str = "--ros";

/// The options that connect a run to ROS. Both would have a topic `/NAME/odom`, so they exclude each other.
const PEER: &str = "ros_peer";

/// The largest domain of ROS 2.
const DOMAIN_MAX: u64 = 232;

/// The address of the router that `rmw_zenohd` opens.
const ROUTER: &str = "tcp/127.0.0.1:7447";

/// The options of a run with topics in ROS 2.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "ROS 2")]
pub struct RosArgs {
    /// Publish the run in this domain of ROS 2 [default: 0], at 1x unless --speed says otherwise
    #[arg(
        long,
        value_name = "DOMAIN",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "0",
        value_parser = domain(),
        group = PEER,
        hide = !cfg!(feature = "ros")
    )]
    ros: Option<u8>,
    /// Take the bodies from another world, such as ros or ros:7 for a domain of ROS 2, at 1x
    #[arg(
        long,
        value_name = "ros[:DOMAIN]",
        value_parser = bodies::parse_world,
        group = PEER,
        conflicts_with_all = ["speed", "from"],
        hide = !cfg!(feature = "ros")
    )]
    external: Option<u8>,
    /// Offer services and a topic of ROS with which every node controls faults and clock
    #[arg(long, requires = "ros", hide = !cfg!(feature = "ros"))]
    ros_control: bool,
    /// Address of the zenoh router of ROS [default: tcp/127.0.0.1:7447]
    #[arg(long, value_name = "LOCATOR", requires = PEER, value_parser = router, hide = !cfg!(feature = "ros"))]
    ros_router: Option<Locator>,
}

/// Publish a live run to ROS 2
#[derive(Args, Clone, Debug)]
pub struct RosCommand {
    /// Folder of the run
    #[arg(value_name = "RUN", default_value = LATEST)]
    folder: PathBuf,
    /// Number of the ROS 2 domain
    #[arg(long, value_name = "DOMAIN", default_value = "0", value_parser = domain())]
    domain: u8,
    /// Address of the zenoh router of ROS
    #[arg(long, value_name = "LOCATOR", default_value = ROUTER, value_parser = router)]
    router: Locator,
    /// Offer services that control the live run with this id
    #[arg(long, value_name = "ID")]
    control: Option<String>,
    /// Run as the bridge to bodies of another world, with the settings on standard input
    #[arg(long, hide = true, exclusive = true)]
    bodies: bool,
    /// Publish from the start of the run, and wait for its folder
    #[arg(long, hide = true)]
    from_start: bool,
    #[command(flatten)]
    log: LogArgs,
}

fn domain() -> RangedU64ValueParser<u8> {
    RangedU64ValueParser::new().range(0..=DOMAIN_MAX)
}

fn router(text: &str) -> Result<Locator, Problem> {
    let why = match text.parse::<Locator>() {
        Ok(locator) if locator.transport == Transport::Tcp => return Ok(locator),
        Ok(_) => "needs certificates",
        Err(_) => "is not a network address",
    };
    let what = format!("'{}' {why}", text.escape_default());
    Err(Problem::of_value(
        what,
        format!("use tcp/ADDRESS:PORT, such as {ROUTER}"),
    ))
}

/// Checks that this program supports ROS, which the user's words `given` need.
fn check_feature(given: &str) -> anyhow::Result<()> {
    optional::check(given, ROS, cfg!(feature = "ros"))
}

/// Returns the error line for a router that is not there.
#[cfg(feature = "ros")]
fn no_router(router: &Locator) -> String {
    format!("no zenoh router has answered at {router}; start `ros2 run rmw_zenoh_cpp rmw_zenohd`")
}

impl RosArgs {
    /// Returns whether the run has topics in ROS 2.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.ros.is_some()
    }

    /// Returns whether the bodies of the run move in another world.
    #[must_use]
    pub fn has_external_bodies(&self) -> bool {
        self.external.is_some()
    }

    /// Returns the settings of the bridge, if the bodies of the run move in another world.
    ///
    /// # Errors
    /// Returns an error if ROS forbids the name of a robot.
    pub fn bridge(
        &self,
        setup: &Setup,
        stall_after_s: f64,
    ) -> Result<Option<BridgeSettings>, Problem> {
        let settings = |domain| BridgeSettings::new(setup, domain, self.router(), stall_after_s);
        self.external.map(settings).transpose()
    }

    fn router(&self) -> String {
        let given = self.ros_router.as_ref().map(ToString::to_string);
        given.unwrap_or_else(|| ROUTER.to_owned())
    }

    /// Checks a run before it starts.
    ///
    /// # Errors
    /// Returns an error if this program has no support of ROS, or if the run cannot be published.
    pub fn check(&self, setup: &Setup, log: LogLevel) -> anyhow::Result<()> {
        if self.has_external_bodies() {
            check_feature(bodies::OPTION)?;
            bodies::check(setup)?;
        }
        if self.is_on() {
            check_feature(OPTION)?;
            publish::check(setup, log)?;
        }
        Ok(())
    }

    /// Returns the process that publishes the run with this id, if it has topics in ROS 2.
    #[must_use]
    pub fn observer(&self, folder: PathBuf, run: &str) -> Option<ObserverCommand> {
        let command = RosCommand {
            folder,
            domain: self.ros?,
            router: self.router().parse().ok()?,
            control: self.ros_control.then(|| run.to_owned()),
            bodies: false,
            from_start: true,
            log: LogArgs::default(),
        };
        Some(ObserverCommand {
            name: ROS,
            title: "ROS",
            arguments: command.arguments(),
            description: command.describe(),
        })
    }
}

impl RosCommand {
    /// Returns the arguments of the process.
    fn arguments(&self) -> Vec<String> {
        let mut arguments = ["cluster", ROS].map(str::to_owned).to_vec();
        arguments.push(self.folder.display().to_string());
        arguments.push(format!("--domain={}", self.domain));
        arguments.push(format!("--router={}", self.router));
        if let Some(run) = &self.control {
            arguments.push(format!("--control={run}"));
        }
        if self.from_start {
            arguments.push("--from-start".to_owned());
        }
        arguments
    }

    /// Returns the description for people.
    fn describe(&self) -> String {
        let Self { domain, router, .. } = self;
        format!("ROS 2 domain {domain}, router {router}")
    }

    /// Starts the log of this process.
    pub fn start_log(&self) {
        log_to_stderr(self.log, ROS);
    }

    /// Publishes the run until it is over.
    ///
    /// Exit status 0 at the end of the run or after an interrupt, 2 if the run cannot be published, 3 if its log cannot be
    /// read or the connection failed.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        const NAME: &str = "alliance cluster ros";
        match check_feature("topics of ROS 2") {
            Ok(()) if self.bodies => bodies::run("alliance cluster ros --bodies"),
            Ok(()) => publish::run(NAME, self),
            Err(error) => fail(NAME, &error, 2),
        }
    }
}

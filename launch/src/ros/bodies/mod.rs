//! The bodies of a run in another world: a bridge process that receives their odometry and their scans, and publishes
//! their commands.
//!
//! The bridge has a zenoh session of its own, to the router of ROS. A socket connects it to the world of the run, which
//! receives only poses and beams. [`BodyBridge`] is the launcher's side.
//!
//! - `bridge`: the process. `received`: poses and scans of the other world. `commands`: the topics of the commands.

#[cfg(feature = "ros")]
mod bridge;
#[cfg(not(feature = "ros"))]
#[path = "without_ros.rs"]
mod bridge;
#[cfg(feature = "ros")]
mod commands;
#[cfg(feature = "ros")]
mod received;

use std::io::{BufRead, BufReader, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use anyhow::Context;
use missions::Registry;
use scenario::{Problem, Room, Setup};
use serde::{Deserialize, Serialize};
use terminal::panics::PANICKED;
use world_server::external_bodies::BridgeMessage;

use super::{DOMAIN_MAX, ROS};
use crate::run::child_processes::{Ending, Process};

pub use bridge::run;

/// The command-line option, for error messages.
pub const OPTION: &str = "--external";

/// The name of the process.
const BRIDGE: &str = "bridge";

/// The settings of the bridge, the first line on its standard input.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BridgeSettings {
    /// The domain of ROS 2.
    pub domain: u8,
    /// The address of the router of ROS.
    pub router: String,
    /// The ROS names of the robots, by rank.
    pub robots: Vec<String>,
    /// The properties of the bodies.
    pub bodies: BodySpec,
    /// The time of a step of the run, ms.
    pub step_ms: u64,
    /// The wall-clock time without a pose after which a body counts as lost, s.
    pub stall_after_s: f64,
}

/// The properties of bodies that poses and scans must fit.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct BodySpec {
    /// The room that contains all poses.
    pub room: Room,
    /// The radius of each body, m.
    pub radius_m: f32,
    /// The range of collision avoidance from the edge of a body, m.
    pub avoidance_range_m: f32,
}

/// A reason for which another world cannot supply the bodies. The run has not started.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct BridgeRefusal(#[from] Problem);

/// Parses the value of the option, and returns the domain.
///
/// # Errors
/// Returns the accepted forms as text.
pub fn parse_world(text: &str) -> Result<u8, String> {
    let domain = match text.split_once(':') {
        None if text == ROS => Ok(0),
        Some((ROS, domain)) => domain.parse(),
        _ => return Err(format!("use '{ROS}', or '{ROS}:DOMAIN' such as '{ROS}:7'")),
    };
    match domain {
        Ok(domain) if u64::from(domain) <= DOMAIN_MAX => Ok(domain),
        _ => Err(format!("the domain must be 0 to {DOMAIN_MAX}")),
    }
}

/// Checks that the bodies of a run can move in another world.
///
/// # Errors
/// Returns an error if the mission needs bodies that push, or if ROS forbids the name of a robot.
pub fn check(setup: &Setup) -> anyhow::Result<()> {
    let scenario = &setup.scenario;
    let world = Registry::current().worlds().find(scenario)?;
    if !(world.bars)(scenario).is_empty() {
        let what = format!(
            "bodies of another world cannot push, and mission '{}' needs it",
            world.data.name()
        );
        let remedy = "use another mission, or leave --external out";
        return Err(Problem::with_source(OPTION, what, remedy).into());
    }
    bridge::robot_names(setup)?;
    Ok(())
}

impl BridgeSettings {
    /// Creates the settings for a run that [`check`] has accepted.
    ///
    /// # Errors
    /// Returns an error if ROS forbids the name of a robot.
    pub fn new(
        setup: &Setup,
        domain: u8,
        router: String,
        stall_after_s: f64,
    ) -> Result<Self, Problem> {
        let scenario = &setup.scenario;
        Ok(Self {
            domain,
            router,
            robots: bridge::robot_names(setup)?,
            bodies: BodySpec {
                room: scenario.room,
                radius_m: scenario.body.radius_m,
                avoidance_range_m: scenario.sensors.avoidance_range_m,
            },
            step_ms: scenario.step_ms,
            stall_after_s,
        })
    }

    /// Returns the description for people.
    #[must_use]
    pub fn describe(&self) -> String {
        let Self { domain, router, .. } = self;
        format!("bodies in another world: ROS 2 domain {domain}, router {router}")
    }

    /// Starts a bridge. Returns the other end of its socket.
    fn start(&self, log: &Path) -> anyhow::Result<(Process, UnixStream)> {
        let (mut ours, theirs) = UnixStream::pair().context("socket of the bridge")?;
        let arguments = ["cluster", ROS, "--bodies"].map(str::to_owned);
        let input = OwnedFd::from(theirs).into();
        let process = Process::start_with(BRIDGE, log, &arguments, input, &[], false)?;
        let settings = serde_json::to_string(self)? + "\n";
        ours.write_all(settings.as_bytes())
            .context("settings of the bridge")?;
        Ok((process, ours))
    }
}

/// The bridge of a run, as its launcher sees it.
pub struct BodyBridge {
    settings: BridgeSettings,
    log: PathBuf,
    process: Process,
    /// `true` after the end of the process has been handled.
    is_over: bool,
}

impl BodyBridge {
    /// Starts the bridge and waits until all bodies have sent a pose. Returns the socket for the world.
    ///
    /// # Errors
    /// Returns [`BridgeRefusal`] if a body has sent no pose in time or the router of ROS is missing, and other errors if the
    /// process cannot be started or fails.
    pub fn start(settings: &BridgeSettings, logs: &Path) -> anyhow::Result<(Self, OwnedFd)> {
        // No robot can have this name.
        let log = logs.join(format!("{BRIDGE}.topics.log"));
        let (process, socket) = settings.start(&log)?;
        // The buffer contains one byte, so that the next messages stay in the socket.
        let mut reader = BufReader::with_capacity(1, socket);
        let mut line = String::new();
        reader.read_line(&mut line).context("the bridge")?;
        match serde_json::from_str(&line) {
            Ok(BridgeMessage::Refused(why)) => {
                return Err(BridgeRefusal(Problem::of_value(why, "")).into());
            }
            Ok(BridgeMessage::Ready) => {}
            _ => anyhow::bail!("the bridge failed; {}", process.failure_output()),
        }
        let bridge = Self {
            settings: settings.clone(),
            log,
            process,
            is_over: false,
        };
        Ok((bridge, reader.into_inner().into()))
    }

    /// Returns the process id.
    #[must_use]
    pub fn pid(&self) -> u32 {
        self.process.pid()
    }

    /// Reports the end of a bridge that failed. If it could not stop the bodies, another one does so.
    ///
    /// # Errors
    /// If the state of the process cannot be read.
    pub fn poll(&mut self, say: &dyn Fn(&str)) -> anyhow::Result<()> {
        while self.process.poll()?.is_some() {}
        let ending = match self.process.ending() {
            Some(ending) if !self.is_over => ending,
            _ => return Ok(()),
        };
        self.is_over = true;
        if ending == Ending::Exit(0) {
            return Ok(());
        }
        if let Ending::Signal(_) | Ending::Exit(PANICKED) = ending {
            say(&format!(
                "the bridge to the other world {}; the run ends",
                ending.describe()
            ));
            // A bridge whose socket is closed stops the bodies and ends.
            let (process, socket) = self.settings.start(&self.log)?;
            drop(socket);
            self.process = process;
        } else {
            let lines = self.process.last_log_lines();
            let reason = lines.lines().last().unwrap_or_default().trim_start();
            say(&format!("{reason}; the run ends"));
        }
        Ok(())
    }

    /// Returns the process that has not ended: the bridge, or the one that stops the bodies in its place.
    pub fn live_process(&mut self) -> Option<&mut Process> {
        Some(&mut self.process).filter(|process| process.ending().is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_are_parsed() {
        assert_eq!(parse_world("ros"), Ok(0));
        assert_eq!(parse_world("ros:7"), Ok(7));
        assert_eq!(parse_world("ros:232"), Ok(232));
        for wrong in ["", "ros:", "ros:233", "ros:-1", "ros7", "gazebo"] {
            assert!(parse_world(wrong).is_err(), "{wrong}");
        }
    }
}

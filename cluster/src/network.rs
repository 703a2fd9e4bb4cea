//! Settings of a run over a network: the world's addresses and the robots of each host.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::access::LinkMembers;
use crate::file::check_host_name;
use crate::key_files::KeyFiles;
use crate::keyring::Keyring;
use crate::locator::Locator;
use anyhow::{Context, bail};
use clap::Args;
use proto::identity::WORLD;
use scenario::{Problem, Scenario};

#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Network")]
pub struct NetworkArgs {
    /// Listen for robots and hosts, such as at tls/10.0.0.1:7447
    #[arg(long, value_name = "LOCATOR", requires = "keys")]
    pub listen: Vec<String>,
    /// Folder of the world's keys, from `alliance cluster keys`; - for standard input
    #[arg(long, value_name = "DIR")]
    pub keys: Option<PathBuf>,
    /// Robots on another host; repeatable
    #[arg(long = "place", value_name = "HOST=ROBOT,…", value_parser = place, requires = "listen")]
    pub robot_hosts: Vec<(String, Vec<String>)>,
    /// Do not encrypt; everyone on the network can read the messages
    #[arg(long)]
    pub unencrypted: bool,
}

impl NetworkArgs {
    /// Returns the requested network settings, or `None` if the run stays on one machine.
    pub fn network(&self, scenario: &Scenario) -> anyhow::Result<Option<Network>> {
        let Some(keys) = self.keys.as_ref().filter(|_| !self.listen.is_empty()) else {
            return Ok(None);
        };
        let mut listen = Vec::new();
        for at in &self.listen {
            let locator = Locator::from_option(at, self.unencrypted).context("--listen")?;
            listen.push(locator.to_string());
        }
        let mut hosts: BTreeMap<String, Vec<String>> = BTreeMap::new();
        let mut placed = BTreeSet::new();
        for (host, robots) in &self.robot_hosts {
            let option = format!("--place {host}");
            for robot in robots {
                let found = scenario.find_robot((), robot);
                found.with_context(|| option.clone())?;
                if !placed.insert(robot) {
                    let what = format!("robot '{robot}' is placed twice");
                    bail!(Problem::with_source(option, what, "list it once"));
                }
            }
            hosts
                .entry(host.clone())
                .or_default()
                .extend(robots.iter().cloned());
        }
        let files = KeyFiles::from_option(keys).context("--keys")?;
        Ok(Some(Network {
            listen,
            keyring: Keyring::read(&files, WORLD).context("--keys")?,
            hosts,
        }))
    }
}

fn place(text: &str) -> Result<(String, Vec<String>), Problem> {
    let words = || Problem::of_value("use HOST=ROBOT,ROBOT", "");
    let (host, robots) = text.split_once('=').ok_or_else(words)?;
    check_host_name((), host)?;
    Ok((
        host.to_owned(),
        robots.split(',').map(ToOwned::to_owned).collect(),
    ))
}

#[derive(Clone, Debug)]
pub struct Network {
    /// The network addresses as Zenoh locators, in addition to the socket for this machine.
    pub listen: Vec<String>,
    /// The world's certificates and the secret of the team.
    pub keyring: Keyring,
    /// The robots of each host. Robots without an entry connect directly or belong to the launcher.
    pub hosts: BTreeMap<String, Vec<String>>,
}

impl Network {
    /// Returns all identities that may send messages from outside: each robot for itself, each host for its robots.
    #[must_use]
    pub fn members(&self, scenario: &Scenario) -> Vec<LinkMembers> {
        let robots = scenario.robots.iter();
        let robots = robots.map(|robot| LinkMembers::robot(&robot.name));
        let hosts = self.hosts.iter();
        let hosts = hosts.map(|(host, robots)| LinkMembers::host(host, robots.clone()));
        robots.chain(hosts).collect()
    }

    /// Returns the host of a robot, or `None` if the robot has no entry.
    #[must_use]
    pub fn host_of(&self, robot: &str) -> Option<&str> {
        let mut hosts = self.hosts.iter();
        let (host, _) = hosts.find(|(_, robots)| robots.iter().any(|name| name == robot))?;
        Some(host)
    }
}

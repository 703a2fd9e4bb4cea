//! The secrets that the world uses to seal and open messages.

use std::collections::BTreeMap;

use proto::identity;
use proto::keys::{KeyExpressions, LAUNCHER_HOST};
use proto::secret::{OpenError, Secret, derived};
use scenario::Scenario;
use scenario::ids::RobotId;
use serde::de::DeserializeOwned;

use cluster::network::Network;

pub struct Seals {
    token: String,
    keys: KeyExpressions,
    /// The run's secret: for operators and observers.
    pub run: Secret,
    /// Names and secrets in order of rank.
    robots: Vec<(String, Secret)>,
    ranks: BTreeMap<String, RobotId>,
    hosts: BTreeMap<String, Secret>,
    /// The robots' hosts in order of rank.
    hosts_of: Vec<String>,
    is_networked: bool,
}

impl Seals {
    /// Derives all secrets from the token of the run.
    #[must_use]
    pub fn new(
        token: &str,
        keys: KeyExpressions,
        scenario: &Scenario,
        network: Option<&Network>,
    ) -> Self {
        let names = || scenario.robots.iter().map(|robot| robot.name.as_str());
        let host_of = |robot| network.and_then(|network| network.host_of(robot));
        let hosts = network.into_iter().flat_map(|network| network.hosts.keys());
        Self {
            token: token.to_owned(),
            keys,
            run: Secret::from_token(token),
            robots: names()
                .map(|name| (name.to_owned(), Secret::of_robot(token, name)))
                .collect(),
            ranks: names()
                .enumerate()
                .map(|(rank, name)| (name.to_owned(), RobotId(rank as u32)))
                .collect(),
            hosts: hosts
                .map(|host| {
                    (
                        host.clone(),
                        Secret::from_token(&derived(token, &identity::host(host))),
                    )
                })
                .collect(),
            hosts_of: names()
                .map(|name| host_of(name).unwrap_or(LAUNCHER_HOST).to_owned())
                .collect(),
            is_networked: network.is_some(),
        }
    }

    #[must_use]
    pub fn is_networked(&self) -> bool {
        self.is_networked
    }

    #[must_use]
    pub fn rank(&self, robot: &str) -> Option<RobotId> {
        self.ranks.get(robot).copied()
    }

    #[must_use]
    pub fn robot(&self, robot: RobotId) -> &Secret {
        &self.robots[robot.index()].1
    }

    /// Returns the secret of a robot by name. An unknown robot has one as well, which seals the refusal.
    #[must_use]
    pub fn robot_named(&self, name: &str) -> Secret {
        Secret::of_robot(&self.token, name)
    }

    /// Returns the secret of a host's launcher, or `None` for an unknown host.
    #[must_use]
    pub fn host(&self, host: &str) -> Option<&Secret> {
        match host {
            LAUNCHER_HOST => Some(&self.run),
            _ => self.hosts.get(host),
        }
    }

    #[must_use]
    pub fn host_of(&self, robot: RobotId) -> &str {
        &self.hosts_of[robot.index()]
    }

    /// Opens a report or a broadcast that arrived on this key.
    pub fn open<T: DeserializeOwned>(&self, key: &str, sealed: &[u8]) -> Result<T, OpenError> {
        let sender = self.keys.parse_robot(key).and_then(|name| self.rank(name));
        self.robot(sender.ok_or(OpenError::Unsealed)?)
            .open(key, sealed)
    }
}

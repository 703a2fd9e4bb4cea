//! What the world seals its messages with, and opens those of others.

use std::collections::BTreeMap;

use alliance_proto::ids::RobotId;
use alliance_proto::keys::{Keys, LAUNCHER_HOST};
use alliance_proto::member;
use alliance_proto::scenario::Scenario;
use alliance_proto::secret::{OpenError, Pairs, Secret, derived};
use alliance_proto::team::Broadcast;

use crate::network::Network;

/// All secrets of a run.
pub struct Seals {
    token: String,
    keys: Keys,
    /// Of the run: for those who order and watch, and for broadcasts on one machine.
    pub run: Secret,
    /// By rank.
    robots: Vec<(String, Secret)>,
    ranks: BTreeMap<String, RobotId>,
    hosts: BTreeMap<String, Secret>,
    /// The host of each robot, by rank.
    hosts_of: Vec<String>,
    /// In a run over a network.
    pairs: Option<Pairs>,
}

impl Seals {
    /// Those that belong to the token of the run.
    #[must_use]
    pub fn new(token: &str, keys: Keys, scenario: &Scenario, network: Option<&Network>) -> Self {
        let names = || scenario.robots.iter().map(|robot| robot.name.as_str());
        let host_of = |robot| network.and_then(|network| network.host_of(robot));
        let hosts = network.into_iter().flat_map(|network| network.hosts.keys());
        let mut seals = Self {
            token: token.to_owned(),
            keys,
            run: Secret::of(token),
            robots: names()
                .map(|name| (name.to_owned(), Secret::of_robot(token, name)))
                .collect(),
            ranks: names()
                .enumerate()
                .map(|(rank, name)| (name.to_owned(), RobotId(rank as u16)))
                .collect(),
            hosts: hosts
                .map(|host| {
                    (
                        host.clone(),
                        Secret::of(&derived(token, &member::host(host))),
                    )
                })
                .collect(),
            hosts_of: names()
                .map(|name| host_of(name).unwrap_or(LAUNCHER_HOST).to_owned())
                .collect(),
            pairs: None,
        };
        if network.is_some() {
            let keys = seals.pairs_of(member::WORLD);
            seals.pairs = Some(Pairs::new(seals.robots.len(), keys));
        }
        seals
    }

    /// Whether the run is one over a network.
    #[must_use]
    pub fn is_networked(&self) -> bool {
        self.pairs.is_some()
    }

    /// Rank of the robot of that name.
    #[must_use]
    pub fn rank(&self, robot: &str) -> Option<RobotId> {
        self.ranks.get(robot).copied()
    }

    /// Of the robot of that rank.
    #[must_use]
    pub fn robot(&self, robot: RobotId) -> &Secret {
        &self.robots[robot.index()].1
    }

    /// Of the robot of that name; a robot that there is not has one, too, to be told so.
    #[must_use]
    pub fn robot_named(&self, name: &str) -> Secret {
        Secret::of_robot(&self.token, name)
    }

    /// Of the launcher on that host; `None` where there is no such host.
    #[must_use]
    pub fn host(&self, host: &str) -> Option<&Secret> {
        match host {
            LAUNCHER_HOST => Some(&self.run),
            _ => self.hosts.get(host),
        }
    }

    /// The host of a robot.
    #[must_use]
    pub fn host_of(&self, robot: RobotId) -> &str {
        &self.hosts_of[robot.index()]
    }

    /// What a robot is welcomed with: the keys that it has in common with each robot, by rank, and with the world.
    #[must_use]
    pub fn pairs_for(&self, robot: RobotId) -> Option<Vec<u128>> {
        let name = &self.robots[robot.index()].0;
        self.pairs.as_ref()?;
        Some(self.pairs_of(&member::robot(name)))
    }

    fn pairs_of(&self, identity: &str) -> Vec<u128> {
        let names = self.robots.iter().map(|(name, _)| member::robot(name));
        let members: Vec<String> = names.chain([member::WORLD.to_owned()]).collect();
        let members: Vec<&str> = members.iter().map(String::as_str).collect();
        Pairs::keys(&self.token, identity, &members)
    }

    /// Opens a broadcast that came on that key.
    ///
    /// # Errors
    /// Any [`OpenError`].
    pub fn open_broadcast(&self, key: &str, sealed: &[u8]) -> Result<Broadcast, OpenError> {
        let Some(pairs) = &self.pairs else {
            return self.run.open(key, sealed);
        };
        let sender = self.keys.parse_robot(key).and_then(|name| self.rank(name));
        pairs.open(key, sealed, sender.ok_or(OpenError::Unsealed)?.index())
    }

    /// Opens a report that came on that key.
    ///
    /// # Errors
    /// Any [`OpenError`].
    pub fn open_report(
        &self,
        key: &str,
        sealed: &[u8],
    ) -> Result<alliance_proto::tick::Report, OpenError> {
        let sender = self.keys.parse_robot(key).and_then(|name| self.rank(name));
        self.robot(sender.ok_or(OpenError::Unsealed)?)
            .open(key, sealed)
    }
}

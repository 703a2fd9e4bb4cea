//! A run over a network: where its world listens, and which robots are on which host.

use std::collections::BTreeMap;

use alliance_proto::access::Speaker;
use alliance_proto::keyring::Keyring;
use alliance_proto::scenario::Scenario;

/// What a world that listens on a network needs to know.
#[derive(Clone, Debug)]
pub struct Network {
    /// Zenoh locators, besides the socket for this machine.
    pub listen: Vec<String>,
    /// Its certificates and the secret of the team.
    pub keyring: Keyring,
    /// Robots by host; those of none connect by themselves, or are the launcher's.
    pub hosts: BTreeMap<String, Vec<String>>,
}

impl Network {
    /// Everybody who may speak from outside: each robot for itself, and each host for its robots.
    #[must_use]
    pub fn speakers(&self, scenario: &Scenario) -> Vec<Speaker> {
        let robots = scenario.robots.iter();
        let robots = robots.map(|robot| Speaker::robot(&robot.name));
        let hosts = self.hosts.iter();
        let hosts = hosts.map(|(host, robots)| Speaker::host(host, robots.clone()));
        robots.chain(hosts).collect()
    }

    /// The host that has that robot.
    #[must_use]
    pub fn host_of(&self, robot: &str) -> Option<&str> {
        let mut hosts = self.hosts.iter();
        let (host, _) = hosts.find(|(_, robots)| robots.iter().any(|name| name == robot))?;
        Some(host)
    }
}

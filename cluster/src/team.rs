//! The members of a team on several machines.

use proto::identity;
use scenario::Scenario;

use crate::certificates::Member;
use crate::file::{Cluster, HostEntry};

/// The members of a team and their addresses.
#[derive(Clone, Debug)]
pub struct Team {
    pub world_at: Vec<String>,
    pub robots: Vec<String>,
    /// The hosts except the world's.
    pub hosts: Vec<HostEntry>,
    /// The name of the world's host in a cluster file. Then each host also has its robots.
    pub home: Option<String>,
}

impl Team {
    #[must_use]
    pub fn of_cluster(cluster: &Cluster, scenario: &Scenario) -> Self {
        Self {
            world_at: cluster.world_addresses(),
            robots: robot_names(scenario),
            hosts: cluster.others().cloned().collect(),
            home: Some(cluster.world_host().name.clone()),
        }
    }

    #[must_use]
    pub fn members(&self) -> Vec<Member> {
        let world = Member {
            identity: identity::WORLD.to_owned(),
            addresses: self.world_at.clone(),
        };
        let hosts = self.hosts.iter().map(|host| Member {
            identity: identity::host(&host.name),
            addresses: host.at.clone(),
        });
        let robots = self.robots.iter().map(|robot| Member {
            identity: identity::robot(robot),
            addresses: Vec::new(),
        });
        std::iter::once(world).chain(hosts).chain(robots).collect()
    }
}

/// Returns the names of all robots of a scenario.
#[must_use]
pub fn robot_names(scenario: &Scenario) -> Vec<String> {
    let robots = scenario.robots.iter();
    robots.map(|robot| robot.name.clone()).collect()
}

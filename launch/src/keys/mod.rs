//! `alliance keys`: makes what the members of a team on several machines prove by who they are.
//!
//! - [`mod@make`]: authority, certificates, secrets, in memory. `store`: the folder. Who reads it: [`alliance_proto::keyring`].

#[cfg(test)]
mod handshakes;
pub mod make;
mod store;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use alliance_proto::keys::is_name;
use alliance_proto::locator::is_address;
use alliance_proto::member;
use alliance_proto::scenario::Scenario;
use alliance_proto::{tell, terminal};
use anyhow::bail;
use clap::Args;
use study::table;
use time::OffsetDateTime;
use world_server::args::read_scenario;
use world_server::size::SizeArgs;

use crate::cluster::file::{Cluster, Host};
use make::{Dates, Member, make};

/// Make certificates and secrets of a team on several machines.
#[derive(Args, Clone, Debug)]
pub struct KeysCommand {
    /// A cluster file; with --at, a scenario: the name of a built-in one, or a TOML file
    #[arg(value_name = "CLUSTER|SCENARIO")]
    of: String,
    #[command(flatten)]
    size: SizeArgs,
    /// Address or name by which others connect to the world; may be given again
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    at: Vec<String>,
    /// A machine that answers for its robots, and where others connect to it if they do; may be given again
    #[arg(long = "host", value_name = "NAME[=ADDRESS,…]", value_parser = host, requires = "at")]
    hosts: Vec<Host>,
    /// Folder to make [default: keys, or what the cluster file says]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// How long they are valid from now on
    #[arg(long, value_name = "DAYS", default_value_t = 90, value_parser = clap::value_parser!(u32).range(1..=36_500))]
    days: u32,
}

/// A team and its places.
pub struct Team {
    /// Addresses and names of the world.
    world_at: Vec<String>,
    /// Names of all robots.
    robots: Vec<String>,
    /// All hosts but the world's.
    hosts: Vec<Host>,
    /// Name of the world's host, where there is a cluster file: then each host has its robots too.
    home: Option<String>,
}

impl KeysCommand {
    /// Makes the folder, and prints what goes where.
    ///
    /// Exit status 0, 2 for a mistake in arguments, cluster file or scenario, or when the folder is there already, 3 when it cannot be
    /// made.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let prepared = self.team().and_then(|(team, folder)| {
            store::refuse_existing(&folder)?;
            Ok((team, folder))
        });
        let (status, error) = match prepared {
            Err(error) => (2, error),
            Ok((team, folder)) => match self.carry_out(&team, &folder) {
                Ok(said) => return terminal::answer("alliance keys", said, ExitCode::SUCCESS),
                Err(error) => (3, error),
            },
        };
        tell!("alliance keys: {error:#}");
        ExitCode::from(status)
    }

    fn carry_out(&self, team: &Team, folder: &Path) -> anyhow::Result<String> {
        let members = team.members();
        let dates = Dates::days(OffsetDateTime::now_utc(), self.days);
        store::write(folder, &make(&members, dates)?)?;
        let (days, folder) = (self.days, folder.display());
        let said = format!(
            "{folder}: keys of {} members, valid for {days} days\n\n",
            members.len()
        );
        Ok(said + &team.what_goes_where())
    }

    /// The team, and the folder of its keys.
    fn team(&self) -> anyhow::Result<(Team, PathBuf)> {
        if self.at.is_empty() {
            return self.team_of_cluster();
        }
        let known = crate::known();
        let scenario = match self.size.scenario(Some(&self.of), &known.vocabulary)? {
            Some(sized) => sized,
            None => read_scenario(&self.of, &known)?,
        };
        let mut names: Vec<&str> = self.hosts.iter().map(|host| host.name.as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            bail!("--host {}: is named twice; name each host once", twice[0]);
        }
        let team = Team {
            world_at: self.at.clone(),
            robots: robots(&scenario),
            hosts: self.hosts.clone(),
            home: None,
        };
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from("keys"));
        Ok((team, folder))
    }

    fn team_of_cluster(&self) -> anyhow::Result<(Team, PathBuf)> {
        let vocabulary = crate::known().vocabulary;
        if vocabulary.builtin(&self.of).is_some() {
            let of = &self.of;
            bail!(
                "{of} is a scenario: say where its world is reached, --at ADDRESS, or name a cluster file"
            );
        }
        if self.size.scenario(None, &vocabulary)?.is_some() {
            bail!("a cluster file names its scenario: leave its size out");
        }
        let (cluster, scenario) = Cluster::read(Path::new(&self.of))?;
        let team = Team::of_cluster(&cluster, &scenario);
        Ok((team, self.out.clone().unwrap_or(cluster.keys)))
    }
}

impl Team {
    /// That of a cluster file.
    #[must_use]
    pub fn of_cluster(cluster: &Cluster, scenario: &Scenario) -> Self {
        Self {
            world_at: cluster.world_at(),
            robots: robots(scenario),
            hosts: cluster.others().cloned().collect(),
            home: Some(cluster.home().name.clone()),
        }
    }

    /// Everybody who needs keys.
    #[must_use]
    pub fn members(&self) -> Vec<Member> {
        let world = Member {
            identity: member::WORLD.to_owned(),
            at: self.world_at.clone(),
        };
        let hosts = self.hosts.iter().map(|host| Member {
            identity: member::host(&host.name),
            at: host.at.clone(),
        });
        let robots = self.robots.iter().map(|robot| Member {
            identity: member::robot(robot),
            at: Vec::new(),
        });
        std::iter::once(world).chain(hosts).chain(robots).collect()
    }

    /// For people who copy files.
    fn what_goes_where(&self) -> String {
        let of_robot = |robot: &String| format!(" robot-{robot}.*");
        let mut table = table::new(["host", "needs"]);
        for host in &self.hosts {
            let robots: String = match self.home {
                Some(_) => host.robots.iter().map(of_robot).collect(),
                None => " robot-NAME.* of each of its robots".to_owned(),
            };
            table.add_row([&host.name, &format!("ca.pem host-{}.*{robots}", host.name)]);
        }
        if self.home.is_none() {
            table.add_row(["that of one robot alone", "ca.pem robot-NAME.*"]);
        }
        let here = self.home.as_deref().unwrap_or("the world's host");
        let rows = if table.is_empty() {
            String::new()
        } else {
            table.trim_fmt() + "\n\n"
        };
        format!(
            "{rows}world.* is for {here} alone. ca.key signs whom the team believes: keep it.\n"
        )
    }
}

fn robots(scenario: &Scenario) -> Vec<String> {
    let robots = scenario.robots.iter();
    robots.map(|robot| robot.name.clone()).collect()
}

fn address(text: &str) -> Result<String, String> {
    match is_address(text) {
        true => Ok(text.to_owned()),
        false => Err("write an IP address or the name of a machine, without a port".to_owned()),
    }
}

fn host(text: &str) -> Result<Host, String> {
    let (name, at) = match text.split_once('=') {
        Some((name, at)) => (name, at.split(',').map(address).collect::<Result<_, _>>()?),
        None => (text, Vec::new()),
    };
    if !is_name(name) {
        return Err(
            "a name is at most 32 letters, digits, - and _, from a letter or digit on".to_owned(),
        );
    }
    Ok(Host {
        name: name.to_owned(),
        robots: Vec::new(),
        at,
    })
}

//! `alliance cluster keys`: certificates and secrets that authenticate the members of a team on several machines.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use analysis::table;
use anyhow::bail;
use clap::Args;
use cluster::locator::is_address;
use scenario::Problem;
use scenario::limits::read_name;
use terminal::fail;
use time::OffsetDateTime;
use world_server::mission_args::read_scenario;
use world_server::size::SizeArgs;

use cluster::certificates::{CertificateDates, make};
use cluster::file::{Cluster, HostEntry};
use cluster::store;
use cluster::team::{Team, robot_names};

/// Create certificates and secrets for a team on several machines
#[derive(Args, Clone, Debug)]
pub struct KeysCommand {
    /// Cluster file; with --at, a built-in scenario or a TOML file
    #[arg(value_name = "CLUSTER|SCENARIO")]
    source: String,
    #[command(flatten)]
    size: SizeArgs,
    /// Address or name by which others connect to the world; repeatable
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    at: Vec<String>,
    /// Host of robots, with the addresses by which others connect to it; repeatable
    #[arg(long = "host", value_name = "NAME[=ADDRESS,…]", value_parser = host, requires = "at")]
    hosts: Vec<HostEntry>,
    /// Folder to create [default: keys, or the folder in the cluster file]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Validity from now on
    #[arg(long, value_name = "DAYS", default_value_t = 90, value_parser = clap::value_parser!(u32).range(1..=36_500))]
    days: u32,
}

impl KeysCommand {
    /// Creates the folder and prints which host needs which files.
    ///
    /// Exit status 0, 2 for a mistake in arguments, cluster file or scenario, or an existing folder, 3 if the folder cannot be created.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let prepared = self.team().and_then(|(team, folder)| {
            store::refuse_existing(&folder)?;
            Ok((team, folder))
        });
        let (status, error) = match prepared {
            Err(error) => (2, error),
            Ok((team, folder)) => match self.carry_out(&team, &folder) {
                Ok(text) => {
                    return terminal::print_result(
                        "alliance cluster keys",
                        text,
                        ExitCode::SUCCESS,
                    );
                }
                Err(error) => (3, error),
            },
        };
        fail("alliance cluster keys", &error, status)
    }

    fn carry_out(&self, team: &Team, folder: &Path) -> anyhow::Result<String> {
        let members = team.members();
        let dates = CertificateDates::days(OffsetDateTime::now_utc(), self.days);
        store::write(folder, &make(&members, dates)?)?;
        let (days, folder) = (self.days, folder.display());
        let days = match days {
            1 => "1 day".to_owned(),
            _ => format!("{days} days"),
        };
        let text = format!(
            "{folder}: keys of {} members, valid for {days}\n\n",
            members.len()
        );
        Ok(text + &distribution(team))
    }

    /// Returns the team and the folder of its keys.
    fn team(&self) -> anyhow::Result<(Team, PathBuf)> {
        if self.at.is_empty() {
            return self.team_of_cluster();
        }
        let known = crate::program_content();
        let scenario = match self.size.scenario(Some(&self.source), &known.vocabulary)? {
            Some(sized) => sized,
            None => read_scenario(&self.source, &known)?,
        };
        let mut names: Vec<&str> = self.hosts.iter().map(|host| host.name.as_str()).collect();
        names.sort_unstable();
        if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            bail!(
                "--host {}: the host is given twice; give each host once",
                twice[0]
            );
        }
        let team = Team {
            world_at: self.at.clone(),
            robots: robot_names(&scenario),
            hosts: self.hosts.clone(),
            home: None,
        };
        let folder = self.out.clone().unwrap_or_else(|| PathBuf::from("keys"));
        Ok((team, folder))
    }

    fn team_of_cluster(&self) -> anyhow::Result<(Team, PathBuf)> {
        let known = crate::program_content();
        let vocabulary = &known.vocabulary;
        if vocabulary.builtin(&self.source).is_some() {
            let source = &self.source;
            bail!(
                "{source} is a scenario; give the address of its world, --at ADDRESS, or name a cluster file"
            );
        }
        if self.size.scenario(None, vocabulary)?.is_some() {
            bail!("a cluster file contains its scenario; leave the size out");
        }
        let (cluster, scenario) =
            Cluster::read(Path::new(&self.source), |name| read_scenario(name, &known))?;
        let team = Team::of_cluster(&cluster, &scenario);
        Ok((team, self.out.clone().unwrap_or(cluster.keys)))
    }
}

/// Returns a table of the files that each host needs.
fn distribution(team: &Team) -> String {
    let of_robot = |robot: &String| format!(" robot-{robot}.*");
    let mut table = table::new(["host", "needs"]);
    for host in &team.hosts {
        let robots: String = match team.home {
            Some(_) => host.robots.iter().map(of_robot).collect(),
            None => " robot-NAME.* of each of its robots".to_owned(),
        };
        table.add_row([&host.name, &format!("ca.pem host-{}.*{robots}", host.name)]);
    }
    if team.home.is_none() {
        table.add_row(["a single robot", "ca.pem robot-NAME.*"]);
    }
    let home = team.home.as_deref().unwrap_or("the world's host");
    let rows = if table.is_empty() {
        String::new()
    } else {
        table.trim_fmt() + "\n\n"
    };
    format!(
        "{rows}world.* is only for {home}. ca.key signs the team's certificates: keep it secret.\n"
    )
}

fn address(text: &str) -> Result<String, Problem> {
    let remedy = "use an IP address or the name of a machine, without a port";
    match is_address(text) {
        true => Ok(text.to_owned()),
        false => Err(Problem::of_value(remedy, "")),
    }
}

fn host(text: &str) -> Result<HostEntry, Problem> {
    let (name, at) = match text.split_once('=') {
        Some((name, at)) => (name, at.split(',').map(address).collect::<Result<_, _>>()?),
        None => (text, Vec::new()),
    };
    Ok(HostEntry {
        name: read_name(name)?,
        robots: Vec::new(),
        at,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_and_addresses_are_read_from_the_command_line() {
        let read = host("h2=10.0.0.2,two.example.org").unwrap();
        assert_eq!((read.name.as_str(), read.at.len()), ("h2", 2));
        assert!(host("h2").unwrap().at.is_empty());
        for wrong in ["", "h 2", "h2=", "h2=10.0.0.2:7447", "=10.0.0.2"] {
            assert!(host(wrong).is_err(), "{wrong}");
        }
    }
}

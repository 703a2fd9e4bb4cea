//! `alliance cluster check`: what a run on several machines needs of one of them, before the run.

use std::fmt::Write as _;
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context, bail};
use clap::Args;
use cluster::file::Cluster;
use cluster::key_files::KeyFiles;
use cluster::keyring::Keyring;
use cluster::locator::Locator;
use proto::identity::{self, WORLD};
use time::OffsetDateTime;
use world_server::mission_args::read_scenario;

/// The time for a connection to the world.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);

/// Check one machine before a run: keys, their dates, the address of the world, clock and build
#[derive(Args, Clone, Debug)]
pub struct CheckCommand {
    /// Cluster file: scenario, hosts, the robots of each host, and the address of the world
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Host of this machine [default: the host of the world]
    #[arg(long, value_name = "HOST")]
    name: Option<String>,
    /// Folder with the keys of this machine [default: the folder in the cluster file]
    #[arg(long, value_name = "DIR")]
    keys: Option<PathBuf>,
}

impl CheckCommand {
    /// Prints one line per check. Exit status 0 if all succeed, 1 if one fails, 2 for a mistake in the arguments or the cluster
    /// file.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        match self.checks() {
            Ok((text, status)) => terminal::print_result("alliance cluster check", text, status),
            Err(error) => terminal::fail("alliance cluster check", &error, 2),
        }
    }

    fn checks(&self) -> anyhow::Result<(String, ExitCode)> {
        let (mut cluster, _) = Cluster::read(&self.cluster, |asked| {
            read_scenario(asked, &crate::program_content())
        })?;
        let world = &cluster.world_host().name;
        let name = self.name.clone().unwrap_or_else(|| world.clone());
        let is_world = name == *world;
        if let Some(keys) = &self.keys {
            cluster.keys.clone_from(keys);
        }
        let Some(host) = cluster.hosts.iter().find(|host| host.name == name) else {
            let names: Vec<&str> = cluster.hosts.iter().map(|host| &*host.name).collect();
            let file = self.cluster.display();
            bail!(
                "{file} has no host '{name}'; its hosts are {}",
                names.join(", ")
            );
        };
        let robots: &[String] = if is_world { &[] } else { &host.robots };
        let identity = match is_world {
            true => WORLD.to_owned(),
            false => identity::host(&name),
        };
        let address = match is_world {
            true => free(&cluster.listen),
            false => reached(&cluster.world_locator()),
        };
        let checks = [
            ("keys", keys(&cluster, &identity, robots)),
            ("world", address),
        ];
        let mut text = String::new();
        for (what, result) in &checks {
            let _ = match result {
                Ok(found) => writeln!(text, "ok      {what}: {found}"),
                Err(error) => writeln!(text, "failed  {what}: {error:#}"),
            };
        }
        // Only a comparison of all machines shows that these differ.
        let now = OffsetDateTime::now_utc().replace_nanosecond(0)?;
        let build = crate::BUILD;
        let _ = writeln!(text, "compare clock: {now}");
        let _ = writeln!(text, "compare build: {build}");
        let is_ok = checks.iter().all(|(_, result)| result.is_ok());
        Ok((text, ExitCode::from(u8::from(!is_ok))))
    }
}

/// Checks the keys of a member and the secrets of its robots.
fn keys(cluster: &Cluster, identity: &str, robots: &[String]) -> anyhow::Result<String> {
    let files = KeyFiles::Folder(std::path::absolute(&cluster.keys)?);
    let keyring = Keyring::read(&files, identity)?;
    for robot in robots {
        Keyring::secret(&files, &identity::robot(robot))?;
    }
    if let Some(ends) = keyring.ends_soon() {
        bail!(ends);
    }
    Ok(format!("{identity} in {}", cluster.keys.display()))
}

/// Checks that the world can listen at its address.
fn free(locator: &Locator) -> anyhow::Result<String> {
    TcpListener::bind((&*locator.host, locator.port)).with_context(|| {
        format!(
            "cannot listen at {locator}; end the program that uses the port, or choose another one"
        )
    })?;
    Ok(format!("{locator} is free"))
}

/// Checks that the world's address can be reached.
fn reached(locator: &Locator) -> anyhow::Result<String> {
    let context = || {
        format!(
            "no connection to {locator}; start `alliance cluster up` there, or correct address, port or firewall"
        )
    };
    let addresses = (&*locator.host, locator.port).to_socket_addrs();
    let address = addresses
        .with_context(context)?
        .next()
        .with_context(context)?;
    TcpStream::connect_timeout(&address, CONNECT_LIMIT).with_context(context)?;
    Ok(format!("{locator} accepts connections"))
}

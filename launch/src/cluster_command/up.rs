//! `alliance cluster up`: starts the world of a run over several machines and the robots of this host.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

use analysis::shell::shell_quoted;
use anyhow::{Context, bail};
use clap::Args;
use cluster::key_files::{KeyFiles, STANDARD_INPUT};
use cluster::keyring::Keyring;
use cluster::locator::Transport;
use proto::identity::WORLD;
use terminal::{fail, stderr_line};
use world_server::mission_args::read_scenario;

use crate::run::args::{RemoteSettings, RunCommand};
use cluster::file::Cluster;
use cluster::start::StartPlan;

/// Start the world and the robots of this host, and wait for the other hosts
#[derive(Args, Clone, Debug)]
pub struct Up {
    /// Cluster file: scenario, hosts, the robots of each host, and the address of the world
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    /// Start the other hosts by a command with {name} and {at} (a host's name and address), with new keys
    #[arg(long, value_name = "COMMAND")]
    start: Option<String>,
    #[command(flatten)]
    run: RunCommand,
}

impl Up {
    /// Starts the log of this process.
    pub fn start_log(&self) {
        self.run.start_log();
    }

    /// Runs the command. The exit status is that of `alliance run`.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        match self.command() {
            Ok(command) => command.run(),
            Err(error) => fail("alliance cluster up", &error, 2),
        }
    }

    /// Returns the `alliance run` command for the cluster file.
    fn command(&self) -> anyhow::Result<RunCommand> {
        let (cluster, scenario) = Cluster::read(&self.cluster, |asked| {
            read_scenario(asked, &crate::program_content())
        })?;
        let name = self.cluster.display();
        if self.run.selects_scenario() {
            bail!("{name} sets the scenario and the seed; leave SCENARIO, its size and --seed out");
        }
        let start = self.start.as_deref();
        let start = start.map(|command| StartPlan::new(command, &cluster, &scenario));
        let start = start.transpose()?;
        let keys = if start.is_some() {
            PathBuf::from(STANDARD_INPUT)
        } else {
            // An absolute path, so that a folder named `-` does not select standard input.
            let folder = std::path::absolute(&cluster.keys).with_context(|| name.to_string())?;
            if !folder.is_dir() {
                bail!(
                    "{name}: keys: {} does not exist; create it with `alliance cluster keys {}`",
                    cluster.keys.display(),
                    shell_quoted(&self.cluster)
                );
            }
            let files = KeyFiles::Folder(folder.clone());
            let keyring = Keyring::read(&files, WORLD).with_context(|| name.to_string())?;
            if let Some(ends) = keyring.ends_soon() {
                stderr_line!("warning: {name}: {ends}");
            }
            folder
        };
        let mut arguments = vec![
            format!("--listen={}", cluster.listen),
            format!("--keys={}", keys.display()),
        ];
        if cluster.listen.transport == Transport::Tcp {
            arguments.push("--unencrypted".to_owned());
        }
        let mut elsewhere = BTreeSet::new();
        for host in cluster.others().filter(|host| !host.robots.is_empty()) {
            arguments.push(format!("--place={}={}", host.name, host.robots.join(",")));
            elsewhere.extend(host.robots.iter().cloned());
        }
        let over = RemoteSettings {
            arguments,
            remote_robots: elsewhere,
            start,
        };
        Ok(self.run.clone().over(over, cluster.scenario, cluster.seed))
    }
}

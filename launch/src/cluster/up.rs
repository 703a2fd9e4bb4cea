//! `alliance cluster`: starts the world of a run over several machines, and what belongs to it here; the hosts come by themselves.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

use alliance_proto::keyring::Keyring;
use alliance_proto::locator::Transport;
use alliance_proto::member::WORLD;
use alliance_proto::tell;
use anyhow::{Context, bail};
use clap::{Args, Subcommand};

use super::file::Cluster;
use crate::run::args::{Over, RunCommand};

/// Runs over several machines
#[derive(Args, Clone, Debug)]
pub struct ClusterCommand {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Clone, Debug)]
enum What {
    Up(Box<Up>),
}

/// Start the world of a cluster file, the robots of this host, and wait for the other hosts, where `alliance host` runs
#[derive(Args, Clone, Debug)]
struct Up {
    /// Cluster file: the scenario, the hosts, which robots are on which, and where the world is reached
    #[arg(value_name = "CLUSTER.toml")]
    cluster: PathBuf,
    #[command(flatten)]
    run: RunCommand,
}

impl ClusterCommand {
    /// Exit status as of `alliance run`.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let What::Up(up) = &self.what;
        match up.command() {
            Ok(command) => command.run(),
            Err(error) => {
                tell!("alliance cluster: {error:#}");
                ExitCode::from(2)
            }
        }
    }
}

impl Up {
    /// The run that the file asks for.
    fn command(&self) -> anyhow::Result<RunCommand> {
        let (cluster, _) = Cluster::read(&self.cluster)?;
        let name = self.cluster.display();
        if self.run.is_of_a_scenario() {
            bail!(
                "{name} says which scenario is run, with which seed; leave SCENARIO, its size and --seed out"
            );
        }
        Keyring::read(&cluster.keys, WORLD).with_context(|| name.to_string())?;
        let mut arguments = vec![
            format!("--listen={}", cluster.listen),
            format!("--keys={}", cluster.keys.display()),
        ];
        if cluster.listen.transport == Transport::Tcp {
            arguments.push("--unencrypted".to_owned());
        }
        let mut elsewhere = BTreeSet::new();
        for host in cluster.others().filter(|host| !host.robots.is_empty()) {
            arguments.push(format!("--place={}={}", host.name, host.robots.join(",")));
            elsewhere.extend(host.robots.iter().cloned());
        }
        let over = Over {
            arguments,
            elsewhere,
        };
        Ok(self.run.clone().over(over, cluster.scenario, cluster.seed))
    }
}

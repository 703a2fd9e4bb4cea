//! Hosts that `cluster up` starts. Their keys are created in memory for one run and sent by standard input.

use std::io::{self, PipeReader, Write};
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;

use crate::key_files::{MemoryKeyFiles, STANDARD_INPUT};
use crate::locator::{Locator, Transport};
use proto::identity::{self, WORLD};
use scenario::Scenario;
use time::OffsetDateTime;

use super::file::{Cluster, HostEntry};
use crate::certificates::{CertificateDates, KeyFile, make};
use crate::team::Team;

/// The validity of certificates for one run, in days; longer than any run.
const DAYS: u32 = 30;

#[derive(Clone, Debug)]
pub struct StartPlan {
    pub world: MemoryKeyFiles,
    pub hosts: Vec<HostCommandLine>,
}

#[derive(Clone, Debug)]
pub struct HostCommandLine {
    pub name: String,
    /// The shell command that runs `alliance` on that host.
    pub command: String,
    pub arguments: Vec<String>,
    /// The keys of the host and the secrets of its robots.
    pub keys: MemoryKeyFiles,
}

impl StartPlan {
    /// Creates the keys. In the command, `{name}` and `{at}` are replaced with a host's name and its first address.
    ///
    /// # Errors
    /// If the system has no random bits, or an address is invalid in a certificate.
    pub fn new(command: &str, cluster: &Cluster, scenario: &Scenario) -> anyhow::Result<Self> {
        let members = Team::of_cluster(cluster, scenario).members();
        let dates = CertificateDates::days(OffsetDateTime::now_utc(), DAYS);
        let files = make(&members, dates)?;
        let hosts = cluster.others().filter(|host| !host.robots.is_empty());
        Ok(Self {
            world: keys_of(WORLD, &[], &files),
            hosts: hosts
                .map(|host| HostCommandLine {
                    name: host.name.clone(),
                    command: command_of(command, host),
                    arguments: arguments(host, &cluster.world_locator()),
                    keys: keys_of(&identity::host(&host.name), &host.robots, &files),
                })
                .collect(),
        })
    }
}

fn command_of(command: &str, host: &HostEntry) -> String {
    let at = host.at.first().unwrap_or(&host.name);
    command.replace("{name}", &host.name).replace("{at}", at)
}

fn arguments(host: &HostEntry, world: &Locator) -> Vec<String> {
    let connect = world.to_string();
    let mut arguments = vec![
        "cluster",
        "host",
        "--name",
        &host.name,
        "--connect",
        &connect,
    ];
    arguments.extend(["--keys", STANDARD_INPUT, "--once"]);
    if world.transport == Transport::Tcp {
        arguments.push("--unencrypted");
    }
    arguments.into_iter().map(ToOwned::to_owned).collect()
}

/// Returns the keys of a member and the secrets of `robots`.
fn keys_of(identity: &str, robots: &[String], files: &[KeyFile]) -> MemoryKeyFiles {
    let mut names = vec!["ca.pem".to_owned()];
    names.extend(["pem", "key", "secret"].map(|ending| format!("{identity}.{ending}")));
    let robots = robots.iter();
    names.extend(robots.map(|robot| format!("{}.secret", identity::robot(robot))));
    let files = files.iter().filter(|file| names.contains(&file.name));
    files
        .map(|file| (file.name.clone(), file.text.clone()))
        .collect()
}

/// An open standard input of a host. Dropping it requests the end of the host.
pub struct InputHold(
    #[expect(dead_code, reason = "dropping it closes the host's standard input")] SyncSender<()>,
);

impl HostCommandLine {
    /// Creates a standard input that contains the keys and ends when the hold is dropped.
    pub fn input(&self) -> io::Result<(PipeReader, InputHold)> {
        let (reader, mut writer) = io::pipe()?;
        let (hold, closed) = sync_channel::<()>(0);
        let line = self.keys.to_line();
        // In a thread, because a slow network can delay the writing.
        thread::spawn(move || {
            // An error means that the host has ended, which the launcher detects.
            let _ = writer.write_all(line.as_bytes());
            let _ = closed.recv();
        });
        Ok((reader, InputHold(hold)))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::path::Path;

    use crate::key_files::KeyFiles;
    use crate::keyring::Keyring;
    use crate::tests::read_scenario;
    use proto::secret::derived;

    use super::*;

    const CLUSTER: &str = r#"scenario = "waste-cleanup"
listen = "tls/0.0.0.0:7447"
world = "h1"
[[hosts]]
name = "h1"
at = ["10.0.0.1"]
[[hosts]]
name = "h2"
robots = ["gold", "green"]
at = ["10.0.0.2", "two"]
[[hosts]]
name = "h3"
robots = ["blue"]
[[hosts]]
name = "h4"
"#;

    fn start(text: &str) -> StartPlan {
        let (cluster, scenario) =
            Cluster::parse("c.toml", text, Path::new("lab"), read_scenario).unwrap();
        StartPlan::new("ssh {at} x={name} alliance", &cluster, &scenario).unwrap()
    }

    #[test]
    fn each_host_with_robots_is_started_with_its_own_keys() {
        let start = start(CLUSTER);
        let [two, three] = &start.hosts[..] else {
            panic!("{start:?}");
        };
        assert_eq!(two.command, "ssh 10.0.0.2 x=h2 alliance");
        assert_eq!(three.command, "ssh h3 x=h3 alliance");
        let arguments = two.arguments.join(" ");
        assert_eq!(
            arguments,
            "cluster host --name h2 --connect tls/10.0.0.1:7447 --keys - --once"
        );
        let names = r#"{"ca.pem", "host-h2.key", "host-h2.pem", "host-h2.secret", "robot-gold.secret", "robot-green.secret"}"#;
        assert_eq!(format!("{:?}", two.keys), names);
        let world = KeyFiles::Memory(start.world.clone());
        let world = Keyring::read(&world, WORLD).unwrap();
        let of_two = KeyFiles::Memory(two.keys.clone());
        let ring = Keyring::read(&of_two, "host-h2").unwrap();
        assert_eq!(ring.ca, world.ca);
        assert_eq!(ring.secret, derived(&world.secret, "host-h2"));
        assert!(Keyring::secret(&of_two, "robot-blue").is_err());
    }

    #[test]
    fn an_unencrypted_run_starts_unencrypted_hosts() {
        let plain = CLUSTER.replace("tls/", "tcp/");
        let plain = plain.replace("world =", "unencrypted = true\nworld =");
        let start = start(&plain);
        let last = start.hosts[1].arguments.last().unwrap();
        assert_eq!(last, "--unencrypted");
    }

    #[test]
    fn each_run_has_new_keys() {
        assert_ne!(start(CLUSTER).world, start(CLUSTER).world);
    }

    #[test]
    fn the_input_of_a_host_is_its_keys_and_ends_with_the_hold() {
        let host = start(CLUSTER).hosts.remove(0);
        let (mut reader, hold) = host.input().unwrap();
        let line = host.keys.to_line();
        let mut read = vec![0; line.len()];
        reader.read_exact(&mut read).unwrap();
        assert_eq!(read, line.as_bytes());
        let rest = thread::spawn(move || reader.read_to_end(&mut Vec::new()).unwrap());
        thread::sleep(std::time::Duration::from_millis(20));
        assert!(!rest.is_finished());
        drop(hold);
        assert_eq!(rest.join().unwrap(), 0);
    }
}

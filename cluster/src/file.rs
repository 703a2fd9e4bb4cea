//! The cluster file: the scenario, the hosts and the robots of each host.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::locator::{Locator, Transport, is_address};
use anyhow::Context;
use proto::keys::LAUNCHER_HOST;
use scenario::limits::{check_known, check_name};
use scenario::{KeyPath, Problem, Scenario, TomlFile, decode_text};
use serde::Deserialize;

/// The contents of a cluster file after all checks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cluster {
    /// The name of a built-in scenario or the path of a scenario file.
    pub scenario: String,
    /// The seed of all random streams, if given.
    pub seed: Option<u64>,
    pub listen: Locator,
    pub keys: PathBuf,
    /// The index of the host that runs the world and the launcher.
    pub world: usize,
    /// The hosts in the order of the file.
    pub hosts: Vec<HostEntry>,
}

/// A machine that runs robots or the world.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HostEntry {
    /// The name, independent of network names.
    pub name: String,
    /// The names of the robots on this host.
    #[serde(default)]
    pub robots: Vec<String>,
    /// The addresses or names by which others connect to this host.
    #[serde(default)]
    pub at: Vec<String>,
}

/// The contents of the TOML file before checks.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Contents {
    scenario: String,
    seed: Option<u64>,
    listen: String,
    #[serde(default)]
    unencrypted: bool,
    #[serde(default = "default_keys")]
    keys: String,
    world: String,
    hosts: Vec<HostEntry>,
}

fn default_keys() -> String {
    "keys".to_owned()
}

impl Cluster {
    /// Reads a cluster file and its scenario.
    pub fn read(
        path: &Path,
        scenario: impl Fn(&str) -> anyhow::Result<Scenario>,
    ) -> anyhow::Result<(Self, Scenario)> {
        let name = path.display().to_string();
        let bytes = terminal::read_file(path)?;
        let text = decode_text(&name, bytes)?;
        let beside = path.parent().unwrap_or(Path::new(""));
        Self::parse(&name, &text, beside, scenario)
    }

    /// Parses the text of a cluster file. Its paths are relative to `beside`. `scenario` reads a scenario by name or path; `name` is for
    /// error messages.
    pub fn parse(
        name: &str,
        text: &str,
        beside: &Path,
        scenario: impl Fn(&str) -> anyhow::Result<Scenario>,
    ) -> anyhow::Result<(Self, Scenario)> {
        let file = TomlFile::parse(name, text)?;
        let contents: Contents = file.deserialize()?;
        let source = path_beside(beside, &contents.scenario);
        let line = file.line_of(["scenario"]);
        let place = || format!("{name}:{line}");
        let scenario = scenario(&source).with_context(place)?;
        let checked = check(&file, &contents, &scenario);
        let (world, listen) = checked.map_err(|problem| file.locate(problem))?;
        let cluster = Self {
            scenario: source,
            seed: contents.seed,
            listen,
            keys: beside.join(&contents.keys),
            world,
            hosts: contents.hosts,
        };
        Ok((cluster, scenario))
    }

    /// Returns the host of the world and the launcher.
    #[must_use]
    pub fn world_host(&self) -> &HostEntry {
        &self.hosts[self.world]
    }

    /// Returns the other hosts, which run `alliance cluster host`.
    pub fn others(&self) -> impl Iterator<Item = &HostEntry> {
        let all = self.hosts.iter().enumerate();
        all.filter(|(index, _)| *index != self.world)
            .map(|(_, host)| host)
    }

    /// Returns the locator by which others connect to the world.
    #[must_use]
    pub fn world_locator(&self) -> Locator {
        let mut locator = self.listen.clone();
        locator.host = self.world_addresses().swap_remove(0);
        locator
    }

    /// Returns the addresses and names by which others connect to the world; at least one.
    #[must_use]
    pub fn world_addresses(&self) -> Vec<String> {
        let mut at = self.world_host().at.clone();
        if !self.listen.is_unspecified() && !at.contains(&self.listen.host) {
            at.insert(0, self.listen.host.clone());
        }
        at
    }
}

/// Returns the name of a scenario, or the path of its file relative to the working directory.
fn path_beside(beside: &Path, source: &str) -> String {
    if source.ends_with(".toml") {
        beside.join(source).display().to_string()
    } else {
        source.to_owned()
    }
}

/// Checks the file against its scenario. Returns the index of the world's host and the world's address.
fn check(
    file: &TomlFile<'_>,
    contents: &Contents,
    scenario: &Scenario,
) -> Result<(usize, Locator), Problem> {
    let hosts = &contents.hosts;
    check_hosts(file, hosts)?;
    let names = hosts.iter().map(|host| host.name.as_str());
    check_known(
        ["world"],
        "there is no host",
        &contents.world,
        names.clone(),
    )?;
    // The check has found the name.
    let world = names
        .clone()
        .take_while(|name| *name != contents.world)
        .count();
    let listen = listen(contents)?;
    let home = &hosts[world];
    // The world needs an address for its certificate, by which others connect.
    if listen.is_unspecified() && home.at.is_empty() {
        let what = format!("no host can connect to {}", listen.host);
        let line = file.line_of(of_host(world, "name"));
        let remedy = format!(
            "state how others reach it in `at` of host '{}' on line {line}",
            home.name
        );
        return Err(Problem::at(["listen"], what, remedy));
    }
    check_robots(hosts, scenario)?;
    check_controllers(hosts, world, scenario)?;
    Ok((world, listen))
}

/// Checks that names are valid and unique, and addresses are valid.
fn check_hosts(file: &TomlFile<'_>, hosts: &[HostEntry]) -> Result<(), Problem> {
    if hosts.is_empty() {
        let remedy = "write [[hosts]] for each machine, with its name and robots";
        return Err(Problem::at(["hosts"], "there is no host", remedy));
    }
    let mut seen = BTreeMap::new();
    for (index, host) in hosts.iter().enumerate() {
        let at = of_host(index, "name");
        let name = &host.name;
        check_host_name(&at, name)?;
        if let Some(first) = seen.insert(name, index) {
            let line = file.line_of(of_host(first, "name"));
            let what = format!("host '{name}' is already defined on line {line}");
            let remedy = "name each host once, with all of its robots";
            return Err(Problem::at(at, what, remedy));
        }
        for (place, address) in host.at.iter().enumerate() {
            if !is_address(address) {
                let at = of_host(index, "at").index(place);
                let what =
                    format!("'{address}' is neither an IP address nor the name of a machine");
                let remedy = "write it without port, such as 10.0.0.2 or robots.example.org";
                return Err(Problem::at(at, what, remedy));
            }
        }
    }
    Ok(())
}

/// Rejects a text that cannot be the name of a host.
pub fn check_host_name(key: impl Into<KeyPath>, name: &str) -> Result<(), Problem> {
    if name == LAUNCHER_HOST {
        let what = format!("the name '{LAUNCHER_HOST}' is reserved");
        return Err(Problem::at(key, what, "give it another name"));
    }
    check_name(key, name)
}

fn listen(contents: &Contents) -> Result<Locator, Problem> {
    let locator = contents.listen.parse::<Locator>();
    let locator =
        locator.and_then(|locator| locator.allowed(contents.unencrypted, "unencrypted = true"));
    let locator = locator.map_err(|problem| problem.under(["listen"]))?;
    if contents.unencrypted && locator.transport == Transport::Tls {
        let what = format!("listen is {locator}, which is encrypted");
        return Err(Problem::at(
            ["unencrypted"],
            what,
            "leave one of the two out",
        ));
    }
    Ok(locator)
}

/// Checks that each robot of the scenario is on exactly one host.
fn check_robots(hosts: &[HostEntry], scenario: &Scenario) -> Result<(), Problem> {
    let mut placed = BTreeMap::new();
    for (index, host) in hosts.iter().enumerate() {
        for (place, robot) in host.robots.iter().enumerate() {
            let at = of_host(index, "robots").index(place);
            scenario.find_robot(&at, robot)?;
            if let Some(first) = placed.insert(robot.as_str(), &host.name) {
                let what = format!("robot '{robot}' is already on host '{first}'");
                return Err(Problem::at(at, what, "place each robot once"));
            }
        }
    }
    let team = scenario.robots.iter().map(|robot| robot.name.as_str());
    let unplaced: Vec<&str> = team.filter(|name| !placed.contains_key(name)).collect();
    if !unplaced.is_empty() {
        let what = format!("robots without a host: {}", unplaced.join(", "));
        return Err(Problem::at(
            ["hosts"],
            what,
            "place each robot of the scenario",
        ));
    }
    Ok(())
}

/// Checks that external controllers are on the world's host, because they connect by its local sockets.
fn check_controllers(
    hosts: &[HostEntry],
    world: usize,
    scenario: &Scenario,
) -> Result<(), Problem> {
    for (index, host) in hosts.iter().enumerate().filter(|(at, _)| *at != world) {
        for (place, name) in host.robots.iter().enumerate() {
            let at = of_host(index, "robots").index(place);
            if let Some(controller) = &scenario.find_robot(&at, name)?.controller {
                let what = format!(
                    "the controller '{controller}' of '{name}' is an external program, which runs only on the world's host"
                );
                let remedy = format!("place it on host '{}'", hosts[world].name);
                return Err(Problem::at(at, what, remedy));
            }
        }
    }
    Ok(())
}

fn of_host(index: usize, name: &str) -> KeyPath {
    KeyPath::new(["hosts"]).index(index).key(name)
}

#[cfg(test)]
mod tests {
    use scenario::testkit::entry;

    use super::*;
    use crate::tests::read_scenario;

    const GOOD: &str = r#"scenario = "waste-cleanup"
seed = 7
listen = "tls/10.0.0.1:7447"
keys = "keys"
world = "h1"
[[hosts]]
name = "h1"
robots = ["blue"]
[[hosts]]
name = "h2"
robots = ["gold", "green"]
at = ["10.0.0.2"]
"#;

    fn parse(text: &str) -> anyhow::Result<Cluster> {
        let (cluster, _) = Cluster::parse("c.toml", text, Path::new("lab"), read_scenario)?;
        Ok(cluster)
    }

    /// Returns the error messages for the good file with one piece replaced, for a snapshot.
    #[track_caller]
    fn refusals(replacements: &[(&str, &str)]) -> String {
        let answers = replacements.iter().map(|(piece, replaced)| {
            assert!(GOOD.contains(piece), "{piece}");
            let error = parse(&GOOD.replacen(piece, replaced, 1)).unwrap_err();
            let line = format!("{error:#}");
            assert_eq!(line.lines().count(), 1);
            assert!(line.starts_with("c.toml:"), "{line}");
            entry(&format!("{piece:?} becomes {replaced:?}"), &line)
        });
        answers.collect()
    }

    #[test]
    fn parses_a_complete_file() {
        let cluster = parse(GOOD).unwrap();
        assert_eq!(cluster.scenario, "waste-cleanup");
        assert_eq!(cluster.seed, Some(7));
        assert_eq!(cluster.listen.to_string(), "tls/10.0.0.1:7447");
        assert_eq!(cluster.keys, Path::new("lab/keys"));
        assert_eq!(cluster.world_host().robots, ["blue"]);
        let others: Vec<&str> = cluster.others().map(|host| host.name.as_str()).collect();
        assert_eq!(others, ["h2"]);
        assert_eq!(cluster.hosts[1].at, ["10.0.0.2"]);
        assert_eq!(cluster.world_addresses(), ["10.0.0.1"]);
        assert_eq!(cluster.world_locator(), cluster.listen);
    }

    #[test]
    fn paths_are_relative_to_the_cluster_file() {
        let text = GOOD.replace("\"waste-cleanup\"", "\"mine/own.toml\"");
        let error = parse(&text).unwrap_err();
        let line = format!("{error:#}");
        let expected = "c.toml:1: no scenario 'lab/mine/own.toml'";
        assert!(line.starts_with(expected), "{line}");
        let absolute = parse(&GOOD.replace("\"keys\"", "\"/etc/keys\"")).unwrap();
        assert_eq!(absolute.keys, Path::new("/etc/keys"));
        let usual = parse(&GOOD.replace("keys = \"keys\"\n", "")).unwrap();
        assert_eq!(usual.keys, Path::new("lab/keys"));
    }

    #[test]
    fn a_world_on_all_interfaces_needs_an_address() {
        let everywhere = GOOD.replace("10.0.0.1", "0.0.0.0");
        insta::assert_snapshot!(refusals(&[("10.0.0.1", "0.0.0.0")]));
        let named = everywhere.replace(
            "robots = [\"blue\"]",
            "robots = [\"blue\"]\nat = [\"world\"]",
        );
        let named = parse(&named).unwrap();
        assert_eq!(named.world_addresses(), ["world"]);
        assert_eq!(named.world_locator().to_string(), "tls/world:7447");
    }

    #[test]
    fn unknown_or_missing_keys_are_refused() {
        let answers = refusals(&[
            ("listen =", "lisen ="),
            ("robots = [\"gold", "robot = [\"gold"),
            ("listen = \"tls/10.0.0.1:7447\"\n", ""),
            ("world = \"h1\"\n", ""),
            ("name = \"h2\"\n", ""),
            ("seed = 7", "seed = -7"),
            ("= \"h1\"", "= h1"),
        ]);
        insta::assert_snapshot!(answers);
        let none = GOOD.split("[[hosts]]").next().unwrap().to_owned() + "hosts = []\n";
        let line = parse(&none).unwrap_err().to_string();
        assert!(
            line.starts_with("c.toml:6: hosts: there is no host; write [[hosts]] "),
            "{line}"
        );
    }

    #[test]
    fn unknown_scenarios_and_hosts_are_refused() {
        let answers = refusals(&[
            ("waste-cleanup", "waste-clean"),
            ("world = \"h1\"", "world = \"h3\""),
        ]);
        insta::assert_snapshot!(answers);
    }

    #[test]
    fn invalid_or_repeated_host_names_are_refused() {
        let answers = refusals(&[
            ("name = \"h2\"", "name = \"h 2\""),
            ("name = \"h2\"", "name = \"\""),
            ("name = \"h2\"", "name = \"launcher\""),
            ("name = \"h2\"", "name = \"h1\""),
            ("10.0.0.2", "10.0.0.2:7447"),
        ]);
        insta::assert_snapshot!(answers);
    }

    #[test]
    fn unknown_unplaced_or_repeated_robots_are_refused() {
        let answers = refusals(&[
            ("\"gold\"", "\"glod\""),
            ("\"gold\"", "\"blue\""),
            ("\"gold\", \"green\"", ""),
            ("\"gold\"", "\"green\""),
        ]);
        insta::assert_snapshot!(answers);
    }

    #[test]
    fn invalid_or_unencrypted_addresses_are_refused() {
        let answers = refusals(&[
            ("tls/10.0.0.1:7447", "10.0.0.1"),
            ("tls/10", "tcp/10"),
            ("keys =", "unencrypted = true\nkeys ="),
        ]);
        insta::assert_snapshot!(answers);
        let plain = GOOD.replace("tls/10", "tcp/10");
        let wanted = plain.replace("keys =", "unencrypted = true\nkeys =");
        assert_eq!(parse(&wanted).unwrap().listen.transport, Transport::Tcp);
        assert!(parse(&GOOD.replace("tls/10.0.0.1", "tcp/127.0.0.1")).is_ok());
    }

    #[test]
    fn external_controllers_are_on_the_host_of_the_world() {
        let with_controller = |robot: usize| {
            let scenario = |name: &str| {
                let mut scenario = read_scenario(name)?;
                scenario.robots[robot].controller = Some("own".to_owned());
                Ok(scenario)
            };
            Cluster::parse("c.toml", GOOD, Path::new("lab"), scenario)
        };
        assert!(with_controller(0).is_ok());
        assert_eq!(
            with_controller(1).unwrap_err().to_string(),
            "c.toml:11: hosts[1].robots[0]: the controller 'own' of 'gold' is an external program, which runs only on the world's host; place it on host 'h1'"
        );
    }
}

//! Recipes for a team on several machines: each file is valid for its tool, and its commands run on loopback.

use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::Command;

use alliance_tests::harness::Lab;
use alliance_tests::needs::cannot_run;
use alliance_tests::python::{python, run};
use alliance_tests::testkit::in_repository;

fn recipe(name: &str) -> PathBuf {
    in_repository("docs/examples/machines").join(name)
}

/// Returns the commands of the containers in a file, after a check of the file's schema.
fn containers(lab: &Lab, kind: &str) -> Option<BTreeMap<String, Vec<String>>> {
    let python = python(&["kubernetes_validate", "check_jsonschema", "yaml"])?;
    let file = recipe(&format!("{kind}.yaml"));
    let file = file.to_str().unwrap();
    let output = run(lab, &python, "recipes.py", &[kind, file]);
    Some(serde_json::from_str(&output).unwrap())
}

/// A test setup for a recipe's team on this machine.
struct Place {
    lab: Lab,
    port: u16,
}

impl Place {
    /// Creates the setup with keys as the recipe makes and copies them.
    fn new() -> Self {
        let lab = Lab::new();
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = free.local_addr().unwrap().port();
        let place = Self { lab, port };
        for folder in ["team", "here", "there"] {
            fs::create_dir(place.lab.path(folder)).unwrap();
        }
        let file = fs::read_to_string(recipe("containers.toml")).unwrap();
        place.lab.write("team/containers.toml", place.here(&file));
        place.lab.run("cluster keys team/containers.toml").expect(0);
        place
    }

    /// Returns the text with local addresses and paths.
    fn here(&self, text: &str) -> String {
        let at = format!("127.0.0.1:{}", self.port);
        text.replace("alliance-world:7447", &at)
            .replace("0.0.0.0:7447", &at)
            .replace("alliance-world", "127.0.0.1")
            .replace("/team/", "team/")
            .replace("--keys=/keys", "--keys=team/keys")
    }

    /// Runs both commands to their ends, each with its own runtime folder.
    fn run(&self, world: &[String], host: &[String]) {
        let start = |command: &[String], runtime: &str, more: &str| {
            let command = command.iter().map(|argument| self.here(argument));
            let command: Vec<String> = command.chain([more.to_owned()]).collect();
            let runtime = self.lab.path(runtime).display().to_string();
            let variables = [("XDG_RUNTIME_DIR", runtime.as_str())];
            self.lab.start_with(command, &variables)
        };
        let host = start(host, "there", "--out=printed");
        start(world, "here", "--out=run").wait().expect(0);
        host.wait().expect(0);
    }
}

#[track_caller]
fn assert_recipe_runs(world: &str, host: &str, kind: &str) {
    let place = Place::new();
    let Some(containers) = containers(&place.lab, kind) else {
        return;
    };
    place.run(&containers[world], &containers[host]);
    // The bytes must be those of a run on one machine.
    place
        .lab
        .mission("alone", "waste-cleanup --seed=1")
        .expect(0);
    place.lab.assert_same_bytes("run", "alone");
}

#[test]
fn the_compose_file_is_valid_and_its_team_runs() {
    assert_recipe_runs("alliance-world", "h2", "compose");
}

#[test]
fn the_kubernetes_manifests_are_valid_and_their_team_runs() {
    assert_recipe_runs("world", "host", "kubernetes");
}

/// Returns the errors of `systemd-analyze` for a unit that starts the program under test.
fn verify(lab: &Lab, name: &str, text: &str) -> String {
    let program = env!("CARGO_BIN_EXE_alliance-under-test");
    let file = lab.path(name);
    fs::write(&file, text.replace("/usr/local/bin/alliance", program)).unwrap();
    let mut command = Command::new("systemd-analyze");
    let output = command.arg("verify").arg(&file).output().unwrap();
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Returns the exposure of a unit according to `systemd-analyze`, from 0 to 10.
fn exposure(name: &str) -> f64 {
    let mut command = Command::new("systemd-analyze");
    let command = command.args(["security", "--offline=yes", "--no-pager"]);
    let output = command.arg(recipe(name)).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let (_, rest) = text.split_once("Overall exposure level").unwrap();
    let mut words = rest.split_whitespace().skip_while(|word| *word != "for");
    words.nth(2).unwrap().parse().unwrap()
}

#[test]
fn the_systemd_units_are_valid_and_start_existing_commands() {
    let version = Command::new("systemd-analyze").arg("--version").output();
    if version.is_err() {
        cannot_run("no systemd-analyze: install Debian's package `systemd`");
        return;
    }
    let lab = Lab::new();
    for (name, broken) in [
        ("alliance-host.service", "RestartSec=soon"),
        ("alliance-team@.service", "KilMode=mixed"),
    ] {
        let text = fs::read_to_string(recipe(name)).unwrap();
        assert!(exposure(name) < 2.0, "{name}: {}", exposure(name));
        // Systemd may not run on this machine. An error in a unit contains the unit's name.
        let output = verify(&lab, name, &text);
        assert!(!output.contains("alliance-"), "{output}");
        let wrong = format!("{text}\n[Service]\n{broken}\n");
        let output = verify(&lab, name, &wrong);
        assert!(output.contains("alliance-"), "{broken}: {output}");
        let mut lines = text.lines();
        let start = "ExecStart=/usr/local/bin/alliance ";
        let command = lines.find_map(|line| line.strip_prefix(start)).unwrap();
        // Lines for people have no time and no level.
        assert!(command.ends_with(" --log-format json"), "{command}");
        let command = command.replace("${HOST}", "h2");
        let command = command.replace("${WORLD}", "tls/10.0.0.1:7447");
        // The command stops only at the missing files.
        lab.run(command).expect(2).shows("/etc/alliance/");
    }
}

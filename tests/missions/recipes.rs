//! Recipes for a team on several machines: each keeps the schema of what reads it, and what it starts is started, on loopback.

use std::collections::BTreeMap;
use std::fs;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;

use alliance_tests::needs::cannot_run;

use crate::harness::Lab;
use crate::python::{python, run};

fn recipe(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    root.join("docs/examples/machines").join(name)
}

/// The commands of the containers of a file that keeps its schema.
fn containers(lab: &Lab, kind: &str) -> Option<BTreeMap<String, Vec<String>>> {
    let python = python(&["kubernetes_validate", "check_jsonschema", "yaml"])?;
    let file = recipe(&format!("{kind}.yaml"));
    let file = file.to_str().unwrap();
    let said = run(lab, &python, "recipes.py", &[kind, file]);
    Some(serde_json::from_str(&said).unwrap())
}

/// Where the recipe's team finds itself on this machine.
struct Place {
    lab: Lab,
    port: u16,
}

impl Place {
    /// With the keys that the recipe makes, as it copies them.
    fn new() -> Self {
        let lab = Lab::new();
        let free = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = free.local_addr().unwrap().port();
        let place = Self { lab, port };
        for folder in ["team", "here", "there"] {
            fs::create_dir(place.lab.path(folder)).unwrap();
        }
        let file = place.here(&fs::read_to_string(recipe("containers.toml")).unwrap());
        fs::write(place.lab.path("team/containers.toml"), file).unwrap();
        place.lab.run(&["keys", "team/containers.toml"]).expect(0);
        place
    }

    /// The same text with places of this machine.
    fn here(&self, text: &str) -> String {
        let at = format!("127.0.0.1:{}", self.port);
        text.replace("alliance-world:7447", &at)
            .replace("0.0.0.0:7447", &at)
            .replace("alliance-world", "127.0.0.1")
            .replace("/team/", "team/")
            .replace("--keys=/keys", "--keys=team/keys")
    }

    /// Runs both commands, each with a runtime folder of its own as machines have, to their ends; gives what the world says.
    fn run(&self, world: &[String], host: &[String]) -> String {
        let start = |command: &[String], runtime: &str, more: &str| {
            let command: Vec<String> = command.iter().map(|word| self.here(word)).collect();
            let mut words: Vec<&str> = command.iter().map(String::as_str).collect();
            words.push(more);
            let runtime = self.lab.path(runtime).display().to_string();
            self.lab
                .start_with(&words, &[("XDG_RUNTIME_DIR", &runtime)])
        };
        let host = start(host, "there", "--out=printed");
        let world = start(world, "here", "--out=run").wait().expect(0);
        host.wait().expect(0);
        world.stderr
    }
}

#[track_caller]
fn assert_it_runs(world: &str, host: &str, kind: &str) {
    let place = Place::new();
    let Some(containers) = containers(&place.lab, kind) else {
        return;
    };
    place.run(&containers[world], &containers[host]);
    // The same bytes as on one machine.
    let seed = "--seed=1";
    place
        .lab
        .mission("alone", &["waste-cleanup", seed])
        .expect(0);
    place.lab.assert_same_bytes("run", "alone");
}

#[test]
fn the_compose_file_keeps_its_schema_and_its_team_runs() {
    assert_it_runs("alliance-world", "h2", "compose");
}

#[test]
fn the_manifests_for_kubernetes_keep_their_schemas_and_their_team_runs() {
    assert_it_runs("world", "host", "kubernetes");
}

/// What `systemd-analyze` finds wrong with a unit whose program is that under test.
fn verify(lab: &Lab, name: &str, text: &str) -> String {
    let program = env!("CARGO_BIN_EXE_alliance-under-test");
    let file = lab.path(name);
    fs::write(&file, text.replace("/usr/local/bin/alliance", program)).unwrap();
    let mut command = Command::new("systemd-analyze");
    let output = command.arg("verify").arg(&file).output().unwrap();
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn the_units_for_systemd_hold_and_start_commands_that_are_there() {
    if Command::new("systemd-analyze")
        .arg("--version")
        .output()
        .is_err()
    {
        cannot_run("no systemd-analyze: install Debian's package `systemd`");
        return;
    }
    let lab = Lab::new();
    for (name, broken) in [
        ("alliance-host.service", "RestartSec=soon"),
        ("alliance-team@.service", "KilMode=mixed"),
    ] {
        let text = fs::read_to_string(recipe(name)).unwrap();
        // This machine may have no systemd running; a line of a unit is told with the unit's name.
        let said = verify(&lab, name, &text);
        assert!(!said.contains("alliance-"), "{said}");
        let wrong = format!("{text}\n[Service]\n{broken}\n");
        let said = verify(&lab, name, &wrong);
        assert!(said.contains("alliance-"), "{broken} is not found: {said}");
        let command = text
            .lines()
            .find_map(|it| it.strip_prefix("ExecStart=/usr/local/bin/alliance "));
        let command = command.unwrap().replace("${HOST}", "h2");
        let command = command.replace("${WORLD}", "tls/10.0.0.1:7447");
        let words: Vec<&str> = command.split(' ').collect();
        // It gets as far as the files that are not there.
        let said = lab.run(&words).expect(2).stderr;
        assert!(said.contains("/etc/alliance/"), "{said}");
    }
}

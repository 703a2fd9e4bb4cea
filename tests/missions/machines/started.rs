//! Hosts that `cluster up` starts itself, with keys that are in no file.

use std::fs;
use std::path::Path;

use alliance_tests::harness::{alliance, command_line, join, wait_until};
use nix::sys::signal::Signal;

use super::{Machines, Run};

const PLACES: [(&str, &[&str]); 3] = [("h1", &["blue"]), ("h2", &["gold"]), ("h3", &["green"])];

/// Creates three hosts without a folder of keys.
#[track_caller]
fn enter() -> Option<Machines> {
    let machines = Machines::enter(3, &PLACES)?;
    fs::remove_dir_all(machines.lab.path("keys")).unwrap();
    Some(machines)
}

/// Returns the command that starts `alliance` on a host. As with `ssh`, an intermediate process does not pass on
/// signals.
fn start() -> String {
    let alliance = alliance().display().to_string();
    format!(
        "sh -c 'env XDG_RUNTIME_DIR=/run/{{name}} ip netns exec {{name}} {alliance} \"$@\"; exit $?' sh"
    )
}

/// Returns the process id of an agent from the log of its host.
#[track_caller]
fn agent(run: &mut Run<'_>, host: &str, robot: &str) -> u32 {
    let path = run.machines.lab.path(&format!("run/logs/host.{host}.log"));
    let prefix = format!("{robot} is process ");
    let mut found = None;
    wait_until(&prefix, || {
        let log = fs::read_to_string(&path).unwrap_or_default();
        let mut lines = log.lines().filter_map(|line| line.strip_prefix(&prefix));
        found = lines.next().and_then(|pid| pid.parse().ok());
        let is_running = run.launcher.is_running();
        assert!(is_running, "ended:\n{}", run.launcher.stderr());
        found.is_some()
    });
    found.unwrap()
}

/// Returns whether a file in the folder contains a private key.
fn contains_a_key(folder: &Path) -> bool {
    fs::read_dir(folder).unwrap().any(|entry| {
        let entry = entry.unwrap();
        match entry.file_type().unwrap() {
            kind if kind.is_dir() => contains_a_key(&entry.path()),
            kind if kind.is_file() => fs::read(entry.path()).is_ok_and(|bytes| {
                let text = String::from_utf8_lossy(&bytes);
                text.contains("PRIVATE KEY")
            }),
            _ => false,
        }
    })
}

#[test]
fn hosts_are_started_with_keys_that_are_in_no_file() {
    let Some(machines) = enter() else { return };
    let options = "--limit 60 --stall-after 30 --speed max --paused";
    let mut run = machines.up(join(["--start", &start()], options));
    let agents =
        [("h2", "gold"), ("h3", "green")].map(|(host, robot)| agent(&mut run, host, robot));
    run.launcher.wait_for_stderr("the clock is held");
    let lab = machines.lab.path(".");
    let hosts = ["/run/h1", "/run/h2", "/run/h3"].map(Path::new);
    for folder in hosts.into_iter().chain([lab.as_path()]) {
        assert!(!contains_a_key(folder), "{}", folder.display());
    }
    let resume = machines.start("h1", "clock resume");
    resume.wait().expect(0);
    run.end();
    for agent in agents {
        assert_eq!(command_line(agent), None);
    }
    machines.assert_same_as_one_machine("60");
}

#[test]
fn a_host_that_cannot_be_started_is_reported_before_the_run_begins() {
    let Some(machines) = enter() else { return };
    let run = machines.up(["--start", "sh -c 'echo no way to {name} >&2; exit 7' sh"]);
    run.launcher.wait().expect(3).shows(
        "alliance cluster up: the run could not begin: host h2 ended with exit status 7:\n    no way to h2",
    );
}

/// A started host ends when its standard input is closed. Here this is the only signal, because the host has never
/// reached the world.
#[test]
fn started_hosts_end_with_their_launcher() {
    let Some(machines) = enter() else { return };
    machines.hosts.unplug("h2");
    let run = machines.up(["--start", &start()]);
    let log = machines.lab.path("run/logs/host.h2.log");
    wait_until("a host that searches for the world", || {
        let text = fs::read_to_string(&log).unwrap_or_default();
        text.contains("trying again")
    });
    run.launcher.signal(Signal::SIGKILL);
    let _ = run.launcher.wait();
    wait_until("the end of the hosts", || {
        let processes = fs::read_dir("/proc").unwrap().flatten();
        let ids = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        !ids.filter_map(command_line)
            .any(|line| line.contains("host --name"))
    });
}

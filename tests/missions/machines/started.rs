//! Hosts that `cluster up` starts itself, with keys that are in no file.

use std::fs;
use std::path::Path;

use nix::sys::signal::Signal;

use super::{Machines, Run};
use crate::harness::{ALLIANCE, command_line, wait_until};

const PLACES: [(&str, &[&str]); 3] = [("h1", &["blue"]), ("h2", &["gold"]), ("h3", &["green"])];

/// Three hosts, and no folder of keys.
#[track_caller]
fn enter() -> Option<Machines> {
    let machines = Machines::enter(3, &PLACES)?;
    fs::remove_dir_all(machines.lab.path("keys")).unwrap();
    Some(machines)
}

/// What is `alliance` on the host of that name. As with `ssh`, a process stays in between that passes on no signal.
fn start() -> String {
    format!(
        "sh -c 'env XDG_RUNTIME_DIR=/run/{{name}} ip netns exec {{name}} {ALLIANCE} \"$@\"; exit $?' sh"
    )
}

/// The agent's process, as the log of its host has it.
#[track_caller]
fn agent(run: &mut Run<'_>, host: &str, robot: &str) -> u32 {
    let path = run.machines.lab.path(&format!("run/logs/host-{host}.log"));
    let said = format!("{robot} is process ");
    let mut found = None;
    wait_until(&said, || {
        let log = fs::read_to_string(&path).unwrap_or_default();
        let mut lines = log.lines().filter_map(|line| line.strip_prefix(&said));
        found = lines.next().and_then(|pid| pid.parse().ok());
        assert!(
            run.launcher.is_running(),
            "ended:\n{}",
            run.launcher.stderr()
        );
        found.is_some()
    });
    found.unwrap()
}

/// Whether a private key is in some file of that folder.
fn holds_a_key(folder: &Path) -> bool {
    fs::read_dir(folder).unwrap().any(|entry| {
        let entry = entry.unwrap();
        match entry.file_type().unwrap() {
            kind if kind.is_dir() => holds_a_key(&entry.path()),
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
    let mut run = machines.up(&[
        "--start",
        &start(),
        "--limit",
        "60",
        "--stall-after",
        "30",
        "--speed",
        "max",
        "--paused",
    ]);
    let agents =
        [("h2", "gold"), ("h3", "green")].map(|(host, robot)| agent(&mut run, host, robot));
    run.launcher.wait_for_stderr("the clock is held");
    let everywhere = ["/run/h1", "/run/h2", "/run/h3"].map(Path::new);
    for folder in everywhere
        .into_iter()
        .chain([machines.lab.path(".").as_path()])
    {
        assert!(!holds_a_key(folder), "{}", folder.display());
    }
    let resume = machines.start("h1", &["clock", "resume"]);
    resume.wait().expect(0);
    run.end();
    for agent in agents {
        assert_eq!(command_line(agent), None);
    }
    machines.assert_as_alone("60");
}

#[test]
fn a_host_that_cannot_be_started_is_told_of_before_the_run_begins() {
    let Some(machines) = enter() else { return };
    let run = machines.up(&["--start", "sh -c 'echo no way to {name} >&2; exit 7' sh"]);
    let said = run.launcher.wait().expect(3).stderr;
    assert!(
        said.contains(
            "the run could not begin: host h2 ended with exit status 7:\n    no way to h2"
        ),
        "{said}"
    );
}

/// A host that is reached by another program learns by the end of its standard input that nobody holds it; this one by nothing else, for
/// it has never found the world.
#[test]
fn hosts_end_with_who_started_them() {
    let Some(machines) = enter() else { return };
    machines.hosts.unplug("h2");
    let run = machines.up(&["--start", &start()]);
    let log = machines.lab.path("run/logs/host-h2.log");
    wait_until("a host that looks for the world", || {
        let said = fs::read_to_string(&log).unwrap_or_default();
        said.contains("trying again")
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

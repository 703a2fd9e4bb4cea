//! A world that is gone: its hosts let the run go. A killed world closes its connections; a vanished machine does not.

use alliance_tests::harness::{Process, command_line};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use super::{Machines, Run};

const AWAY: [&str; 2] = ["gold", "green"];

fn start<'m>(machines: &'m Machines) -> (Run<'m>, Process) {
    let daemon = machines.daemon("h2", "h2", &AWAY);
    let mut run = machines.up(&["--limit", "200", "--speed", "10x"]);
    run.wait_for("activated", &AWAY, 1);
    (run, daemon)
}

fn places() -> [(&'static str, &'static [&'static str]); 2] {
    [("h1", &["blue"]), ("h2", &AWAY)]
}

/// Checks that the daemon has ended its agents and itself, and what it has printed about it.
#[track_caller]
fn assert_let_go(daemon: Process, reason: &str) {
    let agents = daemon.children();
    assert_eq!(agents.len(), AWAY.len());
    let ended = daemon.wait().expect(0);
    let lines: Vec<&str> = ended.stderr.lines().collect();
    assert!(
        lines.iter().any(|line| line.ends_with(reason)),
        "{}",
        ended.stderr
    );
    assert!(
        lines
            .last()
            .is_some_and(|line| line.ends_with(": the world is gone")),
        "{}",
        ended.stderr
    );
    assert!(agents.iter().all(|agent| command_line(*agent).is_none()));
}

#[test]
fn a_killed_world_frees_its_hosts_before_their_agents_give_up() {
    let Some(machines) = Machines::enter(2, &places()) else {
        return;
    };
    let (run, daemon) = start(&machines);
    let world = run
        .launcher
        .children()
        .into_iter()
        .find(|child| command_line(*child).is_some_and(|line| line.contains(" world ")));
    kill(Pid::from_raw(world.unwrap() as i32), Signal::SIGKILL).unwrap();
    // An agent that gives up ends with exit status 3 after half a minute.
    assert_let_go(daemon, ": the world is gone");
    let _ = run.launcher.wait();
}

#[test]
fn a_world_whose_machine_vanishes_is_let_go() {
    let Some(machines) = Machines::enter(2, &places()) else {
        return;
    };
    let (run, daemon) = start(&machines);
    machines.hosts.unplug("h1");
    for child in run.launcher.children() {
        let _ = kill(Pid::from_raw(child as i32), Signal::SIGKILL);
    }
    run.launcher.signal(Signal::SIGKILL);
    assert_let_go(
        daemon,
        "10.0.0.1:7447 has not answered for 30 s; the connection is closed",
    );
    let _ = run.launcher.wait();
}

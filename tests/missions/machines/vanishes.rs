//! A world that is gone: its hosts let the run go. A killed world closes its connections; a vanished machine does not.

use alliance_tests::harness::{Process, command_line};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use super::{AWAY, Machines, TWO_HOSTS};

/// Checks that the daemon has ended its agents and itself, and what it has printed about it.
#[track_caller]
fn assert_let_go(daemon: Process, reason: &str) {
    let agents = daemon.children();
    assert_eq!(agents.len(), AWAY.len());
    let ended = daemon.wait().expect(0);
    let stderr = ended.stderr.trim_end();
    let has_reason = stderr.lines().any(|line| line.ends_with(reason));
    let is_let_go = has_reason && stderr.ends_with(": the world is gone");
    assert!(is_let_go, "{stderr}");
    assert!(agents.iter().all(|agent| command_line(*agent).is_none()));
}

#[test]
fn a_killed_world_frees_its_hosts_before_their_agents_give_up() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let (run, daemon) = machines.at_work("--speed 4x");
    let mut children = run.launcher.children().into_iter();
    let is_world = |pid: &u32| command_line(*pid).is_some_and(|line| line.contains(" world "));
    let world = children.find(is_world);
    kill(Pid::from_raw(world.unwrap() as i32), Signal::SIGKILL).unwrap();
    // An agent that gives up ends with exit status 3 after half a minute.
    assert_let_go(daemon, ": the world is gone");
    let _ = run.launcher.wait();
}

#[test]
fn a_world_whose_machine_vanishes_is_let_go() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let (run, daemon) = machines.at_work("--speed 4x");
    machines.hosts.unplug("h1");
    for child in run.launcher.children() {
        let _ = kill(Pid::from_raw(child as i32), Signal::SIGKILL);
    }
    run.launcher.signal(Signal::SIGKILL);
    let reason = "10.0.0.1:7447 has not answered for 30 s; the connection is closed";
    assert_let_go(daemon, reason);
    let _ = run.launcher.wait();
}

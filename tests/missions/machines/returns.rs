//! Hosts that die and come back: their robots' lives end, new ones begin, and all of it is repeated from the log.

use nix::sys::signal::Signal;

use super::{Machines, Run, STALL_AFTER, sleep};
use crate::harness::{Process, command_line, wait_until};

const AWAY: [&str; 2] = ["gold", "green"];

fn start<'m>(machines: &'m Machines) -> (Run<'m>, Process) {
    let daemon = machines.daemon("h2", "h2", &AWAY);
    let mut run = machines.up(&[
        "--limit",
        "200",
        "--speed",
        "10x",
        "--stall-after",
        STALL_AFTER,
    ]);
    run.wait_for("activated", &AWAY, 1);
    (run, daemon)
}

/// Kills a daemon, and waits for the end of its agents, whom nobody else tells.
fn kill(daemon: Process) {
    let agents = daemon.children();
    assert_eq!(agents.len(), AWAY.len());
    daemon.signal(Signal::SIGKILL);
    let _ = daemon.wait();
    for agent in agents {
        wait_until("the end of an agent", || command_line(agent).is_none());
    }
}

#[test]
fn a_host_that_is_killed_and_started_again_has_new_lives() {
    let places: [(&str, &[&str]); 2] = [("h1", &["blue"]), ("h2", &AWAY)];
    let Some(machines) = Machines::enter(2, &places) else {
        return;
    };
    let (mut run, daemon) = start(&machines);
    kill(daemon);
    run.wait_for("gone", &AWAY, 1);
    run.go_on(5);
    let daemon = machines.daemon("h2", "h2", &AWAY);
    run.wait_for_second_lives(&AWAY);
    run.end_soon();
    daemon.wait().expect(0);
    machines.assert_fates(&["life 1", "end of 1", "life 2"]);
}

/// No socket is ever closed of which the world could learn it.
#[test]
fn a_host_that_vanishes_for_good_and_comes_back_elsewhere_supersedes_the_silent_lives() {
    let places: [(&str, &[&str]); 2] = [("h1", &["blue"]), ("h2", &AWAY)];
    let Some(machines) = Machines::enter(3, &places) else {
        return;
    };
    let (mut run, daemon) = start(&machines);
    machines.hosts.unplug("h2");
    kill(daemon);
    run.wait_for("stalled", &AWAY, 1);
    sleep(2);
    run.go_on(5);
    let daemon = machines.daemon("h3", "h2", &AWAY);
    run.wait_for_second_lives(&AWAY);
    run.end_soon();
    daemon.wait().expect(0);
    machines.assert_fates(&["life 1", "silent", "end of 1", "life 2"]);
}

//! Hosts that crash and return: the incarnations of their robots end, new ones begin, and the log repeats the run.

use alliance_tests::harness::{Process, command_line, wait_until};
use nix::sys::signal::Signal;

use super::{AWAY, Machines, Run, STALL_AFTER, TWO_HOSTS, sleep};

fn start(machines: &Machines) -> (Run<'_>, Process) {
    machines.at_work(&format!("--speed 4x --stall-after {STALL_AFTER}"))
}

/// Kills a daemon and waits for the end of its agents, which detect it by themselves.
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
fn a_killed_and_restarted_host_has_new_incarnations() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let (mut run, daemon) = start(&machines);
    kill(daemon);
    run.wait_for("gone", &AWAY);
    run.run_for(5);
    let daemon = machines.daemon("h2", "h2", &AWAY);
    run.wait_for_second_incarnations();
    run.end_soon();
    daemon.wait().expect(0);
    machines.assert_inputs(&["joined 1", "gone 1", "joined 2"]);
}

/// The world receives no closed connection from the lost host.
#[test]
fn a_lost_host_that_returns_elsewhere_supersedes_the_stalled_incarnations() {
    let Some(machines) = Machines::enter(3, &TWO_HOSTS) else {
        return;
    };
    let (mut run, daemon) = start(&machines);
    machines.hosts.unplug("h2");
    kill(daemon);
    run.wait_for("stalled", &AWAY);
    sleep(2);
    run.run_for(5);
    let daemon = machines.daemon("h3", "h2", &AWAY);
    run.wait_for_second_incarnations();
    run.end_soon();
    daemon.wait().expect(0);
    machines.assert_inputs(&["joined 1", "stalled", "gone 1", "joined 2"]);
}

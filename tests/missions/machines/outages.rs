//! A network outage: the robots behind it are stalled and return with the same incarnation, and the log repeats the
//! run.

#![allow(clippy::disallowed_methods)] // An outage lasts real time.

use std::time::{Duration, Instant};

use alliance_tests::harness::Process;

use super::{Machines, Run, STALL_AFTER};

const AWAY: [&str; 2] = ["gold", "green"];

/// Starts a run with robots gold and green on `h2`, waits until they work, and sets the speed.
fn at_work<'m>(machines: &'m Machines, speed: &str) -> (Run<'m>, Process) {
    let daemon = machines.daemon("h2", "h2", &AWAY);
    let mut run = machines.up(&[
        "--limit",
        "200",
        "--speed",
        "20x",
        "--stall-after",
        STALL_AFTER,
    ]);
    run.wait_for("activated", &AWAY, 1);
    run.pace(speed);
    run.run_for(2);
    (run, daemon)
}

/// Disconnects the two robots for the `times`-th time, and reconnects them after `seconds` of real time.
fn cut_off(run: &mut Run<'_>, seconds: u64, cut: impl Fn(), reconnect: impl Fn(), times: usize) {
    let until = Instant::now() + Duration::from_secs(seconds);
    cut();
    run.wait_for("stalled", &AWAY, times);
    // Blue continues alone.
    run.run_for(5);
    std::thread::sleep(until.saturating_duration_since(Instant::now()));
    reconnect();
    run.wait_for("back", &AWAY, times);
    run.run_for(2);
}

/// Ends the run, and checks that the two robots were stalled `times` times and had no other input.
fn assert_only_stalls(machines: &Machines, run: Run<'_>, daemon: Process, times: usize) {
    run.pace("max");
    run.end();
    daemon.wait().expect(0);
    let mut expected = vec!["joined 1"];
    for _ in 0..times {
        expected.extend(["stalled", "back"]);
    }
    machines.assert_inputs(&expected);
    let run = machines.lab.log("run").run;
    assert!(run.unscripted, "the scenario does not contain the outage");
}

fn places() -> [(&'static str, &'static [&'static str]); 2] {
    [("h1", &["blue"]), ("h2", &AWAY)]
}

/// The outage is much longer than the time after which a robot counts as stalled.
#[test]
fn an_unplugged_cable_is_a_stall() {
    let Some(machines) = Machines::enter(2, &places()) else {
        return;
    };
    let hosts = &machines.hosts;
    let (mut run, daemon) = at_work(&machines, "5x");
    cut_off(&mut run, 12, || hosts.unplug("h2"), || hosts.plug("h2"), 1);
    assert_only_stalls(&machines, run, daemon, 1);
}

#[test]
fn a_partition_is_a_stall_in_each_direction_and_in_both() {
    let Some(machines) = Machines::enter(2, &places()) else {
        return;
    };
    let hosts = &machines.hosts;
    let (mut run, daemon) = at_work(&machines, "5x");
    let ways: [&[(&str, &str)]; 3] = [
        &[("h1", "h2")],
        &[("h2", "h1")],
        &[("h1", "h2"), ("h2", "h1")],
    ];
    for (number, ways) in ways.iter().enumerate() {
        let cut = || ways.iter().for_each(|(from, to)| hosts.cut(from, to));
        cut_off(&mut run, 1, cut, || hosts.heal(), number + 1);
    }
    assert_only_stalls(&machines, run, daemon, 3);
}

//! A network outage: the robots behind it are stalled and return with the same incarnation, and the log repeats the
//! run.

#![allow(clippy::disallowed_methods)] // An outage lasts real time.

use std::time::{Duration, Instant};

use alliance_tests::harness::Process;

use super::{AWAY, Machines, Run, STALL_AFTER, TWO_HOSTS};

/// Starts a run, waits until gold and green work, and sets a lower speed.
fn at_work(machines: &Machines) -> (Run<'_>, Process) {
    let arguments = format!("--speed 20x --stall-after {STALL_AFTER}");
    let (mut run, daemon) = machines.at_work(&arguments);
    run.pace("5x");
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

/// The outage is much longer than the time after which a robot counts as stalled.
#[test]
fn an_unplugged_cable_is_a_stall() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let hosts = &machines.hosts;
    let (mut run, daemon) = at_work(&machines);
    cut_off(&mut run, 12, || hosts.unplug("h2"), || hosts.plug("h2"), 1);
    assert_only_stalls(&machines, run, daemon, 1);
}

#[test]
fn a_partition_is_a_stall_in_each_direction_and_in_both() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let hosts = &machines.hosts;
    let (mut run, daemon) = at_work(&machines);
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

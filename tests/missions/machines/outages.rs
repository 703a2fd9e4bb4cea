//! A network outage: the robots behind it are stalled and return with the same incarnation, and the log repeats the
//! run.

#![allow(clippy::disallowed_methods)] // An outage lasts real time.

use std::time::{Duration, Instant};

use alliance_tests::harness::Process;

use super::{AWAY, Machines, Run, STALL_AFTER, TWO_HOSTS, inputs_of};

/// Starts a run, waits until gold and green work, and sets a lower speed.
fn at_work(machines: &Machines) -> (Run<'_>, Process) {
    let arguments = format!("--speed 4x --stall-after {STALL_AFTER}");
    let (mut run, daemon) = machines.at_work(&arguments);
    run.pace("2x");
    run.run_for(2);
    (run, daemon)
}

/// Disconnects the two robots, and reconnects them after `seconds` of real time.
fn cut_off(run: &mut Run<'_>, seconds: u64, cut: impl Fn(), reconnect: impl Fn()) {
    let until = Instant::now() + Duration::from_secs(seconds);
    cut();
    wait_until_last(run, "stalled");
    // Blue continues alone.
    run.run_for(5);
    std::thread::sleep(until.saturating_duration_since(Instant::now()));
    reconnect();
    wait_until_last(run, "back");
    run.run_for(2);
}

/// Waits until the last stall of the two robots has begun or, with `back`, has ended.
fn wait_until_last(run: &mut Run<'_>, kind: &str) {
    run.wait_for_events(&format!("last stall of {AWAY:?}: {kind}"), |events| {
        AWAY.iter().all(|robot| {
            let last = |kind: &str| events.rfind(&format!(",{kind},{robot},"));
            let other = if kind == "back" { "stalled" } else { "back" };
            last(kind).is_some() && last(kind) > last(other)
        })
    });
}

/// Ends the run, and checks that the robots had at least this number of stalls in the same incarnation, and nothing
/// else. A busy machine may add stalls.
fn assert_only_stalls(machines: &Machines, run: Run<'_>, daemon: Process, outages: usize) {
    run.pace("max");
    run.end();
    daemon.wait().expect(0);
    let log = machines.replayed_log();
    for (robot, at_least) in [("blue", 0), ("gold", outages), ("green", outages)] {
        let inputs = inputs_of(&log, robot);
        let (joined, stalls) = inputs.split_at(1);
        assert_eq!(joined, ["joined 1"], "{robot}");
        let pairs = stalls.chunks(2);
        assert!(pairs.len() >= at_least, "{robot}: {inputs:?}");
        for pair in pairs {
            assert_eq!(pair, ["stalled", "back"], "{robot}: {inputs:?}");
        }
    }
    assert!(
        log.run.unscripted,
        "the scenario does not contain the outage"
    );
}

/// The outage is much longer than the time after which a robot counts as stalled.
#[test]
fn an_unplugged_cable_is_a_stall() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let hosts = &machines.hosts;
    let (mut run, daemon) = at_work(&machines);
    cut_off(&mut run, 12, || hosts.unplug("h2"), || hosts.plug("h2"));
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
    for ways in &ways {
        let cut = || ways.iter().for_each(|(from, to)| hosts.cut(from, to));
        cut_off(&mut run, 1, cut, || hosts.heal());
    }
    assert_only_stalls(&machines, run, daemon, 3);
}

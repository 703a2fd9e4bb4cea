//! A network that is gone for a while: the robots behind it are silent, come back as they were, and all of it is repeated from the log.

#![allow(clippy::disallowed_methods)] // An outage is one of the real clock.

use std::time::{Duration, Instant};

use super::{Machines, Run, STALL_AFTER};
use crate::harness::Process;

const AWAY: [&str; 2] = ["gold", "green"];

/// A run whose robots gold and green are on `h2`, in the middle of its work, from now on at that pace.
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
    run.go_on(2);
    (run, daemon)
}

/// Cuts the two off for the `times`-th time, and mends it after so many seconds on the wall.
fn cut_off(run: &mut Run<'_>, seconds: u64, cut: impl Fn(), mend: impl Fn(), times: usize) {
    let until = Instant::now() + Duration::from_secs(seconds);
    cut();
    run.wait_for("stalled", &AWAY, times);
    // Blue goes on alone.
    run.go_on(5);
    std::thread::sleep(until.saturating_duration_since(Instant::now()));
    mend();
    run.wait_for("back", &AWAY, times);
    run.go_on(2);
}

/// The run's end, and that nothing else happened than that they were silent so many times.
fn ends(machines: &Machines, run: Run<'_>, daemon: Process, times: usize) {
    run.pace("max");
    run.end();
    daemon.wait().expect(0);
    let mut expected = vec!["life 1"];
    for _ in 0..times {
        expected.extend(["silent", "back"]);
    }
    machines.assert_fates(&expected);
    let run = machines.lab.log("run").run;
    assert!(run.unscripted, "nobody's scenario asked for it");
}

fn places() -> [(&'static str, &'static [&'static str]); 2] {
    [("h1", &["blue"]), ("h2", &AWAY)]
}

#[track_caller]
fn cable_out(seconds: u64, speed: &str) {
    let Some(machines) = Machines::enter(2, &places()) else {
        return;
    };
    let hosts = &machines.hosts;
    let (mut run, daemon) = at_work(&machines, speed);
    cut_off(
        &mut run,
        seconds,
        || hosts.unplug("h2"),
        || hosts.plug("h2"),
        1,
    );
    ends(&machines, run, daemon, 1);
}

#[test]
fn a_cable_out_for_six_seconds_is_a_silence() {
    cable_out(6, "5x");
}

#[test]
fn a_cable_out_for_twenty_seconds_is_a_silence() {
    cable_out(20, "2x");
}

#[test]
fn a_partition_is_a_silence_one_way_the_other_way_and_both() {
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
        cut_off(&mut run, 3, cut, || hosts.heal(), number + 1);
    }
    ends(&machines, run, daemon, 3);
}

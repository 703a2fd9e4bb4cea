//! Without permanent loss, a run on several hosts has the bytes of a run on one machine.

use std::time::Duration;

use alliance_tests::harness::expect_all;
use alliance_tests::runs::Events;
use nix::sys::signal::Signal;

use super::{AWAY, Machines, TWO_HOSTS, inputs_of};

#[test]
fn a_team_on_three_hosts_gives_the_bytes_of_one_machine() {
    let places: [(&str, &[&str]); 3] = [("h1", &[]), ("h2", &AWAY), ("h3", &["blue"])];
    let Some(machines) = Machines::enter(3, &places) else {
        return;
    };
    // One daemon starts before the world, the other after it.
    let early = machines.daemon("h2", "h2", &AWAY);
    let run = machines.up("--limit 60 --stall-after 30");
    let late = machines.daemon("h3", "h3", &["blue"]);
    run.end();
    expect_all([early, late], 0);
    machines.assert_same_as_one_machine("60");
    let log = machines.replayed_log();
    for robot in ["blue", "gold", "green"] {
        assert_eq!(inputs_of(&log, robot), ["joined 1"], "{robot}");
    }
    assert_eq!(machines.hosts.frames().stopped, 0);
    let passed = machines.hosts.frames().passed;
    assert!(passed > 1000, "all messages must use the network");
}

/// Signals and restarts go to the robot's host, which reports their result.
#[test]
fn process_faults_reach_robots_on_every_host() {
    let places: [(&str, &[&str]); 3] = [("h1", &["blue"]), ("h2", &["gold"]), ("h3", &["green"])];
    let Some(machines) = Machines::enter(3, &places) else {
        return;
    };
    machines.use_scenario(FAULTS);
    let daemons = [
        machines.daemon("h2", "h2", &["gold"]),
        machines.daemon("h3", "h3", &["green"]),
    ];
    let run = machines.up("--limit 60 --stall-after 30");
    run.end();
    expect_all(daemons, 0);
    let log = machines.replayed_log();
    let restarted = "joined 1, gone 1, joined 2";
    let paused = "joined 1, stalled, back, gone 1, joined 2";
    for (robot, inputs) in [("gold", restarted), ("green", paused), ("blue", restarted)] {
        assert_eq!(inputs_of(&log, robot).join(", "), inputs, "{robot}");
    }
    for (kind, robot, times_s) in [
        ("gone", "gold", &[20][..]),
        ("joined", "gold", &[0, 30]),
        ("stalled", "green", &[15]),
        ("back", "green", &[25]),
        ("gone", "green", &[40]),
        ("joined", "green", &[0, 40]),
        ("gone", "blue", &[35]),
        ("joined", "blue", &[0, 45]),
    ] {
        let times_ms: Vec<u64> = times_s.iter().map(|time_s| 1000 * time_s).collect();
        assert_eq!(log.times_of(robot, kind), times_ms, "{kind} {robot}");
    }
    // The same faults on one machine give the same bytes.
    let alone = "scenario.toml --limit 60 --stall-after 30";
    machines.lab.mission("alone", alone).expect(1);
    machines.lab.assert_same_bytes("run", "alone");
}

const FAULTS: &str = r#"
    name = "faults-on-hosts"
    [faults]
    timeline = [
        { fault.pause = "green", at_s = 15.0, for_s = 10.0 },
        { fault.kill = "gold", at_s = 20.0, for_s = 10.0 },
        { fault.terminate = "blue", at_s = 35.0, for_s = 10.0 },
        { fault.restart = "green", at_s = 40.0 },
    ]
"#;

#[test]
fn a_slow_network_changes_no_byte() {
    over_a_bad_network("10", |machines| {
        machines.hosts.delay(Duration::from_millis(20))
    });
}

#[test]
fn a_network_that_loses_one_frame_in_twenty_changes_no_byte() {
    let lossy = over_a_bad_network("5", |machines| machines.hosts.lose(5.0));
    let frames = lossy.map(|machines| machines.hosts.frames());
    assert!(frames.is_none_or(|frames| frames.lost > 10), "{frames:?}");
}

#[test]
fn a_host_that_is_not_connected_is_named() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let mut run = machines.up("--limit 5");
    run.launcher.wait_for_stderr(
        "host h2 (gold, green) to connect; start the daemon of h2 there, with this world's address and the keys of host-h2",
    );
    let daemon = machines.daemon("h2", "h2", &AWAY);
    run.end();
    daemon.wait().expect(0);
}

#[test]
fn a_router_without_a_world_ends_at_a_signal() {
    let Some(machines) = Machines::enter(2, &TWO_HOSTS) else {
        return;
    };
    let keys = machines.keys_of(&["host-h2", "robot-gold", "robot-green"]);
    // Nothing has this address, so an attempt to connect takes seconds.
    let world = "tls/10.0.0.9:7447";
    let mut router = machines.start(
        "h2",
        format!("cluster router --name h2 --connect {world} --keys {keys}"),
    );
    router.wait_for_stderr("trying again");
    router.signal(Signal::SIGTERM);
    let ended = router.wait().expect(0);
    let last = ended.stderr.lines().last();
    assert_eq!(last, Some("host h2: ended by a signal"), "{}", ended.stderr);
}

#[track_caller]
fn over_a_bad_network(limit: &str, impair: impl Fn(&Machines)) -> Option<Machines> {
    let machines = Machines::enter(2, &TWO_HOSTS)?;
    impair(&machines);
    let daemon = machines.daemon("h2", "h2", &AWAY);
    let run = machines.up(format!("--limit {limit} --stall-after 60"));
    run.end();
    daemon.wait().expect(0);
    machines.assert_same_as_one_machine(limit);
    machines.replayed_log();
    Some(machines)
}

//! Where the network loses nothing for good, a run over hosts has the bytes of one on one machine.

use std::time::Duration;

use super::{Machines, fate};

#[test]
fn a_team_on_three_hosts_gives_the_bytes_of_one_on_one() {
    let places: [(&str, &[&str]); 3] = [("h1", &[]), ("h2", &["gold", "green"]), ("h3", &["blue"])];
    let Some(machines) = Machines::enter(3, &places) else {
        return;
    };
    // Daemons are there before the world, and after it.
    let early = machines.daemon("h2", "h2", &["gold", "green"]);
    let run = machines.up(&["--limit", "60", "--stall-after", "30"]);
    let late = machines.daemon("h3", "h3", &["blue"]);
    run.end();
    for daemon in [early, late] {
        daemon.wait().expect(0);
    }
    machines.assert_as_alone("60");
    let log = machines.repeated();
    for robot in ["blue", "gold", "green"] {
        assert_eq!(fate(&log, robot), ["life 1"], "{robot}");
    }
    assert_eq!(machines.hosts.frames().stopped, 0);
    assert!(
        machines.hosts.frames().passed > 1000,
        "all over the network"
    );
}

#[test]
fn a_slow_network_changes_no_byte() {
    over_a_bad_network("10", |machines| {
        machines.hosts.delay(Duration::from_millis(20))
    });
}

#[test]
fn a_network_that_loses_one_frame_in_twenty_changes_no_byte() {
    let lossy = over_a_bad_network("5", |machines| machines.hosts.lose(5.0));
    if let Some(machines) = lossy {
        assert!(
            machines.hosts.frames().lost > 10,
            "{:?}",
            machines.hosts.frames()
        );
    }
}

#[track_caller]
fn over_a_bad_network(limit: &str, spoil: impl Fn(&Machines)) -> Option<Machines> {
    let places: [(&str, &[&str]); 2] = [("h1", &["blue"]), ("h2", &["gold", "green"])];
    let machines = Machines::enter(2, &places)?;
    spoil(&machines);
    let daemon = machines.daemon("h2", "h2", &["gold", "green"]);
    let run = machines.up(&["--limit", limit, "--stall-after", "60"]);
    run.end();
    daemon.wait().expect(0);
    machines.assert_as_alone(limit);
    machines.repeated();
    Some(machines)
}

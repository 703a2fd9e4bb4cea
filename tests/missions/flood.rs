//! A bus so full that ticks and reports are dropped: world and agents do not wait for each other for ever.

use std::collections::BTreeMap;

use zenoh::Wait;
use zenoh::qos::{CongestionControl, Priority};

use crate::harness::{Lab, wait_until};
use crate::hostile::announced;
use crate::team::Team;

/// A member of the run, for nobody else has a session, puts junk where everybody gets it, with the priority of the run's own messages.
/// Robots fall silent; when the flood is over all of them are heard again, the mission completes, and a replay repeats it.
#[test]
fn after_a_flood_everybody_is_heard_again() {
    let lab = Lab::new();
    let arguments = ["--speed", "5x", "--stall-after", "0.5", "--limit", "2000"];
    let mut team = Team::start(&lab, &arguments);
    team.wait_for_row("events.csv", &[",activated,"]);
    let run = announced(&lab);
    let config = alliance_proto::session::client(&run.endpoint, &run.token);
    let config = zenoh::Config::from_json5(&config).unwrap();
    let session = zenoh::open(config).wait().unwrap();
    let junk = session
        .declare_publisher(format!("alliance/{}/team/junk/heartbeat", run.run))
        .priority(Priority::InteractiveHigh)
        .congestion_control(CongestionControl::Block)
        .wait()
        .unwrap();
    // Until it tells, and as much again.
    let stalled = || latest(&lab).values().any(|kind| kind == "stalled");
    let put = || junk.put(vec![7; 60_000]).wait().unwrap();
    let needed = std::iter::repeat_with(put).take_while(|()| !stalled());
    for () in std::iter::repeat_with(put).take(needed.count().max(1000)) {}
    session.close().wait().unwrap();
    wait_until("everybody to be back", || {
        latest(&lab).values().all(|kind| kind == "back")
    });
    lab.run(&["clock", "speed", "max"]).expect(0);
    team.wait().expect(0);
    lab.run(&["replay", "run"]).expect(0);
}

/// Of each robot that has fallen silent or come back: which it did last.
fn latest(lab: &Lab) -> BTreeMap<String, String> {
    let events = std::fs::read_to_string(lab.path("run/events.csv")).unwrap();
    let mut latest = BTreeMap::new();
    for row in events.lines() {
        let mut fields = row.split(',').skip(1);
        if let (Some(kind @ ("stalled" | "back")), Some(robot)) = (fields.next(), fields.next()) {
            latest.insert(robot.to_owned(), kind.to_owned());
        }
    }
    latest
}

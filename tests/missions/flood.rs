//! Floods by clients with a session: world and agents do not wait for each other forever, even if ticks and reports
//! are dropped.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::operator::{announced, connect, hash};
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use cluster::rendezvous::ConnectionRole;
use proto::keys::KeyExpressions;
use zenoh::Wait;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, SampleKind};

/// A team member floods a topic that all robots receive, with the priority of the run's own messages.
///
/// Robots become stalled. After the flood all return, the mission completes, and a replay is identical.
#[test]
fn after_a_flood_all_robots_return() {
    let lab = Lab::new();
    let arguments = ["--speed", "5x", "--stall-after", "0.5", "--limit", "2000"];
    let mut team = Team::start(&lab, &arguments);
    team.wait_for_row("events.csv", &[",activated,"]);
    let run = announced(&lab);
    let session = connect(&run, ConnectionRole::Team);
    let junk = session
        .declare_publisher(format!("alliance/{}/team/junk/heartbeat", run.run))
        .priority(Priority::InteractiveHigh)
        .congestion_control(CongestionControl::Block)
        .wait()
        .unwrap();
    // The flood lasts until a robot is stalled, and then as long again.
    let stalled = || latest(&lab).values().any(|kind| kind == "stalled");
    let put = || junk.put(vec![7; 60_000]).wait().unwrap();
    let needed = std::iter::repeat_with(put).take_while(|()| !stalled());
    for () in std::iter::repeat_with(put).take(needed.count().max(1000)) {}
    session.close().wait().unwrap();
    wait_until("all robots to be back", || {
        latest(&lab).values().all(|kind| kind == "back")
    });
    lab.run(&["clock", "speed", "max"]).expect(0);
    team.wait().expect(0);
    lab.run(&["replay", "run"]).expect(0);
}

/// An operator may order and watch, but a flood by an operator reaches no member, with any key, wildcard or priority.
///
/// An operator receives no query and is not taken for a robot. The run keeps its hash, and orders still work.
#[test]
fn messages_of_an_operator_reach_no_member() {
    let lab = Lab::new();
    lab.mission("quiet", &["--log", "off"]).expect(0);
    let mut world = lab.start(&[
        "cluster", "world", "--out", "out", "--speed", "30x", "--paused",
    ]);
    let run = announced(&lab);
    let agents = ROBOTS.map(|robot| lab.start(&["cluster", "agent", "--robot", robot]));
    world.wait_for_stderr("all robots are here; started");

    let (robot, operator) = (
        connect(&run, ConnectionRole::Team),
        connect(&run, ConnectionRole::Operator),
    );
    let received = Arc::new(AtomicUsize::new(0));
    let count = |received: &Arc<AtomicUsize>| {
        let received = Arc::clone(received);
        move || _ = received.fetch_add(1, Ordering::Relaxed)
    };
    let (junk, killed, token) = (count(&received), count(&received), count(&received));
    let everything = format!("alliance/{}/**", run.run);
    robot
        .declare_subscriber(&everything)
        .callback(move |sample| match sample.kind() {
            SampleKind::Put if sample.payload().to_bytes().starts_with(&[7; 100]) => junk(),
            SampleKind::Delete => killed(),
            SampleKind::Put => {}
        })
        .background()
        .wait()
        .unwrap();
    robot
        .liveliness()
        .declare_subscriber(format!("{everything}/junk"))
        .history(true)
        .callback(move |_| token())
        .background()
        .wait()
        .unwrap();
    let asked = count(&received);
    operator
        .declare_queryable(&everything)
        .allowed_origin(Locality::Remote)
        .callback(move |_| asked())
        .background()
        .wait()
        .unwrap();
    let held = operator.liveliness();
    let held = held.declare_token(format!("alliance/{}/alive/blue/junk", run.run));
    let held = held.wait().unwrap();

    lab.run(&["clock", "resume"]).expect(0);
    let (mut puts, keys) = (0, KeyExpressions::new(&run.run));
    let keys = [
        keys.tick("blue"),
        keys.report("blue"),
        keys.team("gold", "heartbeat"),
        keys.process("launcher"),
        keys.view(),
        keys.team_all(),
        everything,
        "**".to_owned(),
    ];
    while world.is_running() && received.load(Ordering::Relaxed) == 0 {
        for key in &keys {
            let put = operator.put(key, vec![7; 60_000]);
            let put = put.congestion_control(CongestionControl::Block);
            let _ = put.priority(Priority::InteractiveHigh).wait();
            let _ = operator.delete(key).wait();
            puts += 1;
        }
        let _ = operator.get(keys[3].as_str()).wait();
    }
    assert_eq!(received.load(Ordering::Relaxed), 0);
    assert!(puts > 100, "{puts}");
    drop(held);
    world.wait().expect(0);
    for agent in agents {
        agent.wait().expect(0);
    }
    assert_eq!(hash(&lab, "out"), hash(&lab, "quiet"));
}

/// Returns the last event, "stalled" or "back", of each robot that has one.
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

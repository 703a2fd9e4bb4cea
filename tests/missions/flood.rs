//! Floods by clients with a session: world and agents do not wait for each other forever, even if ticks and reports
//! are dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};

use alliance_tests::harness::{Lab, command_line, expect_all, wait_until};
use alliance_tests::operator::{announced, connect, gateway_of, hash};
use alliance_tests::team::Team;
use alliance_tests::testkit::ROBOTS;
use cluster::rendezvous::ConnectionRole;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use proto::keys::KeyExpressions;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::{Locality, SampleKind};
use zenoh::{Session, Wait};

/// The number of declarations of a hostile operator. The cost of a declaration grows with their number.
const DECLARED: usize = 1_500;

/// A team member floods a topic that all robots receive, with the priority of the run's own messages.
///
/// Robots become stalled. After the flood all return, the mission completes, and a replay is identical.
#[test]
fn after_a_flood_all_robots_return() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 5x --stall-after 0.5 --limit 2000");
    team.wait_for_row("events.csv", &[",activated,"]);
    let run = announced(&lab);
    let session = connect(&run, ConnectionRole::Team);
    let junk = session
        .declare_publisher(format!("alliance/{}/robot/*/tick", run.run))
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
    lab.run("clock speed max").expect(0);
    team.wait().expect(0);
    lab.assert_repeated("run");
}

/// Returns the last event, "stalled" or "back", of each robot that has one.
fn latest(lab: &Lab) -> BTreeMap<String, String> {
    let mut latest = BTreeMap::new();
    for row in lab.text("run/events.csv").lines() {
        let mut fields = row.split(',').skip(1);
        if let (Some(kind @ ("stalled" | "back")), Some(robot)) = (fields.next(), fields.next()) {
            latest.insert(robot.to_owned(), kind.to_owned());
        }
    }
    latest
}

type Received = Arc<Mutex<BTreeSet<String>>>;

/// Returns the kinds of a hostile operator's messages that a member receives.
fn hostile_messages(member: &Session, run: &str) -> Received {
    let received = Received::default();
    let note = |kind: &'static str| {
        let received = Arc::clone(&received);
        move || _ = received.lock().unwrap().insert(kind.to_owned())
    };
    let (junk, deleted, token) = (note("put"), note("delete"), note("token"));
    let everything = format!("alliance/{run}/**");
    member
        .declare_subscriber(&everything)
        .callback(move |sample| match sample.kind() {
            SampleKind::Put if sample.payload().to_bytes().starts_with(&[7; 100]) => junk(),
            SampleKind::Delete => deleted(),
            SampleKind::Put => {}
        })
        .background()
        .wait()
        .unwrap();
    member
        .liveliness()
        .declare_subscriber(format!("{everything}/junk"))
        .history(true)
        .callback(move |_| token())
        .background()
        .wait()
        .unwrap();
    received
}

/// Returns the keys of the messages of the team that an operator receives.
fn messages_of_the_team(operator: &Session, run: &str) -> Received {
    let received = Received::default();
    let (sink, prefix) = (Arc::clone(&received), format!("alliance/{run}/"));
    operator
        .declare_subscriber(format!("{prefix}**"))
        .callback(move |sample| {
            let key = sample.key_expr().as_str().strip_prefix(&prefix);
            // The message keeps the seal of the team, which is 8 bytes.
            if let Some(key) = key.filter(|_| sample.payload().len() > 8) {
                sink.lock().unwrap().insert(key.to_owned());
            }
        })
        .background()
        .wait()
        .unwrap();
    received
}

/// An operator may order and watch. It receives the messages of the team. A flood by an operator reaches no member,
/// with any key, wildcard or priority. An operator receives no query and is not taken for a robot.
///
/// An operator also fills the gateway's tables, and the gateway is killed. Another gateway takes its place with the
/// same announcement, and ends with its world. The run keeps its hash, and orders still work.
#[test]
fn an_operator_receives_messages_and_overloads_the_gateway_but_reaches_no_member() {
    let lab = Lab::new();
    lab.mission("quiet", "--log off").expect(0);
    // The low speed keeps the run alive until a busy machine has made all declarations.
    let mut world = lab.world("out", "--speed 1x --paused");
    let run = announced(&lab);
    let operator = connect(&run, ConnectionRole::Operator);
    let watched = messages_of_the_team(&operator, &run.run);
    let agents = ROBOTS.map(|robot| lab.agent(robot));
    world.wait_for_stderr("all robots are here; started");
    let member = connect(&run, ConnectionRole::Team);
    let received = hostile_messages(&member, &run.run);
    let asked = Arc::clone(&received);
    let everything = format!("alliance/{}/**", run.run);
    operator
        .declare_queryable(&everything)
        .allowed_origin(Locality::Remote)
        .callback(move |_| _ = asked.lock().unwrap().insert("query".to_owned()))
        .background()
        .wait()
        .unwrap();
    let held = operator.liveliness();
    let held = held.declare_token(format!("alliance/{}/alive/blue/junk", run.run));
    let held = held.wait().unwrap();

    lab.run("clock resume").expect(0);
    let mut expected = BTreeSet::from(["view", "event"].map(str::to_owned));
    for robot in ROBOTS {
        expected.insert(format!("robot/{robot}/tick"));
        expected.insert(format!("robot/{robot}/report"));
        expected.insert(format!("team/{robot}/heartbeat"));
    }
    wait_until("all messages of the team", || {
        expected.is_subset(&watched.lock().unwrap())
    });
    let keys = KeyExpressions::new(&run.run);
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
    for _ in 0..100 {
        for key in &keys {
            let put = operator.put(key, vec![7; 60_000]);
            let put = put.congestion_control(CongestionControl::Block);
            let _ = put.priority(Priority::InteractiveHigh).wait();
            let _ = operator.delete(key).wait();
        }
        let _ = operator.get(keys[3].as_str()).wait();
    }
    assert_eq!(*received.lock().unwrap(), BTreeSet::new());
    assert!(world.is_running(), "the run was over too soon");

    let (mut tokens, mut subscribers) = (Vec::new(), Vec::new());
    for number in 0..DECLARED {
        let key = format!("alliance/{}/alive/blue/{number}/junk", run.run);
        tokens.push(operator.liveliness().declare_token(key).wait());
        let key = format!("alliance/{}/view/{number}", run.run);
        subscribers.push(operator.declare_subscriber(key).callback(|_| ()).wait());
    }
    let first = gateway_of(&world);
    kill(Pid::from_raw(first as i32), Signal::SIGKILL).unwrap();
    world.wait_for_stderr("the gateway for operators has ended");
    drop((tokens, subscribers, held));
    operator.close().wait().unwrap();
    let mut second = first;
    wait_until("another gateway", || {
        second = gateway_of(&world);
        second != first && lab.run("status").status.success()
    });
    assert!(world.is_running(), "the run was over too soon");
    lab.run("clock speed max").expect(0);
    world.wait().expect(0);
    expect_all(agents, 0);
    assert_eq!(*received.lock().unwrap(), BTreeSet::new());
    wait_until("the end of the gateway", || command_line(second).is_none());
    assert_eq!(hash(&lab, "out"), hash(&lab, "quiet"));
}

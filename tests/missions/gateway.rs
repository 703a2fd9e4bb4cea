//! The gateway for operators: their load affects the gateway, not the run.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::operator::{announced, connect, gateway_of, hash};
use alliance_tests::testkit::ROBOTS;
use cluster::rendezvous::ConnectionRole;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use zenoh::Wait;

/// The number of declarations of a hostile operator. The cost of a declaration grows with their number.
const DECLARED: usize = 1_500;

/// An operator fills the gateway's tables, and the gateway is killed. Another gateway takes its place with the same
/// announcement, the run keeps its hash, and the gateway ends with its world.
#[test]
fn an_operator_can_overload_the_gateway_but_not_the_run() {
    let lab = Lab::new();
    lab.mission("quiet", &["--log", "off"]).expect(0);
    // The low speed keeps the run alive until a busy machine has made all declarations.
    let mut world = lab.start(&[
        "cluster", "world", "--out", "out", "--speed", "1x", "--paused",
    ]);
    let run = announced(&lab);
    let agents = ROBOTS.map(|robot| lab.start(&["cluster", "agent", "--robot", robot]));
    world.wait_for_stderr("all robots are here; started");
    lab.run(&["clock", "resume"]).expect(0);

    let operator = connect(&run, ConnectionRole::Operator);
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
    drop((tokens, subscribers));
    operator.close().wait().unwrap();
    let mut second = first;
    wait_until("another gateway", || {
        second = gateway_of(&world);
        second != first && lab.run(&["status"]).status.success()
    });
    assert!(world.is_running(), "the run was over too soon");
    lab.run(&["clock", "speed", "max"]).expect(0);

    world.wait().expect(0);
    for agent in agents {
        agent.wait().expect(0);
    }
    wait_until("the end of the gateway", || command_line(second).is_none());
    assert_eq!(hash(&lab, "out"), hash(&lab, "quiet"));
}

#[test]
fn an_operator_receives_the_messages_of_the_team() {
    let lab = Lab::new();
    let mut world = lab.start(&[
        "cluster", "world", "--out", "out", "--speed", "30x", "--paused",
    ]);
    let run = announced(&lab);
    let operator = connect(&run, ConnectionRole::Operator);
    let received = Arc::new(Mutex::new(BTreeSet::new()));
    let sink = Arc::clone(&received);
    let prefix = format!("alliance/{}/", run.run);
    let everything = format!("{prefix}**");
    operator
        .declare_subscriber(&everything)
        .callback(move |sample| {
            let key = sample
                .key_expr()
                .as_str()
                .strip_prefix(&prefix)
                .unwrap()
                .to_owned();
            let mut received = sink.lock().unwrap();
            // The message keeps the seal of the team.
            received.insert((key, sample.payload().len() > 8));
        })
        .background()
        .wait()
        .unwrap();
    let agents = ROBOTS.map(|robot| lab.start(&["cluster", "agent", "--robot", robot]));
    world.wait_for_stderr("all robots are here; started");
    lab.run(&["clock", "resume"]).expect(0);
    let mut expected = BTreeSet::from(["view", "event"].map(|key| (key.to_owned(), true)));
    for robot in ROBOTS {
        for key in [
            format!("robot/{robot}/tick"),
            format!("robot/{robot}/report"),
            format!("team/{robot}/heartbeat"),
        ] {
            expected.insert((key, true));
        }
    }
    wait_until("all messages to be received", || {
        expected.is_subset(&received.lock().unwrap())
    });
    lab.run(&["clock", "speed", "max"]).expect(0);
    world.wait().expect(0);
    for agent in agents {
        agent.wait().expect(0);
    }
}

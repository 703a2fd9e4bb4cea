//! A superseded incarnation receives a dismissal.
//!
//! On one machine a link breaks only with its process. Therefore this test acts as the former incarnation: it joins,
//! removes its token as after a broken link, and sends a report when another agent has the robot.

use std::sync::{Arc, Mutex};

use alliance_tests::harness::{Lab, expect_all, wait_until};
use alliance_tests::operator::{announced, connect, join};
use cluster::rendezvous::ConnectionRole;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use proto::tick::{Report, ToAgent};
use zenoh::Wait;

const RUN: &str = "run";

#[test]
fn a_superseded_incarnation_is_dismissed_and_a_dismissed_agent_ends() {
    let lab = Lab::new();
    let mut world = lab.world("run", "--run run --speed 20x --limit 300 --stall-after 0.2");
    world.wait_for_stderr("waiting for blue, gold, green");
    let run = announced(&lab);
    let keys = KeyExpressions::new(RUN);
    let secret = Secret::of_robot(&run.token, "gold");
    let session = connect(&run, ConnectionRole::Team);

    let received = Arc::new(Mutex::new(Vec::new()));
    let (sink, opener, key) = (Arc::clone(&received), secret.clone(), keys.tick("gold"));
    session
        .declare_subscriber(keys.tick("gold"))
        .callback(move |sample| {
            let message: ToAgent = opener.open(&key, &sample.payload().to_bytes()).unwrap();
            sink.lock().unwrap().push(message);
        })
        .background()
        .wait()
        .unwrap();
    let request = JoinRequest {
        version: PROTOCOL_VERSION,
        robot: "gold".to_owned(),
        pid: std::process::id(),
        nonce: 1,
    };
    let answer = join(&session, &run, &request, None);
    let JoinReply::Welcome(welcome) = answer else {
        panic!("{answer:?}");
    };
    assert_eq!(welcome.incarnation, 1);
    let token = secret.stamp(&keys.alive("gold", 1));
    let token = session.liveliness().declare_token(token).wait().unwrap();
    let teammates = ["blue", "green"].map(|robot| lab.agent(robot));
    let mut wait_for = |kind: &str, detail: &str| {
        let kind = format!(",{kind},gold,");
        lab.wait_for_row(&mut world, "events.csv", &[&kind, detail])
    };
    wait_until("the first incarnation's ticks", || {
        !received.lock().unwrap().is_empty()
    });
    token.undeclare().wait().unwrap();
    wait_for("gone", "incarnation 1");

    let mut successor = lab.agent("gold");
    wait_for("joined", "incarnation 2");
    let is_dismissed = || {
        let received = received.lock().unwrap();
        received.contains(&ToAgent::Dismissed(1))
    };
    assert!(!is_dismissed(), "the former one has sent nothing yet");
    let late = Report {
        robot: welcome.robot,
        incarnation: 1,
        ..Report::default()
    };
    let late = secret.seal(&keys.report("gold"), &late).unwrap();
    session.put(keys.report("gold"), late).wait().unwrap();
    wait_until("its dismissal", is_dismissed);
    let is_running = successor.is_running();
    assert!(is_running, "the dismissal must not affect the successor");

    // A real agent ends after a dismissal and reports the reason.
    let dismissal = <ToAgent>::Dismissed(2);
    let dismissal = secret.seal(&keys.tick("gold"), &dismissal).unwrap();
    session.put(keys.tick("gold"), dismissal).wait().unwrap();
    let ended = successor.wait().expect(3);
    ended.shows("a newer agent controls this robot");

    lab.run("clock speed max").expect(0);
    world.wait();
    expect_all(teammates, 0);
}

//! A superseded incarnation receives a dismissal.
//!
//! On one machine a link breaks only with its process. Therefore this test acts as the former incarnation: it joins,
//! removes its token as after a broken link, and sends a report when another agent has the robot.

use std::sync::{Arc, Mutex};

use alliance_tests::harness::{Lab, wait_until};
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
    let mut world = lab.start(&[
        "cluster",
        "world",
        "--run",
        RUN,
        "--out",
        "out",
        "--speed",
        "20x",
        "--limit",
        "300",
        "--stall-after",
        "0.2",
    ]);
    world.wait_for_stderr("waiting for blue, gold, green");
    let run = announced(&lab);
    let (keys, secret) = (
        KeyExpressions::new(RUN),
        Secret::of_robot(&run.token, "gold"),
    );
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
    let teammates = ["blue", "green"]
        .map(|robot| lab.start(&["cluster", "agent", "--robot", robot, "--run", RUN]));
    let has_event = |text: &str| {
        std::fs::read_to_string(lab.path("out/events.csv"))
            .is_ok_and(|events| events.contains(text))
    };
    wait_until("the first incarnation's ticks", || {
        !received.lock().unwrap().is_empty()
    });
    token.undeclare().wait().unwrap();
    wait_until("the end of the first incarnation", || {
        has_event(",gone,gold,,,incarnation 1")
    });

    let mut successor = lab.start(&["cluster", "agent", "--robot", "gold", "--run", RUN]);
    wait_until("the second incarnation", || {
        has_event(",joined,gold,,,incarnation 2")
    });
    let dismissed = |message: &ToAgent| *message == ToAgent::Dismissed(1);
    assert!(
        !received.lock().unwrap().iter().any(dismissed),
        "the former incarnation has sent nothing yet"
    );
    let late = Report {
        robot: welcome.robot,
        incarnation: 1,
        ..Report::default()
    };
    let late = secret.seal(&keys.report("gold"), &late).unwrap();
    session.put(keys.report("gold"), late).wait().unwrap();
    wait_until("its dismissal", || {
        received.lock().unwrap().iter().any(dismissed)
    });
    assert!(
        successor.is_running(),
        "the dismissal must not affect the successor"
    );

    // A real agent ends after a dismissal and reports the reason.
    let dismissal = secret
        .seal(&keys.tick("gold"), &<ToAgent>::Dismissed(2))
        .unwrap();
    session.put(keys.tick("gold"), dismissal).wait().unwrap();
    let ended = successor.wait().expect(3);
    assert!(
        ended.stderr.contains("a newer agent controls this robot"),
        "{}",
        ended.stderr
    );

    lab.run(&["clock", "speed", "max"]).expect(0);
    world.wait();
    for agent in teammates {
        agent.wait().expect(0);
    }
}

//! Operators come in by a gateway: what they do there is its burden, not the run's.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};

use alliance_proto::rendezvous::User;
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use zenoh::Wait;

use crate::flood::connect;
use crate::harness::{Lab, Process, command_line, wait_until};
use crate::hostile::{announced, hash};
use crate::story::ROBOTS;

/// Declared by an operator who means harm. What declaring one more costs grows with their number.
const DECLARED: usize = 5_000;

/// Process id of a world's gateway.
pub fn of(world: &Process) -> u32 {
    let mut found = None;
    wait_until("a gateway", || {
        let mut children = world.children().into_iter();
        found = children.find(|child| command_line(*child).is_some());
        found.is_some()
    });
    found.unwrap()
}

/// An operator fills the gateway's tables, and the gateway is killed; another one takes its place, in which the run's files still hold,
/// and no byte of the run changes. It ends with its world.
#[test]
fn an_operator_may_drown_the_gateway_and_not_the_run() {
    let lab = Lab::new();
    lab.mission("quiet", &["--log", "off"]).expect(0);
    // Slow: the run must not be over before a busy machine has declared all this.
    let mut world = lab.start(&["world", "--out", "out", "--speed", "1x", "--paused"]);
    let run = announced(&lab);
    let agents = ROBOTS.map(|robot| lab.start(&["agent", "--robot", robot]));
    world.wait_for_stderr("all robots are here; started");
    lab.run(&["clock", "resume"]).expect(0);

    let operator = connect(&run, User::Operator);
    let (mut tokens, mut subscribers) = (Vec::new(), Vec::new());
    for number in 0..DECLARED {
        let key = format!("alliance/{}/alive/blue/{number}/junk", run.run);
        tokens.push(operator.liveliness().declare_token(key).wait());
        let key = format!("alliance/{}/view/{number}", run.run);
        subscribers.push(operator.declare_subscriber(key).callback(|_| ()).wait());
    }
    let first = of(&world);
    kill(Pid::from_raw(first as i32), Signal::SIGKILL).unwrap();
    world.wait_for_stderr("the gateway for operators has ended");
    drop((tokens, subscribers));
    operator.close().wait().unwrap();
    let mut second = first;
    wait_until("another gateway", || {
        second = of(&world);
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

/// Who listens to everything hears what world and robots tell each other.
#[test]
fn an_operator_hears_the_team() {
    let lab = Lab::new();
    let mut world = lab.start(&["world", "--out", "out", "--speed", "30x", "--paused"]);
    let run = announced(&lab);
    let operator = connect(&run, User::Operator);
    let heard = Arc::new(Mutex::new(BTreeSet::new()));
    let hears = Arc::clone(&heard);
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
            let mut heard = hears.lock().unwrap();
            // Sealed, as the team puts it.
            heard.insert((key, sample.payload().len() > 8));
        })
        .background()
        .wait()
        .unwrap();
    let agents = ROBOTS.map(|robot| lab.start(&["agent", "--robot", robot]));
    world.wait_for_stderr("all robots are here; started");
    lab.run(&["clock", "resume"]).expect(0);
    let mut wanted = BTreeSet::from(["view", "event"].map(|key| (key.to_owned(), true)));
    for robot in ROBOTS {
        for key in [
            format!("robot/{robot}/tick"),
            format!("robot/{robot}/report"),
            format!("team/{robot}/heartbeat"),
        ] {
            wanted.insert((key, true));
        }
    }
    wait_until("everything to be heard", || {
        wanted.is_subset(&heard.lock().unwrap())
    });
    lab.run(&["clock", "speed", "max"]).expect(0);
    world.wait().expect(0);
    for agent in agents {
        agent.wait().expect(0);
    }
}

//! An agent and a world of different builds: the join is refused with the reason, for an older and a newer agent.

use std::net::TcpListener;
use std::time::Duration;

use alliance_tests::harness::{Lab, expect_all};
use alliance_tests::operator::{announced, connect, join};
use alliance_tests::testkit::ROBOTS;
use cluster::rendezvous::{ConnectionRole, JoinEndpoint, Rendezvous};
use cluster::session::Router;
use proto::codec::encode;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use zenoh::{Config, Session, Wait};

const RUN: &str = "run";
const OTHER: u32 = PROTOCOL_VERSION + 1;

fn request(version: u32) -> JoinRequest {
    JoinRequest {
        version,
        robot: "blue".to_owned(),
        pid: 1,
        // A world accepts each nonce once.
        nonce: version.into(),
    }
}

#[test]
fn the_world_refuses_an_agent_of_another_version_and_reports_one_of_another_build() {
    let lab = Lab::new();
    let mut world = lab.world("out", "--run run --limit 5");
    world.wait_for_stderr("waiting for blue, gold, green");
    let run = announced(&lab);
    let session = connect(&run, ConnectionRole::Team);
    let refused = JoinReply::Refused(Refusal::Version {
        agent: OTHER,
        world: PROTOCOL_VERSION,
    });
    assert_eq!(join(&session, &run, &request(OTHER), None), refused);
    // All versions send the version number first, independent of the rest and of the seal.
    let keys = KeyExpressions::new(RUN);
    let other_shape = encode(&(OTHER, [1_u8; 20])).unwrap();
    let replies = session.get(keys.join("blue")).payload(other_shape).wait();
    let reply = replies.unwrap().recv().unwrap().into_result().unwrap();
    let secret = Secret::of_robot(&run.token, "blue");
    let key = keys.join_answer("blue", 0);
    let answer: JoinReply = secret.open(&key, &reply.payload().to_bytes()).unwrap();
    assert_eq!(answer, refused);

    let same_version = request(PROTOCOL_VERSION);
    let answer = join(&session, &run, &same_version, Some("00000000deadbeef"));
    assert!(matches!(answer, JoinReply::Welcome(_)), "{answer:?}");
    world.wait_for_stderr("of another build");

    // The welcomed agent shows no token, so its place becomes free.
    std::thread::sleep(Duration::from_secs(6));
    expect_all(ROBOTS.map(|robot| lab.agent(robot)), 0);
    world.wait().expect(1);
    let log = lab.log("out");
    assert_eq!(log.run.build, launch::BUILD);
    assert_eq!(lab.json("out/host.json")["build"], launch::BUILD);
    let builds: Vec<(String, String)> = log.run.agent_builds.into_iter().collect();
    assert_eq!(builds, [("blue".to_owned(), "00000000deadbeef".to_owned())]);
    let replayed = lab.run("replay out").expect(0).stderr;
    let line = format!(
        "the agent of blue was of build 00000000deadbeef; this is build {}\nidentical",
        launch::BUILD
    );
    assert!(replayed.starts_with(&line), "{replayed}");

    let version = format!("alliance {}\n", launch::VERSION);
    assert_eq!(lab.run("--version").expect(0).stdout, version);
    assert!(launch::VERSION.ends_with(&format!("(build {})", launch::BUILD)));
}

/// A world that refuses every agent because of its version. The reply is sealed for the agent's nonce if the world
/// understands the request, else for 0.
struct OtherWorld {
    _session: Session,
}

impl OtherWorld {
    fn new(lab: &Lab, understands: bool) -> Self {
        // The port was free, and no other process in this lab listens.
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        drop(listener);
        let run = Rendezvous {
            run: RUN.to_owned(),
            endpoint: String::new(),
            pid: std::process::id(),
            token: "secret".to_owned(),
            team: JoinEndpoint {
                endpoint: format!("tcp/127.0.0.1:{port}"),
                password: "password".to_owned(),
            },
            started: 0,
            remote: None,
        };
        let users = [(ConnectionRole::Team.name(), run.team.password.as_str())];
        let members = cluster::session::Members::new(users).unwrap();
        let config = cluster::session::router(&Router {
            listen: std::slice::from_ref(&run.team.endpoint),
            uplink: None,
            members: &members,
            keyring: None,
            access: String::new(),
        });
        let session = zenoh::open(Config::from_json5(&config).unwrap());
        let session = session.wait().unwrap();
        let keys = KeyExpressions::new(RUN);
        let secret = Secret::of_robot(&run.token, "blue");
        let join = keys.join("blue");
        session
            .declare_queryable(join.clone())
            .callback(move |query| {
                let bytes = query.payload().unwrap().to_bytes();
                let request: JoinRequest = secret.open(&join, &bytes).unwrap();
                let refusal = JoinReply::Refused(Refusal::Version {
                    agent: request.version,
                    world: OTHER,
                });
                let nonce = if understands { request.nonce } else { 0 };
                let answer = secret.seal(&keys.join_answer("blue", nonce), &refusal);
                query.reply(&join, answer.unwrap()).wait().unwrap();
            })
            .background()
            .wait()
            .unwrap();
        let folder = lab.path("runtime/alliance");
        std::fs::create_dir_all(&folder).unwrap();
        let private = std::os::unix::fs::PermissionsExt::from_mode(0o700);
        std::fs::set_permissions(&folder, private).unwrap();
        lab.write(
            "runtime/alliance/run.json",
            serde_json::to_vec(&run).unwrap(),
        );
        Self { _session: session }
    }
}

#[test]
fn an_agent_reports_that_its_world_has_another_version() {
    for understands in [true, false] {
        let lab = Lab::new();
        let _world = OtherWorld::new(&lab, understands);
        let agent = lab.agent("blue").wait().expect(3);
        agent.shows(&format!(
            "robot-agent blue: refused: the agent uses protocol version {PROTOCOL_VERSION}, the world uses {OTHER}: start both from the same build"
        ));
    }
}

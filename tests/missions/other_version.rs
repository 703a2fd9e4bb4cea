//! An agent and a world of different builds: the join is refused with the reason, for an older and a newer agent.

use std::net::TcpListener;
use std::time::Duration;

use alliance_tests::harness::Lab;
use alliance_tests::operator::{announced, connect, join};
use cluster::rendezvous::{ConnectionRole, JoinEndpoint, Rendezvous};
use cluster::session::Router;
use proto::codec::encode;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use zenoh::{Config, Session, Wait};

const RUN: &str = "run";
const OTHER: u32 = PROTOCOL_VERSION + 1;
const NONCE: u128 = 7;

fn session(config: &str) -> Session {
    zenoh::open(Config::from_json5(config).unwrap())
        .wait()
        .unwrap()
}

#[test]
fn the_world_refuses_an_agent_of_another_version() {
    let lab = Lab::new();
    let mut world = lab.start(&[
        "cluster", "world", "--run", RUN, "--out", "out", "--limit", "5",
    ]);
    world.wait_for_stderr("waiting for blue, gold, green");
    let run = announced(&lab);
    let session = connect(&run, ConnectionRole::Team);
    let refused = JoinReply::Refused(Refusal::Version {
        agent: OTHER,
        world: PROTOCOL_VERSION,
    });

    let request = JoinRequest {
        version: OTHER,
        robot: "blue".to_owned(),
        pid: 1,
        nonce: NONCE,
    };
    assert_eq!(join(&session, &run, &request, None), refused);
    // All versions send the version number first, independent of the rest and of the seal.
    let keys = KeyExpressions::new(RUN);
    let other_shape = encode(&(OTHER, [1_u8; 20])).unwrap();
    let replies = session.get(keys.join("blue")).payload(other_shape).wait();
    let reply = replies.unwrap().recv().unwrap().into_result().unwrap();
    let (secret, key) = (
        Secret::of_robot(&run.token, "blue"),
        keys.join_answer("blue", 0),
    );
    let answer: JoinReply = secret.open(&key, &reply.payload().to_bytes()).unwrap();
    assert_eq!(answer, refused);

    // The robot can still join.
    let agents =
        ["blue", "gold", "green"].map(|robot| lab.start(&["cluster", "agent", "--robot", robot]));
    for agent in agents {
        agent.wait().expect(0);
    }
    world.wait().expect(1);
}

#[test]
fn an_agent_of_another_build_is_reported() {
    let lab = Lab::new();
    let arguments = [
        "cluster", "world", "--run", RUN, "--out", "out", "--limit", "5",
    ];
    let mut world = lab.start(&arguments);
    world.wait_for_stderr("waiting for blue, gold, green");
    let run = announced(&lab);
    let session = connect(&run, ConnectionRole::Team);
    let request = JoinRequest {
        version: PROTOCOL_VERSION,
        robot: "blue".to_owned(),
        pid: 1,
        nonce: NONCE,
    };
    let answer = join(&session, &run, &request, Some("00000000deadbeef"));
    assert!(matches!(answer, JoinReply::Welcome(_)), "{answer:?}");
    world.wait_for_stderr("of another build");

    // The welcomed agent shows no token, so its place becomes free.
    std::thread::sleep(Duration::from_secs(6));
    let agents =
        ["blue", "gold", "green"].map(|robot| lab.start(&["cluster", "agent", "--robot", robot]));
    for agent in agents {
        agent.wait().expect(0);
    }
    world.wait().expect(1);
    let log = lab.log("out");
    assert_eq!(log.run.build, launch::BUILD);
    let host = std::fs::read(lab.path("out/host.json")).unwrap();
    let host: serde_json::Value = serde_json::from_slice(&host).unwrap();
    assert_eq!(host["build"], launch::BUILD);
    let builds: Vec<(String, String)> = log.run.agent_builds.into_iter().collect();
    assert_eq!(builds, [("blue".to_owned(), "00000000deadbeef".to_owned())]);
    let replayed = lab.run(&["replay", "out"]).expect(0).stderr;
    let line = format!(
        "the agent of blue was of build 00000000deadbeef; this is build {}\nidentical",
        launch::BUILD
    );
    assert!(replayed.starts_with(&line), "{replayed}");
}

#[test]
fn every_program_prints_its_own_name_and_the_same_build() {
    let version = format!("alliance {}\n", launch::VERSION);
    assert_eq!(Lab::new().run(&["--version"]).expect(0).stdout, version);
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
        let port = TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
            .port();
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
        let session = session(&cluster::session::router(&Router {
            listen: std::slice::from_ref(&run.team.endpoint),
            uplink: None,
            members: &members,
            keyring: None,
            access: String::new(),
        }));
        let (keys, secret) = (
            KeyExpressions::new(RUN),
            Secret::of_robot(&run.token, "blue"),
        );
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
                let answer = secret
                    .seal(&keys.join_answer("blue", nonce), &refusal)
                    .unwrap();
                query.reply(&join, answer).wait().unwrap();
            })
            .background()
            .wait()
            .unwrap();
        let folder = lab.path("runtime/alliance");
        std::fs::create_dir_all(&folder).unwrap();
        let private = std::os::unix::fs::PermissionsExt::from_mode(0o700);
        std::fs::set_permissions(&folder, private).unwrap();
        std::fs::write(folder.join("run.json"), serde_json::to_vec(&run).unwrap()).unwrap();
        Self { _session: session }
    }
}

#[test]
fn an_agent_reports_that_its_world_has_another_version() {
    for understands in [true, false] {
        let lab = Lab::new();
        let _world = OtherWorld::new(&lab, understands);
        let agent = lab.run(&["cluster", "agent", "--robot", "blue"]).expect(3);
        let expected = format!(
            "robot-agent blue: refused: the agent uses protocol version {PROTOCOL_VERSION}, the world uses {OTHER}: start both from the same build"
        );
        assert!(agent.stderr.contains(&expected), "{}", agent.stderr);
    }
}

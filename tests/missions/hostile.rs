//! A hostile client on the bus: its messages are counted and ignored.

use std::collections::{BTreeMap, VecDeque};
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex};

use alliance_tests::damage::corpus;
use alliance_tests::harness::{Finished, Lab, expect_all};
use alliance_tests::operator::{MEMORY_MIB, announced, connect, hash, peak_memory};
use alliance_tests::testkit::ROBOTS;
use cluster::rendezvous::{ConnectionRole, Rendezvous};
use missions::waste::data::WASTE;
use proto::codec::{LIMIT_BYTES, encode};
use proto::control::{ControlCommand, Request};
use proto::keys::{KeyExpressions, LAUNCHER_HOST};
use proto::secret::{SEAL_BYTES, Secret};
use proto::team::BroadcastKind;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::fault::{Fault, Order};
use zenoh::bytes::Encoding;
use zenoh::qos::CongestionControl;
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

/// The number of messages of each kind during the missions.
const EACH: usize = 2_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Noise,
    /// A real message without its end.
    Truncated,
    /// More bytes than a message may have, sometimes more than the bus carries.
    Oversized,
    /// A real message on the key of another robot, or on another key.
    Misplaced,
    /// A real message of the first ticks, on its own key.
    Stale,
    /// A recent real message on its own key.
    Replayed,
    /// A well-formed message with a wrong seal.
    Forged,
    /// Sealed noise, which no correct member sends.
    Invalid,
}

const KINDS: [Kind; 8] = [
    Kind::Noise,
    Kind::Truncated,
    Kind::Oversized,
    Kind::Misplaced,
    Kind::Stale,
    Kind::Replayed,
    Kind::Forged,
    Kind::Invalid,
];

#[derive(Default)]
struct Captured {
    first: Vec<Vec<u8>>,
    latest: VecDeque<Vec<u8>>,
}

struct HostileClient {
    session: Session,
    keys: KeyExpressions,
    secret: Secret,
    run: Rendezvous,
    captured: Arc<Mutex<BTreeMap<String, Captured>>>,
    tokens: Arc<Mutex<Vec<String>>>,
    rng: ChaCha8Rng,
}

impl HostileClient {
    /// Joins the bus of the lab's only run and subscribes to everything.
    fn intrude(lab: &Lab) -> Self {
        let run = announced(lab);
        let session = connect(&run, ConnectionRole::Team);
        let keys = KeyExpressions::new(&run.run);
        let captured = Arc::new(Mutex::new(BTreeMap::<String, Captured>::new()));
        let sink = Arc::clone(&captured);
        session
            .declare_subscriber(format!("alliance/{}/**", run.run))
            // The client's own messages are excluded.
            .allowed_origin(Locality::Remote)
            .callback(move |sample| keep(&sink, sample.key_expr(), &sample.payload().to_bytes()))
            .background()
            .wait()
            .unwrap();
        // The client also replies to requests for the world, with noise, and captures them.
        for key in [keys.joins(), keys.control()] {
            let sink = Arc::clone(&captured);
            session
                .declare_queryable(key.clone())
                .complete(true)
                .allowed_origin(Locality::Remote)
                .callback(move |query| {
                    let request = query.payload().map(|payload| payload.to_bytes());
                    keep(&sink, &key, request.as_deref().unwrap_or_default());
                    let _ = query.reply(&key, vec![7; 40]).wait();
                })
                .background()
                .wait()
                .unwrap();
        }
        let tokens = Arc::<Mutex<Vec<String>>>::default();
        let seen = Arc::clone(&tokens);
        session
            .liveliness()
            .declare_subscriber(format!("alliance/{}/alive/**", run.run))
            .history(true)
            .callback(move |sample| seen.lock().unwrap().push(sample.key_expr().to_string()))
            .background()
            .wait()
            .unwrap();
        Self {
            session,
            keys,
            secret: Secret::from_token(&run.token),
            run,
            captured,
            tokens,
            rng: ChaCha8Rng::seed_from_u64(3),
        }
    }

    fn all_keys(&self) -> Vec<String> {
        let mut keys = vec![
            self.keys.join("blue"),
            self.keys.process(LAUNCHER_HOST),
            self.keys.control(),
            self.keys.event(),
            self.keys.view(),
        ];
        for robot in ROBOTS {
            keys.push(self.keys.tick(robot));
            keys.push(self.keys.report(robot));
            let bulletins = WASTE.vocabulary().bulletins;
            keys.extend(BroadcastKind::ALL.map(|kind| self.keys.team(robot, kind.name(bulletins))));
        }
        keys
    }

    fn put(&mut self, kind: Kind, key: &str) {
        let payload = self.make(kind, key);
        if key == self.keys.control() {
            self.put_request(kind, key, payload);
        } else if key == self.keys.join("blue") {
            let query = self.session.get(key).payload(payload).callback(|_| {});
            query.wait().unwrap();
        } else {
            let put = self.session.put(key, payload);
            let put = put.congestion_control(CongestionControl::Block);
            put.wait().unwrap();
        }
    }

    /// Puts a request on the control topic in one of its forms, or sends it as a query.
    fn put_request(&mut self, kind: Kind, key: &str, mut payload: Vec<u8>) {
        let is_json: bool = self.rng.random();
        let mut seal = None;
        if is_json {
            if matches!(kind, Kind::Forged | Kind::Invalid) {
                payload = serde_json::to_vec(&self.request()).unwrap();
            }
            seal = match kind {
                Kind::Invalid => Some(self.secret.mark_text(key, &payload)),
                Kind::Forged => Some("0".repeat(64)),
                _ => None,
            };
        }
        let encoding = match is_json {
            true => Encoding::APPLICATION_JSON,
            false => Encoding::ZENOH_BYTES,
        };
        if self.rng.random() {
            let query = self.session.get(key).payload(payload).encoding(encoding);
            query.attachment(seal).callback(|_| {}).wait().unwrap();
        } else {
            let put = self.session.put(key, payload).encoding(encoding);
            let put = put.congestion_control(CongestionControl::Block);
            put.attachment(seal).wait().unwrap();
        }
    }

    /// Returns a request that the world must refuse.
    fn request(&mut self) -> Request {
        Request {
            nonce: format!("{:x}", self.rng.random::<u64>()),
            command: ControlCommand::Fault(Order::now(Fault::Kill("nobody".to_owned()))),
        }
    }

    fn make(&mut self, kind: Kind, key: &str) -> Vec<u8> {
        match kind {
            Kind::Noise => self.noise(0..2000),
            Kind::Oversized if self.rng.random_ratio(1, 200) => self.noise(2 << 20..3 << 20),
            Kind::Oversized => self.noise(LIMIT_BYTES + SEAL_BYTES + 1..LIMIT_BYTES + 1000),
            Kind::Truncated => {
                let mut message = self.real(key, true);
                message.truncate(self.rng.random_range(0..message.len().max(1)));
                message
            }
            Kind::Misplaced => {
                let others = self.all_keys();
                let other = others.iter().cycle().skip_while(|other| *other != key);
                // A robot has six keys, so this is the same key of the next robot, or another kind of message.
                let other = other.clone().nth(6).unwrap().clone();
                self.real(&other, true)
            }
            Kind::Stale => self.real(key, false),
            Kind::Replayed => self.real(key, true),
            Kind::Forged => {
                let mut message = self.well_formed(key);
                message.extend(self.noise(SEAL_BYTES..SEAL_BYTES + 1));
                message
            }
            Kind::Invalid => {
                let noise = self.noise(0..200);
                self.sealed(key, &noise)
            }
        }
    }

    fn noise(&mut self, length: std::ops::Range<usize>) -> Vec<u8> {
        let mut bytes = vec![0; self.rng.random_range(length)];
        self.rng.fill_bytes(&mut bytes);
        bytes
    }

    /// Returns a captured message of that key, or noise if there is none.
    fn real(&mut self, key: &str, late: bool) -> Vec<u8> {
        let pick = self.rng.random_range(0..KEPT);
        let captured = self.captured.lock().unwrap();
        let found = captured.get(key).and_then(|messages| match late {
            true => messages.latest.iter().cycle().nth(pick).cloned(),
            false => messages.first.iter().cycle().nth(pick).cloned(),
        });
        drop(captured);
        found.unwrap_or_else(|| self.noise(1..100))
    }

    /// Returns a message of the fuzzers' corpus that fits the key.
    fn well_formed(&mut self, key: &str) -> Vec<u8> {
        if key == self.keys.control() {
            return encode(&self.request()).unwrap();
        }
        let kinds = ["tick", "report", "process", "view", "join"];
        let kind = kinds
            .into_iter()
            .find(|kind| key.contains(&format!("/{kind}")));
        let start = match kind {
            Some("process") => "process_news",
            Some("join") => "join_request",
            Some(kind) => kind,
            None => "broadcast",
        };
        let mut messages = corpus("decode");
        messages.retain(|(name, _)| name.starts_with(start));
        messages
            .swap_remove(self.rng.random_range(0..messages.len()))
            .1
    }

    /// Seals bytes for a key with the secret of its sender.
    fn sealed(&self, key: &str, bytes: &[u8]) -> Vec<u8> {
        let sender = match key {
            _ if key.contains("/join/") => Some(KeyExpressions::parse_sender(key)),
            _ if key.contains("/team/") => None,
            _ => self.keys.parse_robot(key),
        };
        let secret = sender.map_or_else(
            || self.secret.clone(),
            |name| Secret::of_robot(&self.run.token, name),
        );
        [bytes, &secret.seal_of(key, bytes)].concat()
    }

    /// Declares and removes liveliness tokens: of missing incarnations, and copies of existing ones.
    fn juggle_tokens(&mut self) {
        let mut keys = vec![self.keys.alive_world(), self.keys.alive("nobody", 1)];
        for robot in ROBOTS {
            keys.extend((0..4).map(|incarnation| self.keys.alive(robot, incarnation)));
            let stamp = self.rng.random::<u64>();
            keys.push(format!("{}/{stamp:016x}", self.keys.alive(robot, 1)));
        }
        keys.extend(self.tokens.lock().unwrap().iter().cloned());
        keys.sort();
        keys.dedup();
        let declared = keys.into_iter().map(|key| {
            let token = self.session.liveliness().declare_token(key);
            token.wait().unwrap()
        });
        for token in declared.collect::<Vec<_>>() {
            token.undeclare().wait().unwrap();
        }
    }
}

/// The number of first and of latest messages kept per key.
const KEPT: usize = 50;

fn keep(captured: &Mutex<BTreeMap<String, Captured>>, key: &str, bytes: &[u8]) {
    let mut captured = captured.lock().unwrap();
    let messages = captured.entry(key.to_owned()).or_default();
    if messages.first.len() < KEPT {
        messages.first.push(bytes.to_vec());
    }
    if messages.latest.len() == KEPT {
        messages.latest.pop_front();
    }
    messages.latest.push_back(bytes.to_vec());
}

/// Runs a mission of separate processes and calls `attack` repeatedly.
fn mission_under_attack(
    lab: &Lab,
    out: &str,
    mut attack: impl FnMut(&mut HostileClient),
) -> (Finished, Vec<Finished>) {
    let mut world = lab.world(out, "--speed 30x");
    let mut client = HostileClient::intrude(lab);
    // These tokens exist before their agents.
    client.juggle_tokens();
    let agents = ROBOTS.map(|robot| lab.agent(robot));
    world.wait_for_stderr("all robots are here; started");
    // Real requests, which the client captures and replays.
    for _ in 0..3 {
        lab.run("status --json").expect(0);
    }
    while world.is_running() {
        attack(&mut client);
        for process in agents.iter().chain([&world]) {
            let peak = peak_memory(process.pid()).unwrap_or_default();
            assert!(peak < MEMORY_MIB, "{peak} MiB:\n{}", process.stderr());
        }
    }
    let _ = client.session.close().wait();
    let agents = expect_all(agents, 0);
    (world.wait().expect(0), agents)
}

/// A client in the team's session, and clients without the token: without a password, with a wrong one, or with a
/// broken greeting. The latter get no session.
#[test]
fn a_hostile_client_on_the_bus_changes_nothing_and_without_the_token_there_is_no_session() {
    let lab = Lab::new();
    lab.mission("quiet", "--log off").expect(0);
    let quiet = hash(&lab, "quiet");

    let mut left: BTreeMap<Kind, usize> = KINDS.iter().map(|kind| (*kind, EACH)).collect();
    let mut round = 0;
    let mut strangers = Strangers::default();
    while left.values().any(|count| *count > 0) {
        round += 1;
        let out = format!("round-{round}");
        let mut put = BTreeMap::<String, u64>::new();
        let (world, agents) = mission_under_attack(&lab, &out, |client| {
            let keys = client.all_keys();
            client.juggle_tokens();
            strangers.try_to_enter(&client.run);
            for key in keys.iter().cycle().take(20 * keys.len()) {
                for kind in KINDS {
                    let left = left.get_mut(&kind).unwrap();
                    if *left > 0 {
                        *left -= 1;
                        client.put(kind, key);
                        let leaf = key.rsplit('/').next().unwrap();
                        *put.entry(leaf.to_owned()).or_default() += 1;
                    }
                }
            }
        });
        assert_eq!(hash(&lab, &out), quiet, "{}", world.stderr);

        let refused = &lab.json(&format!("{out}/host.json"))["refused"];
        println!("put {put:?}, refused {refused}");
        // Agents refuse ticks, observers refuse views.
        for (kind, count) in [
            ("join", put["blue"]),
            ("process", put[LAUNCHER_HOST]),
            ("report", put["report"]),
            ("broadcast", put["heartbeat"]),
            ("control", put["control"]),
            ("token", 1),
        ] {
            // Some messages do not count: too large for the bus, too late for the run, or refused by a reply.
            let refused = refused[kind].as_u64().unwrap_or(0);
            assert!(refused * 2 >= count, "{refused} of {count} {kind}");
        }
        for process in agents.iter().chain([&world]) {
            let warnings = process.stderr.matches("message ignored").count();
            let is_limited = (1..1000).contains(&warnings);
            assert!(is_limited, "{warnings} lines of {}", process.name);
        }
        for agent in agents {
            agent.shows("messages ignored in this incarnation kind=\"tick\"");
        }
    }
    assert!(strangers.tried > 2, "{}", strangers.tried);
}

/// Clients without the token.
#[derive(Default)]
struct Strangers {
    tried: u32,
    sockets: Vec<UnixStream>,
}

impl Strangers {
    /// Tries a session with a wrong password and one without a password, and sends half a greeting.
    fn try_to_enter(&mut self, run: &Rendezvous) {
        let mut login = run.login(ConnectionRole::Team).unwrap();
        let right = cluster::session::client(&login, true);
        login.password = "0f5c31c27ad2bd0a".to_owned();
        let wrong = cluster::session::client(&login, true);
        let (before, after) = right.split_at(right.find("auth:").unwrap());
        let none = format!("{before}{}", &after[after.find("link:").unwrap()..]);
        for config in [&wrong, &none] {
            let config = zenoh::Config::from_json5(config).unwrap();
            assert!(zenoh::open(config).wait().is_err());
            self.tried += 1;
        }
        // The connection stays open after half a greeting.
        let address = run.team.endpoint.strip_prefix("unixsock-stream/").unwrap();
        if let Ok(mut socket) = UnixStream::connect(address)
            && self.sockets.len() < 100
        {
            let _ = socket.write_all(&[9, 0, 1, 2, 3]);
            self.sockets.push(socket);
        }
    }
}

//! A hostile host on the network, without a certificate of the team and with a robot's certificate. The run keeps the
//! bytes of an undisturbed run.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddrV4, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use alliance_tests::harness::wait_until;
use alliance_tests::operator::{MEMORY_MIB, peak_memory, stay_on};
use cluster::key_files::KeyFiles;
use cluster::keyring::Keyring;
use cluster::member::Login;
use cluster::session;
use proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal};
use proto::keys::{ALIVE_WORLDS, KeyExpressions, LAUNCHER_HOST, run_of_world};
use proto::secret::{Secret, random};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use super::{AWAY, Machines, TWO_HOSTS, WORLD};

/// The number of connections that are open at once.
const CROWD: usize = 500;

/// The minimum number of tries per attack.
const EACH: u32 = 5;

/// The round in which the crowd of connections has existed for a while.
const CROWDED: u32 = 8;

/// The number of messages that the insider captures and replays.
const CAPTURED: usize = 200;

type Tries = BTreeMap<&'static str, u32>;

#[test]
fn a_hostile_host_changes_no_byte() {
    let Some(machines) = Machines::enter(3, &TWO_HOSTS) else {
        return;
    };
    let daemon = machines.daemon("h2", "h2", &AWAY);
    let mut run = machines.up("--limit 100 --speed 20x --stall-after 60");
    run.wait_for("activated", &["gold"]);
    run.pace("2x");
    let mut tries = Tries::new();
    let mut outsider = Outsider::of(&machines);
    // The threads of zenoh run on that host, too.
    machines.hosts.within("h3", || {
        let insider = Insider::enter(&machines);
        for round in 0.. {
            match round {
                0 => outsider.open_crowd(&mut tries),
                CROWDED => run.pace("max"),
                _ => outsider.send_slowly(&mut tries),
            }
            insider.attack(&mut tries);
            for process in run.launcher.children() {
                let peak = peak_memory(process).unwrap_or_default();
                assert!(peak < MEMORY_MIB, "{peak} MiB");
            }
            if !run.launcher.is_running() {
                assert!(round > CROWDED, "the run ended in round {round}");
                break;
            }
        }
        insider.leave();
    });
    println!("tries: {tries:?}");
    for (attack, times) in &tries {
        assert!(*times >= EACH, "{attack}: {times}");
    }
    run.end();
    daemon.wait().expect(0);
    let refused = &machines.lab.json("run/host.json")["refused"];
    println!("refused by the world: {refused}");
    // Reports of gold reach the world without a valid seal. The router stops all other messages.
    assert!(refused["report"].as_u64().unwrap() >= u64::from(EACH));
    for kind in ["process", "control", "token", "team"] {
        assert_eq!(refused[kind].as_u64().unwrap_or(0), 0, "{kind}");
    }
    machines.assert_same_as_one_machine("100");
    machines.replayed_log();
}

/// A host without a valid certificate. `cluster` tests that it cannot log in.
struct Outsider {
    /// The first bytes of a TLS connection.
    greeting: Vec<u8>,
    crowd: Vec<TcpStream>,
    rng: ChaCha8Rng,
}

impl Outsider {
    fn of(machines: &Machines) -> Self {
        Self {
            greeting: greeting(machines),
            crowd: Vec::new(),
            rng: ChaCha8Rng::seed_from_u64(5),
        }
    }

    /// Opens connections that send nothing, half a greeting, junk, or a whole greeting, and then stay idle.
    fn open_crowd(&mut self, tries: &mut Tries) {
        for number in 0..CROWD {
            let mut junk = [0; 300];
            self.rng.fill_bytes(&mut junk);
            let whole = &self.greeting[..];
            let (attack, bytes) = match number % 4 {
                0 => ("no greeting", &whole[..0]),
                1 => ("half a greeting", &whole[..whole.len() / 2]),
                2 => ("junk", &junk[..]),
                _ => ("a greeting", whole),
            };
            let mut socket = TcpStream::connect(WORLD.trim_start_matches("tls/")).unwrap();
            // The world may have closed the connection already.
            let _ = socket.write_all(bytes);
            socket.set_nonblocking(true).unwrap();
            *tries.entry(attack).or_default() += 1;
            self.crowd.push(socket);
        }
    }

    /// Sends one more byte on each open connection.
    fn send_slowly(&mut self, tries: &mut Tries) {
        for mut socket in &self.crowd {
            let sent = socket.write_all(&[self.rng.random()]);
            *tries.entry("one byte at a time").or_default() += u32::from(sent.is_ok());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

type Captured = Vec<(String, Vec<u8>)>;

/// An attacker with a copy of gold's keys that sends messages of other members.
struct Insider {
    session: Session,
    keys: KeyExpressions,
    secret: Secret,
    captured: Arc<Mutex<Captured>>,
}

impl Insider {
    fn enter(machines: &Machines) -> Self {
        let login = login_of_gold(machines, WORLD);
        let session = open(&login).unwrap();
        let worlds = session.liveliness().get(ALIVE_WORLDS).wait().unwrap();
        let world = worlds.recv().unwrap().into_result().unwrap();
        let keys = KeyExpressions::new(run_of_world(world.key_expr()).unwrap());
        let captured = Arc::new(Mutex::new(Captured::new()));
        let [gold, blue] = ["gold", "blue"].map(|robot| keys.tick(robot));
        for key in [keys.team_all(), gold, blue, keys.all()] {
            let captured = Arc::clone(&captured);
            session
                .declare_subscriber(key)
                .allowed_origin(Locality::Remote)
                .callback(move |sample| {
                    let mut captured = captured.lock().unwrap();
                    if captured.len() < CAPTURED {
                        let key = sample.key_expr().to_string();
                        captured.push((key, sample.payload().to_bytes().into_owned()));
                    }
                })
                .background()
                .wait()
                .unwrap();
        }
        let insider = Self {
            session,
            keys,
            secret: Secret::from_token(&login.password),
            captured,
        };
        // The insider has joined: it receives what gold may receive.
        wait_until("ticks", || {
            insider.captured.lock().unwrap().len() == CAPTURED
        });
        let own = insider.keys.tick("gold");
        let captured = insider.captured.lock().unwrap();
        assert!(captured.iter().all(|(key, _)| *key == own));
        drop(captured);
        insider
    }

    fn attack(&self, tries: &mut Tries) {
        let mut tried = |attack| *tries.entry(attack).or_default() += 1;
        let keys = &self.keys;
        for (key, bytes) in self.captured.lock().unwrap().iter() {
            self.put(key, bytes.clone());
            tried("replayed messages");
        }
        for robot in ["blue", "green"] {
            let heartbeat = keys.team(robot, "heartbeat");
            for key in [keys.report(robot), heartbeat, keys.tick(robot)] {
                self.put(&key, self.secret.seal(&key, &7_u64).unwrap());
                tried("messages of other members under gold's seal");
            }
            // The token of a live robot, to suggest a second incarnation or its end.
            let alive = self.secret.stamp(&keys.alive(robot, 1));
            let token = self.session.liveliness().declare_token(alive);
            token.wait().unwrap().undeclare().wait().unwrap();
            tried("liveliness tokens of other robots");
            assert_eq!(self.join_as(robot), None);
            tried("joins as another robot");
        }
        if let Some(reply) = self.join_as("gold") {
            let is_taken = matches!(
                reply,
                JoinReply::Refused(Refusal::Taken { .. } | Refusal::Over)
            );
            assert!(is_taken, "{reply:?}");
        }
        tried("joins as gold, which has joined");
        for key in [
            keys.process(LAUNCHER_HOST),
            keys.process("h2"),
            keys.control(),
            keys.event(),
            keys.view(),
            keys.alive_world(),
            keys.report("gold"),
        ] {
            self.put(&key, vec![7; 64]);
            self.session.delete(&key).wait().unwrap();
            tried("messages that no robot may send");
        }
    }

    fn put(&self, key: &str, bytes: Vec<u8>) {
        self.session.put(key, bytes).wait().unwrap();
    }

    fn join_as(&self, robot: &str) -> Option<JoinReply> {
        let key = self.keys.join(robot);
        let nonce = random().unwrap();
        let request = JoinRequest {
            version: PROTOCOL_VERSION,
            robot: robot.to_owned(),
            pid: 1,
            nonce,
        };
        let request = self.secret.seal(&key, &request).unwrap();
        let replies = self.session.get(&key).payload(request);
        let replies = replies.timeout(Duration::from_secs(1));
        let reply = replies.wait().unwrap().recv().ok()?.into_result().ok()?;
        let answer = self.keys.join_answer(robot, nonce);
        self.secret.open(&answer, &reply.payload().to_bytes()).ok()
    }

    fn leave(self) {
        let _ = self.session.close().wait();
    }
}

/// Returns the login of gold with a copy of its keys.
fn login_of_gold(machines: &Machines, endpoint: &str) -> Login {
    let folder = KeyFiles::Folder(machines.lab.path("keys"));
    let keyring = Keyring::read(&folder, "robot-gold").unwrap();
    Login {
        endpoint: endpoint.to_owned(),
        user: "robot-gold".to_owned(),
        password: keyring.secret.clone(),
        keyring: Some(keyring),
    }
}

/// Returns the first bytes that zenoh sends over TLS.
fn greeting(machines: &Machines) -> Vec<u8> {
    let at = SocketAddrV4::new(machines.hosts.address("h3"), 7447);
    machines.hosts.within("h3", || {
        let listener = TcpListener::bind(at).unwrap();
        let receiver = std::thread::spawn(move || {
            let mut bytes = vec![0; 4096];
            let length = listener.accept().unwrap().0.read(&mut bytes).unwrap();
            bytes.truncate(length);
            bytes
        });
        let login = login_of_gold(machines, &format!("tls/{at}"));
        assert!(open(&login).is_err());
        receiver.join().unwrap()
    })
}

/// Opens a session with one try.
fn open(login: &Login) -> zenoh::Result<Session> {
    let config = session::client(login, true);
    zenoh::open(zenoh::Config::from_json5(&config)?).wait()
}

/// Prints the ticks per second of a run with and without a hostile host, in turn. The run has one core and the
/// attackers another.
///
/// `cargo test --release -p alliance-tests --test missions -- --ignored --nocapture the_cost_of_a_hostile_host`
#[test]
#[ignore = "a benchmark that prints figures without assertions"]
#[allow(clippy::disallowed_methods)] // The benchmark measures wall-clock time.
fn the_cost_of_a_hostile_host() {
    const ROUNDS: usize = 9;
    let Some(machines) = Machines::enter(3, &TWO_HOSTS) else {
        return;
    };
    // More items than the team can carry away.
    machines.use_scenario(
        "name = 'long'\n[[waste.spills]]\nname = 'top'\nitems = 1000\ny_fraction = 0.667\n\
         [[waste.spills]]\nname = 'bottom'\nitems = 1000\ny_fraction = 0.333\n",
    );
    stay_on(0);
    let mut rates = [Vec::new(), Vec::new()];
    let mut tries = Tries::new();
    for round in 0..2 * ROUNDS {
        let is_attacked = round % 2 == 1;
        let daemon = machines.daemon("h2", "h2", &AWAY);
        let mut run = machines.up("--limit 600 --speed 20x --stall-after 60");
        run.wait_for("activated", &["gold"]);
        let rate = machines.hosts.within("h3", || {
            stay_on(1);
            let mut attackers = is_attacked.then(|| {
                // The insider joins first, because a crowd blocks new connections.
                let insider = Insider::enter(&machines);
                let mut outsider = Outsider::of(&machines);
                outsider.open_crowd(&mut tries);
                (outsider, insider)
            });
            run.pace("max");
            let (from, began) = (run.now_ms(), Instant::now());
            while run.launcher.is_running() {
                match &mut attackers {
                    Some((outsider, insider)) => {
                        outsider.send_slowly(&mut tries);
                        insider.attack(&mut tries);
                    }
                    None => std::thread::sleep(Duration::from_millis(10)),
                }
            }
            let ticks = (run.now_ms() - from) / 50;
            if let Some((_, insider)) = attackers {
                insider.leave();
            }
            ticks as f64 / began.elapsed().as_secs_f64()
        });
        println!("attacked {is_attacked}: {rate:.0} ticks/s");
        rates[usize::from(is_attacked)].push(rate);
        run.end();
        daemon.wait().expect(0);
        let _ = std::fs::remove_dir_all(machines.lab.path("run"));
    }
    let [alone, attacked] = rates.map(|mut rates| {
        rates.sort_by(f64::total_cmp);
        rates[ROUNDS / 2]
    });
    println!("tries: {tries:?}");
    let ratio = attacked / alone;
    println!("medians: {alone:.0} alone, {attacked:.0} attacked: {ratio:.2}");
}

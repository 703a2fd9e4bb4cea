//! A hostile host on the network: without a certificate of the team, with one that is over, and with that of a robot, it does what it can
//! while a mission runs. Nothing gets in, and the bytes stay those of an undisturbed run.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{SocketAddrV4, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use alliance_proto::join::{JoinReply, JoinRequest, PROTOCOL_VERSION, Refusal};
use alliance_proto::keyring::Keyring;
use alliance_proto::keys::{ALIVE_WORLDS, Keys, LAUNCHER_HOST, run_of_world};
use alliance_proto::member::Login;
use alliance_proto::secret::{Secret, random};
use alliance_proto::session;
use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use super::forged::{ahead, holds, over, signed_by_the_team};
use super::{Machines, WORLD};
use crate::harness::wait_until;
use crate::hostile::{MEMORY_MIB, peak_memory};

/// Connections that are held open at once.
const CROWD: usize = 500;

/// How often each thing is tried, at least.
const EACH: u32 = 5;

/// The round in which the crowd has been there for a while.
const CROWDED: u32 = EACH + 20;

/// Messages that the insider has heard, and puts again.
const HEARD: usize = 200;

/// What was tried, how many times.
type Tries = BTreeMap<&'static str, u32>;

#[test]
fn a_hostile_host_changes_no_byte() {
    let places: [(&str, &[&str]); 2] = [("h1", &["blue"]), ("h2", &["gold", "green"])];
    let Some(machines) = Machines::enter(3, &places) else {
        return;
    };
    let daemon = machines.daemon("h2", "h2", &["gold", "green"]);
    let mut run = machines.up(&["--limit", "100", "--speed", "20x", "--stall-after", "60"]);
    run.wait_for("activated", &["gold"], 1);
    run.pace("2x");
    let mut tries = Tries::new();
    let mut stranger = Stranger::of(&machines);
    // From a host that belongs to nobody. Whatever threads zenoh starts are on it, too.
    machines.hosts.within("h3", || {
        let insider = Insider::enter(&machines);
        for round in 0.. {
            match round {
                0..EACH => stranger.logs_in(&mut tries),
                // Who fails makes the world wait before it looks at the next one: no more of these, then.
                EACH => stranger.crowds(&mut tries),
                CROWDED => run.pace("max"),
                _ => stranger.dawdles(&mut tries),
            }
            insider.tries(&mut tries);
            for process in run.launcher.children() {
                let peak = peak_memory(process).unwrap_or(0);
                assert!(peak < MEMORY_MIB, "{peak} MiB");
            }
            if !run.launcher.is_running() {
                assert!(round > CROWDED, "it ended in round {round}");
                break;
            }
        }
        insider.leaves();
    });
    println!("tries: {tries:?}");
    for (what, times) in &tries {
        assert!(*times >= EACH, "{what}: {times}");
    }
    run.end();
    daemon.wait().expect(0);
    let host = std::fs::read(machines.lab.path("run/host.json")).unwrap();
    let host: serde_json::Value = serde_json::from_slice(&host).unwrap();
    println!("refused by the world: {}", host["refused"]);
    // What is gold's to say arrives, and has no true seal. All else is stopped by its router.
    assert!(host["refused"]["report"].as_u64().unwrap() >= u64::from(EACH));
    for kind in ["process", "control", "token", "team"] {
        assert_eq!(host["refused"][kind].as_u64().unwrap_or(0), 0, "{kind}");
    }
    machines.assert_as_alone("100");
    machines.repeated();
}

/// One without a certificate that counts.
struct Stranger {
    /// Who asks for a session, and why it gets none.
    logins: Vec<(&'static str, Login)>,
    /// Configuration of who connects by TLS without a certificate.
    nameless: String,
    /// First words of a connection by TLS.
    greeting: Vec<u8>,
    crowd: Vec<TcpStream>,
    chance: ChaCha8Rng,
}

impl Stranger {
    fn of(machines: &Machines) -> Self {
        let lab = &machines.lab;
        lab.run(&["keys", "cluster.toml", "--out", "other"])
            .expect(0);
        let own = lab.path("keys");
        let of = |folder: &Path, identity| keyring(folder, &own, identity);
        let gold = of(&own, "robot-gold");
        let tls = |keyring: &Keyring, user: &str, password: &str| Login {
            endpoint: WORLD.to_owned(),
            user: user.to_owned(),
            password: password.to_owned(),
            keyring: Some(keyring.clone()),
        };
        let known = |keyring: &Keyring| tls(keyring, "robot-gold", &gold.secret);
        let other = lab.path("other");
        let folders = [("over", over()), ("ahead", ahead())];
        let [past, future] = folders.map(|(name, dates)| {
            let folder = signed_by_the_team(&own, &lab.path(name), "robot-gold", dates);
            known(&of(&folder, "robot-gold"))
        });
        let logins = vec![
            (
                "authority of another team",
                known(&of(&other, "robot-gold")),
            ),
            (
                "host of another team",
                tls(
                    &of(&other, "host-h2"),
                    "host-h2",
                    &of(&own, "host-h2").secret,
                ),
            ),
            ("certificate that is over", past),
            ("certificate of tomorrow", future),
            (
                "no encryption",
                Login {
                    endpoint: WORLD.replace("tls/", "tcp/"),
                    keyring: None,
                    ..known(&gold)
                },
            ),
            (
                "wrong password",
                tls(&gold, "robot-gold", "0123456789abcdef0123456789abcdef"),
            ),
            (
                "gold's certificate and blue's name",
                tls(&gold, "robot-blue", &gold.secret),
            ),
            (
                "gold's certificate and the world's name",
                tls(&gold, "world", &gold.secret),
            ),
        ];
        Self {
            nameless: session::client(&known(&gold), true)
                .replace("enable_mtls: true", "enable_mtls: false"),
            greeting: greeting(machines, &known(&gold)),
            logins,
            crowd: Vec::new(),
            chance: ChaCha8Rng::seed_from_u64(5),
        }
    }

    /// Asks for a session, each way once.
    fn logs_in(&mut self, tries: &mut Tries) {
        for (what, login) in &self.logins {
            assert!(open(login).is_err(), "{what}");
            *tries.entry(what).or_default() += 1;
        }
        // It knows the team's authority, and shows nothing of its own.
        assert!(open_by(&self.nameless).is_err(), "no certificate");
        *tries.entry("no certificate").or_default() += 1;
    }

    /// Connects with no greeting, half of one, junk, or a whole one, which the world answers at some cost; and says nothing more.
    fn crowds(&mut self, tries: &mut Tries) {
        for number in 0..CROWD {
            let mut junk = [0; 300];
            self.chance.fill_bytes(&mut junk);
            let whole = &self.greeting[..];
            let (what, bytes) = match number % 4 {
                0 => ("says nothing", &whole[..0]),
                1 => ("half a greeting", &whole[..whole.len() / 2]),
                2 => ("junk", &junk[..]),
                _ => ("a greeting", whole),
            };
            let mut socket = TcpStream::connect(WORLD.trim_start_matches("tls/")).unwrap();
            // It may have been hung up on already.
            let _ = socket.write_all(bytes);
            socket.set_nonblocking(true).unwrap();
            *tries.entry(what).or_default() += 1;
            self.crowd.push(socket);
        }
    }

    /// One byte more from each who has not been hung up on.
    fn dawdles(&mut self, tries: &mut Tries) {
        for mut socket in &self.crowd {
            let said = socket.write_all(&[self.chance.random()]);
            *tries.entry("one byte at a time").or_default() += u32::from(said.is_ok());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Messages, each with its key.
type Heard = Vec<(String, Vec<u8>)>;

/// One with gold's keys, copied from its host, who says what is not gold's.
struct Insider {
    session: Session,
    keys: Keys,
    secret: Secret,
    heard: Arc<Mutex<Heard>>,
}

impl Insider {
    fn enter(machines: &Machines) -> Self {
        let own = machines.lab.path("keys");
        // The same as those that are over, but for their dates: these do count.
        let folder = machines.lab.path("holds");
        let folder = signed_by_the_team(&own, &folder, "robot-gold", holds());
        let keyring = keyring(&folder, &own, "robot-gold");
        let login = Login {
            endpoint: WORLD.to_owned(),
            user: "robot-gold".to_owned(),
            password: keyring.secret.clone(),
            keyring: Some(keyring.clone()),
        };
        let session = open(&login).unwrap();
        let worlds = session.liveliness().get(ALIVE_WORLDS).wait().unwrap();
        let world = worlds.recv().unwrap().into_result().unwrap();
        let keys = Keys::new(run_of_world(world.key_expr()).unwrap());
        let heard = Arc::new(Mutex::new(Heard::new()));
        for key in [
            keys.team_all(),
            keys.tick("gold"),
            keys.tick("blue"),
            keys.all(),
        ] {
            let heard = Arc::clone(&heard);
            session
                .declare_subscriber(key)
                .allowed_origin(Locality::Remote)
                .callback(move |sample| {
                    let mut heard = heard.lock().unwrap();
                    if heard.len() < HEARD {
                        let key = sample.key_expr().to_string();
                        heard.push((key, sample.payload().to_bytes().into_owned()));
                    }
                })
                .background()
                .wait()
                .unwrap();
        }
        let insider = Self {
            session,
            keys,
            secret: Secret::of(&keyring.secret),
            heard,
        };
        // It is really inside: it hears what gold may hear.
        wait_until("broadcasts", || {
            insider.heard.lock().unwrap().len() == HEARD
        });
        let heard = insider.heard.lock().unwrap();
        let tick = |robot| {
            heard
                .iter()
                .any(|(key, _)| *key == insider.keys.tick(robot))
        };
        assert!(!tick("blue"), "what is for blue alone");
        drop(heard);
        insider
    }

    fn tries(&self, tries: &mut Tries) {
        let mut tried = |what| *tries.entry(what).or_default() += 1;
        let keys = &self.keys;
        for (key, bytes) in self.heard.lock().unwrap().iter() {
            self.put(key, bytes.clone());
            tried("what was said before");
        }
        for robot in ["blue", "green"] {
            for key in [
                keys.report(robot),
                keys.team(robot, "heartbeat"),
                keys.tick(robot),
            ] {
                self.put(&key, self.secret.seal(&key, &7_u64).unwrap());
                tried("another's word under gold's seal");
            }
            // Of a robot that lives; as if it were there twice, or had gone.
            let alive = self.secret.stamp(&keys.alive(robot, 1));
            let token = self
                .session
                .liveliness()
                .declare_token(alive)
                .wait()
                .unwrap();
            token.undeclare().wait().unwrap();
            tried("another's life");
            assert_eq!(self.asks_to_be(robot), None);
            tried("to join as another");
        }
        let refused = self.asks_to_be("gold");
        assert!(
            matches!(
                refused,
                None | Some(JoinReply::Refused(Refusal::Taken { .. } | Refusal::Over))
            ),
            "{refused:?}"
        );
        tried("to join as gold, who lives");
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
            tried("what no robot says");
        }
    }

    fn put(&self, key: &str, bytes: Vec<u8>) {
        self.session.put(key, bytes).wait().unwrap();
    }

    fn asks_to_be(&self, robot: &str) -> Option<JoinReply> {
        let key = self.keys.join(robot);
        let nonce = random().unwrap();
        let request = JoinRequest {
            version: PROTOCOL_VERSION,
            robot: robot.to_owned(),
            pid: 1,
            nonce,
        };
        let request = self.secret.seal(&key, &request).unwrap();
        let replies = self
            .session
            .get(&key)
            .payload(request)
            .timeout(Duration::from_secs(1));
        let reply = replies.wait().unwrap().recv().ok()?.into_result().ok()?;
        let answer = self.keys.join_answer(robot, nonce);
        self.secret.open(&answer, &reply.payload().to_bytes()).ok()
    }

    fn leaves(self) {
        let _ = self.session.close().wait();
    }
}

/// The keys of a member in that folder, with its true secret. What is over is none that it would read by itself.
fn keyring(folder: &Path, own: &Path, identity: &str) -> Keyring {
    let read = |path: PathBuf| std::fs::read_to_string(path).unwrap();
    let file = |ending: &str| read(folder.join(format!("{identity}.{ending}")));
    let secret = read(own.join(format!("{identity}.secret")));
    Keyring {
        identity: identity.to_owned(),
        // That of the team: a stranger, too, wants to talk to this world.
        ca: read(own.join("ca.pem")),
        certificate: file("pem"),
        key: file("key"),
        secret: secret.trim().to_owned(),
    }
}

/// What zenoh says first to whoever is reached by TLS.
fn greeting(machines: &Machines, login: &Login) -> Vec<u8> {
    let at = SocketAddrV4::new(machines.hosts.address("h3"), 7447);
    machines.hosts.within("h3", || {
        let listener = TcpListener::bind(at).unwrap();
        let ear = std::thread::spawn(move || {
            let mut bytes = vec![0; 4096];
            let length = listener.accept().unwrap().0.read(&mut bytes).unwrap();
            bytes.truncate(length);
            bytes
        });
        let endpoint = format!("tls/{at}");
        assert!(
            open(&Login {
                endpoint,
                ..login.clone()
            })
            .is_err()
        );
        ear.join().unwrap()
    })
}

/// Tries once, without patience.
fn open(login: &Login) -> zenoh::Result<Session> {
    open_by(&session::client(login, true))
}

fn open_by(config: &str) -> zenoh::Result<Session> {
    zenoh::open(zenoh::Config::from_json5(config)?).wait()
}

/// What a hostile host costs: ticks per second of a run with and without it, in turns. The run has one core, as a host of its own has, and
/// the attackers have another.
///
/// `cargo test --release -p alliance-tests --test missions -- --ignored --nocapture what_a_hostile_host_costs`
#[test]
#[ignore = "a benchmark: it prints figures and asserts none"]
#[allow(clippy::disallowed_methods)] // The clock on the wall is what it is about.
fn what_a_hostile_host_costs() {
    const ROUNDS: usize = 9;
    let places: [(&str, &[&str]); 2] = [("h1", &["blue"]), ("h2", &["gold", "green"])];
    let Some(machines) = Machines::enter(3, &places) else {
        return;
    };
    // More than they bring away.
    machines.of_scenario(
        "name = 'long'\n[[waste.spills]]\nname = 'top'\nitems = 1000\ny_fraction = 0.667\n\
         [[waste.spills]]\nname = 'bottom'\nitems = 1000\ny_fraction = 0.333\n",
    );
    stay_on(0);
    let mut rates = [Vec::new(), Vec::new()];
    let mut tries = Tries::new();
    for round in 0..2 * ROUNDS {
        let is_attacked = round % 2 == 1;
        let daemon = machines.daemon("h2", "h2", &["gold", "green"]);
        let mut run = machines.up(&["--limit", "600", "--speed", "20x", "--stall-after", "60"]);
        run.wait_for("activated", &["gold"], 1);
        let rate = machines.hosts.within("h3", || {
            stay_on(1);
            let mut attackers = is_attacked.then(|| {
                // First: a crowd keeps newcomers out.
                let insider = Insider::enter(&machines);
                let mut stranger = Stranger::of(&machines);
                stranger.logs_in(&mut tries);
                stranger.crowds(&mut tries);
                (stranger, insider)
            });
            run.pace("max");
            let (from, began) = (run.now_ms(), Instant::now());
            while run.launcher.is_running() {
                match &mut attackers {
                    Some((stranger, insider)) => {
                        stranger.dawdles(&mut tries);
                        insider.tries(&mut tries);
                    }
                    None => std::thread::sleep(Duration::from_millis(10)),
                }
            }
            let ticks = (run.now_ms() - from) / 50;
            if let Some((_, insider)) = attackers {
                insider.leaves();
            }
            ticks as f64 / began.elapsed().as_secs_f64()
        });
        println!(
            "{}: {rate:.0} ticks/s",
            if is_attacked { "attacked" } else { "alone" }
        );
        rates[usize::from(is_attacked)].push(rate);
        run.end();
        daemon.wait().expect(0);
        for folder in ["run", "other", "over", "ahead", "holds"] {
            let _ = std::fs::remove_dir_all(machines.lab.path(folder));
        }
    }
    let [alone, attacked] = rates.map(|mut rates| {
        rates.sort_by(f64::total_cmp);
        rates[ROUNDS / 2]
    });
    println!("tries: {tries:?}");
    println!(
        "medians: {alone:.0} alone, {attacked:.0} attacked: {:.2}",
        attacked / alone
    );
}

/// This thread, and all that it starts, on one core.
fn stay_on(core: usize) {
    let mut cores = CpuSet::new();
    cores.set(core).unwrap();
    // Where there is one core, they share it.
    let _ = sched_setaffinity(Pid::from_raw(0), &cores);
}

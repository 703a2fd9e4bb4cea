//! Clients of a live run on this machine, and the processes that they attack.

use cluster::rendezvous::{ConnectionRole, Rendezvous};
use nix::sched::{CpuSet, sched_setaffinity};
use nix::unistd::Pid;
use proto::join::{JoinReply, JoinRequest};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use zenoh::{Session, Wait};

use crate::harness::{Lab, Process, children, command_line, wait_until};

/// The limit of resident memory in MiB. A process above it has kept hostile messages, which have ten times as many
/// bytes.
pub const MEMORY_MIB: f64 = 256.0;

/// Returns the announcement of the lab's only live run.
#[track_caller]
pub fn announced(lab: &Lab) -> Rendezvous {
    let folder = lab.path("runtime").join("alliance");
    let mut found = None;
    wait_until("the run's announcement", || {
        found = std::fs::read_dir(&folder).ok().and_then(|entries| {
            let mut paths = entries.flatten().map(|entry| entry.path());
            let path = paths.find(|path| path.extension().is_some_and(|end| end == "json"))?;
            serde_json::from_str(&std::fs::read_to_string(path).ok()?).ok()
        });
        found.is_some()
    });
    found.unwrap()
}

/// Opens a session with the run's own settings.
#[track_caller]
pub fn connect(run: &Rendezvous, role: ConnectionRole) -> Session {
    let config = cluster::session::client(&run.login(role).unwrap(), false);
    let config = zenoh::Config::from_json5(&config).unwrap();
    zenoh::open(config).wait().unwrap()
}

/// Sends a join request of blue or gold by hand, and returns the world's reply.
#[track_caller]
pub fn join(
    session: &Session,
    run: &Rendezvous,
    request: &JoinRequest,
    build: Option<&str>,
) -> JoinReply {
    let keys = KeyExpressions::new(&run.run);
    let secret = Secret::of_robot(&run.token, &request.robot);
    let key = keys.join(&request.robot);
    let query = session
        .get(&key)
        .payload(secret.seal(&key, request).unwrap());
    let build = build.map(|build| secret.seal(&key, &build).unwrap());
    let replies = query.attachment(build).wait().unwrap();
    let reply = replies.recv().unwrap().into_result().unwrap();
    let answer = keys.join_answer(&request.robot, request.nonce);
    secret.open(&answer, &reply.payload().to_bytes()).unwrap()
}

/// Returns the process id of a world's gateway.
#[track_caller]
pub fn gateway_of(world: &Process) -> u32 {
    let mut found = None;
    wait_until("a gateway", || {
        found = child_of(world.pid());
        found.is_some()
    });
    found.unwrap()
}

/// Returns the first live child of a process.
pub fn child_of(pid: u32) -> Option<u32> {
    let mut children = children(pid).into_iter();
    children.find(|child| command_line(*child).is_some())
}

/// Returns the peak resident memory of a live process, in MiB.
pub fn peak_memory(pid: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let mut lines = status.lines();
    let peak = lines.find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = peak.trim().trim_end_matches(" kB").parse().ok()?;
    Some(kib / 1024.0)
}

/// Binds this thread and its later children to one core.
pub fn stay_on(core: usize) {
    let mut cores = CpuSet::new();
    cores.set(core).unwrap();
    // On a machine with one core, run and attackers share it.
    let _ = sched_setaffinity(Pid::from_raw(0), &cores);
}

/// Returns the hash of a complete run without unscripted inputs.
#[track_caller]
pub fn hash(lab: &Lab, run: &str) -> String {
    let run = lab.json(&format!("{run}/run.json"));
    assert_eq!(run["outcome"], "complete");
    assert_eq!(run["unscripted"], false);
    run["hash"].as_str().unwrap().to_owned()
}

//! Clients of a live run on this machine, and the processes that they attack.

use cluster::rendezvous::{ConnectionRole, Rendezvous};
use proto::join::{JoinReply, JoinRequest};
use proto::keys::KeyExpressions;
use proto::secret::Secret;
use zenoh::{Session, Wait};

use crate::harness::{Lab, Process, command_line, wait_until};

/// The limit of resident memory in MiB. A process above it has kept hostile messages, which have ten times as many
/// bytes.
pub const MEMORY_MIB: u64 = 256;

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
        let mut children = world.children().into_iter();
        found = children.find(|child| command_line(*child).is_some());
        found.is_some()
    });
    found.unwrap()
}

/// Returns the peak resident memory of a live process, in MiB.
pub fn peak_memory(pid: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().trim_end_matches(" kB").parse::<u64>().unwrap() / 1024)
}

/// Returns the hash of a complete run without unscripted inputs.
#[track_caller]
pub fn hash(lab: &Lab, run: &str) -> String {
    let text = std::fs::read_to_string(lab.path(run).join("run.json")).unwrap();
    let run: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(run["outcome"], "complete");
    assert_eq!(run["unscripted"], false);
    run["hash"].as_str().unwrap().to_owned()
}

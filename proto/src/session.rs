//! Zenoh configuration of both ends of the star (ZENOH.md "Configuration"): every value that differs from zenoh's default,
//! and why.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsRawFd, OwnedFd};

use nix::sys::memfd::{MFdFlags, memfd_create};

use crate::keys::Keys;
use crate::panics;
use crate::rendezvous::{Rendezvous, User};

/// Value of `ZENOH_RUNTIME` for every process: one worker for everything.
/// Measured with 10 agents: 3,300 ticks/s against 1,730 with zenoh's own seven threads a process.
const RUNTIME: &str = "(rx:(handover:app),acc:(handover:app),tx:(handover:app),net:(handover:app),app:(worker_threads:1))";

/// What the processes tell without `RUST_LOG`. Of every connection by a socket zenoh says that it cannot be made, and makes it.
pub const LOG_FILTER: &str =
    "warn,zenoh_link_unixsock_stream=error,world_server=info,robot_agent=info";

/// What every process of a run does first thing in `main`, before it opens a session or starts a thread: sets zenoh's
/// runtime, and makes every panic that nobody catches end the process ([`panics`]).
pub fn prepare_process() {
    // SAFETY: no other thread exists yet that could read the environment at the same time.
    #[allow(unsafe_code)]
    unsafe {
        std::env::set_var("ZENOH_RUNTIME", RUNTIME);
    }
    panics::prepare();
}

/// Who may connect to a router of a run: whoever knows its password. Nobody else has a session, so that nobody else can fill
/// its queues or hold its liveliness tokens. On the bus zenoh sends a hash of the password and a number drawn by the router.
#[derive(Debug)]
pub struct Members(OwnedFd);

impl Members {
    /// Those who know the password of these users. Needed until the router's session is open.
    ///
    /// # Errors
    /// When the operating system has no file for the list: zenoh reads it from one, which nobody else sees and nothing leaves behind.
    pub fn of(run: &Rendezvous, user: User) -> io::Result<Self> {
        let list = memfd_create(c"alliance-members", MFdFlags::MFD_CLOEXEC)?;
        let mut file = File::from(list.try_clone()?);
        writeln!(file, "{}:{}", user.name(), user.password(run))?;
        Ok(Self(list))
    }

    fn path(&self) -> String {
        format!("/proc/self/fd/{}", self.0.as_raw_fd())
    }
}

/// What both ends share, with how they prove who they are.
/// - Nobody is searched for: default scouting costs 500 ms in every open, and leaves the machine. A router
///   waits those 500 ms even with scouting off, unless told not to.
/// - Simulated time is the only clock.
/// - A token that goes means a closed socket and nothing else: the lease is a day, so a process that is stopped for shorter keeps its token.
/// - A stopped receiver fills its queue, and whoever sends to it does not wait for it: no wait before a drop. Lockstep bounds
///   what is under way to a live one; its queue holds a tick's worth many times over (16 batches of 64 KiB).
/// - Ticks, reports and team messages all go with one priority, interactive-high, and so keep their order; what anybody else
///   puts on the bus has a queue of its own and waits behind them.
/// - No message is larger than 1 MiB: what claims to be is not buffered.
/// - Who connects and does not go on keeps nobody else out.
/// - Senders die here on purpose, and shared mappings of a dead sender leak.
fn common(auth: &str) -> String {
    format!(
        r"
  scouting: {{ delay: 0, multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }},
  timestamping: {{ enabled: false }},
  transport: {{
    unicast: {{ accept_pending: 10000 }},
    auth: {{ usrpwd: {{ {auth} }} }},
    link: {{
      tx: {{ lease: 86400000, queue: {{ size: {{ interactive_high: 16, data: 16 }}, congestion_control: {{ drop: {{ wait_before_drop: 0 }} }} }} }},
      rx: {{ max_message_size: 1048576 }},
    }},
    shared_memory: {{ enabled: false }},
  }},
"
    )
}

/// What the world passes on, it drops rather than waits with, whatever the sender asked for: a message for a stopped or slow
/// receiver that must not be dropped would hold the world's one worker for five seconds, and then cut the receiver off.
/// Answers go the way of their query.
const NEVER_WAIT: &str = r#"
  qos: { network: [{ messages: ["put", "delete", "query"], overwrite: { congestion_control: "drop" } }] },
"#;

/// What an operator may do; whatever is not allowed is denied, so that an expression with wildcards opens nothing. What goes out has
/// come from the team.
fn access(run: &str) -> String {
    let keys = Keys::new(run);
    let (all, control) = (keys.all(), keys.control());
    let hear = format!(
        r#"{{ id: "hear", permission: "allow", flows: ["ingress"], key_exprs: ["{all}"],
          messages: ["declare_subscriber", "declare_liveliness_subscriber", "liveliness_query"] }}"#
    );
    let order = format!(
        r#"{{ id: "order", permission: "allow", flows: ["ingress"], key_exprs: ["{control}"], messages: ["put", "query"] }}"#
    );
    let out = r#"{ id: "out", permission: "allow", flows: ["egress"], key_exprs: ["**"],
          messages: ["put", "query", "declare_queryable", "reply", "liveliness_token"] }"#;
    format!(
        r#"
  access_control: {{
    enabled: true, default_permission: "deny", rules: [{hear}, {order}, {out}],
    subjects: [{{ id: "anybody" }}], policies: [{{ rules: ["hear", "order", "out"], subjects: ["anybody"] }}],
  }},
"#
    )
}

/// Configuration (JSON5) of a router in the middle of a star, at which those users connect: the world is the team's, the gateway the
/// operators'.
#[must_use]
pub fn router(run: &Rendezvous, user: User, members: &Members) -> String {
    let common = common(&format!("dictionary_file: {:?}", members.path()));
    let access = match user {
        User::Team => String::new(),
        User::Operator => access(&run.run),
    };
    let endpoint = user.endpoint(run);
    format!(
        r#"{{
  mode: "router", listen: {{ endpoints: ["{endpoint}"] }}, connect: {{ endpoints: [] }},
  {NEVER_WAIT} {access} {common} }}"#
    )
}

/// Configuration (JSON5) of everybody else: a client of the router for these users.
#[must_use]
pub fn client(run: &Rendezvous, user: User) -> String {
    let (name, password, endpoint) = (user.name(), user.password(run), user.endpoint(run));
    let common = common(&format!("user: {name:?}, password: {password:?}"));
    format!(
        r#"{{
  mode: "client",
  listen: {{ endpoints: [] }},
  connect: {{
    endpoints: ["{endpoint}"], timeout_ms: 10000, exit_on_failure: true,
    retry: {{ period_init_ms: 20, period_max_ms: 200, period_increase_factor: 2 }},
  }}, {common} }}"#
    )
}

//! Zenoh configuration of both ends of the star (ZENOH.md "Configuration"): every value that differs from zenoh's default,
//! and why.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsRawFd, OwnedFd};

use base64::Engine;
use base64::prelude::BASE64_STANDARD as STANDARD;
use nix::sys::memfd::{MFdFlags, memfd_create};

use crate::keyring::Keyring;
use crate::member::Login;
use crate::panics;

/// Value of `ZENOH_RUNTIME` for every process: one worker for everything.
/// Measured with 10 agents: 3,300 ticks/s against 1,730 with zenoh's own seven threads a process.
const RUNTIME: &str = "(rx:(handover:app),acc:(handover:app),tx:(handover:app),net:(handover:app),app:(worker_threads:1))";

/// What the processes tell without `RUST_LOG`. Of every connection by a socket zenoh says that it cannot be made, and makes it; of every failed handshake
/// that files may be too few.
pub const LOG_FILTER: &str =
    "warn,zenoh_link_unixsock_stream=error,zenoh_link_tls=error,world_server=info,robot_agent=info";

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

/// Who may connect to a router of a run: whoever knows a password. Nobody else has a session, so that nobody else can fill
/// its queues or hold its liveliness tokens. On the bus zenoh sends a hash of the password and a number drawn by the router.
#[derive(Debug)]
pub struct Members(OwnedFd);

impl Members {
    /// Those users, each with the password. Needed until the router's session is open.
    ///
    /// # Errors
    /// When the operating system has no file for the list: zenoh reads it from one, which nobody else sees and nothing leaves behind.
    pub fn of<'a>(users: impl IntoIterator<Item = (&'a str, &'a str)>) -> io::Result<Self> {
        let list = memfd_create(c"alliance-members", MFdFlags::MFD_CLOEXEC)?;
        let mut file = File::from(list.try_clone()?);
        for (name, password) in users {
            writeln!(file, "{name}:{password}")?;
        }
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
fn common(auth: &str, keyring: Option<&Keyring>) -> String {
    let tls = keyring.map_or_else(String::new, tls);
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
      {tls}
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

/// Both ends of a link prove who they are, by what zenoh reads from no file. Names are checked against the locator that is connected to.
fn tls(keyring: &Keyring) -> String {
    let [ca, certificate, key] =
        [&keyring.ca, &keyring.certificate, &keyring.key].map(|text| STANDARD.encode(text));
    format!(
        r"tls: {{ root_ca_certificate_base64: {ca:?}, enable_mtls: true, verify_name_on_connect: true, close_link_on_expiration: false,
        listen_certificate_base64: {certificate:?}, listen_private_key_base64: {key:?},
        connect_certificate_base64: {certificate:?}, connect_private_key_base64: {key:?} }},"
    )
}

/// A router in the middle of a star.
#[derive(Debug)]
pub struct Router<'a> {
    /// Where it listens: zenoh locators.
    pub listen: &'a [String],
    /// The router that it is connected to for good: tried until it is there, and again whenever it is lost.
    pub uplink: Option<&'a Login>,
    /// Who may connect.
    pub members: &'a Members,
    /// Its certificates, where it listens or connects by TLS.
    pub keyring: Option<&'a Keyring>,
    /// What those may do: contents of `access_control`; empty: everything.
    pub access: String,
}

/// Configuration (JSON5) of a router.
#[must_use]
pub fn router(router: &Router<'_>) -> String {
    let path = router.members.path();
    let login = router.uplink.map_or_else(String::new, |uplink| {
        format!("user: {:?}, password: {:?},", uplink.user, uplink.password)
    });
    let auth = format!("{login} dictionary_file: {path:?}");
    let common = common(&auth, router.keyring);
    let connect = router.uplink.map_or_else(
        || "endpoints: []".to_owned(),
        |uplink| {
            format!(
                r#"endpoints: [{:?}], timeout_ms: -1, exit_on_failure: false,
    retry: {{ period_init_ms: 20, period_max_ms: 200, period_increase_factor: 2 }}"#,
                uplink.endpoint
            )
        },
    );
    let access = match router.access.as_str() {
        "" => String::new(),
        access => format!("access_control: {access},"),
    };
    let listen = router.listen;
    format!(
        r#"{{
  mode: "router", listen: {{ endpoints: {listen:?} }}, connect: {{ {connect} }},
  {NEVER_WAIT} {access} {common} }}"#
    )
}

/// Configuration (JSON5) of everybody else: a client of a router. It is tried for ten seconds, or once.
#[must_use]
pub fn client(login: &Login, once: bool) -> String {
    let Login {
        endpoint,
        user,
        password,
        keyring,
    } = login;
    let auth = format!("user: {user:?}, password: {password:?}");
    let common = common(&auth, keyring.as_ref());
    let timeout_ms = if once { 0 } else { 10_000 };
    format!(
        r#"{{
  mode: "client",
  listen: {{ endpoints: [] }},
  connect: {{
    endpoints: ["{endpoint}"], timeout_ms: {timeout_ms}, exit_on_failure: true,
    retry: {{ period_init_ms: 20, period_max_ms: 200, period_increase_factor: 2 }},
  }}, {common} }}"#
    )
}

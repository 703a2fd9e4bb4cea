//! The zenoh configuration of routers and clients: every value that differs from zenoh's default, with the reason.

use std::fs::File;
use std::io::{self, Write};
use std::os::fd::{AsRawFd, OwnedFd};

use base64::Engine;
use base64::prelude::BASE64_STANDARD as STANDARD;
use nix::sys::memfd::{MFdFlags, memfd_create};
use nix::sys::signal::{SigSet, Signal};

use crate::keyring::Keyring;
use crate::member::Login;
use terminal::panics;

/// The value of `ZENOH_RUNTIME` for every process: one worker thread for everything. A larger number of threads per
/// process makes runs slower.
const RUNTIME: &str = "(rx:(handover:app),acc:(handover:app),tx:(handover:app),net:(handover:app),app:(worker_threads:1))";

/// Prepares a process of a run. Call it first in `main`, before the process opens a session or starts a thread. It sets
/// zenoh's runtime and makes every uncaught panic end the process ([`panics`]). A write above the limit of file sizes
/// (`ulimit -f`) returns an error, as on a full disk, because its signal is blocked in all threads.
pub fn prepare_process() {
    // The call fails only for an invalid set.
    let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    // SAFETY: no other thread exists yet that could read the environment at the same time.
    #[allow(unsafe_code)]
    unsafe {
        std::env::set_var("ZENOH_RUNTIME", RUNTIME);
    }
    panics::install_hook();
}

/// The users that may connect to a router of a run, with their passwords. Other users get no session, so they can
/// neither fill the router's queues nor hold its liveliness tokens. Zenoh transmits a hash of the password and a random
/// number of the router.
#[derive(Debug)]
pub struct Members(OwnedFd);

impl Members {
    /// Creates the list of users and passwords, which must live until the router's session is open. Zenoh reads it from
    /// a file; an anonymous file is private and leaves nothing behind.
    pub fn new<'a>(users: impl IntoIterator<Item = (&'a str, &'a str)>) -> io::Result<Self> {
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

/// Returns the configuration that routers and clients share, including their authentication.
///
/// - Discovery is off: scouting takes 500 ms per session and sends packets to other machines. A router waits these 500
///   ms even with scouting off, so the delay is set to 0.
/// - Timestamps are off: simulated time is the only clock.
/// - The lease is one day, so a stopped process keeps its liveliness token. Only a closed socket removes a token.
/// - Senders do not wait before they drop messages for a full queue: a stopped receiver fills its queue and must not
///   block others. Lockstep bounds the messages in flight to a live receiver, and the queue (16 batches of 64 KiB) is
///   many times larger.
/// - Ticks, reports and broadcasts use the same priority, interactive-high, and so keep their order. Messages of other
///   programs use a separate queue with lower priority.
/// - Messages are at most 1 MiB. Larger announced messages are not buffered.
/// - Up to 10,000 connections can be pending, so an incomplete handshake does not block others. Up to 10,000 sessions can
///   be open; the default of 1,000 is too low for a team of 1,000 agents and their observers.
/// - Shared memory is off: senders are killed on purpose, and shared mappings of a dead sender leak.
fn common(auth: &str, keyring: Option<&Keyring>) -> String {
    let tls = keyring.map_or_else(String::new, tls);
    format!(
        r"
  scouting: {{ delay: 0, multicast: {{ enabled: false }}, gossip: {{ enabled: false }} }},
  timestamping: {{ enabled: false }},
  transport: {{
    unicast: {{ accept_pending: 10000, max_sessions: 10000 }},
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

/// The rule that the world drops forwarded messages instead of waiting, even if the sender requested reliable delivery.
/// A slow receiver would otherwise block the world's only worker for five seconds and then lose its connection. Replies
/// use the settings of their query.
const NEVER_WAIT: &str = r#"
  qos: { network: [{ messages: ["put", "delete", "query"], overwrite: { congestion_control: "drop" } }] },
"#;

/// Returns the TLS configuration: both sides authenticate, with inline certificates. The name in the certificate is
/// compared with the locator of the connection.
fn tls(keyring: &Keyring) -> String {
    let [ca, certificate, key] =
        [&keyring.ca, &keyring.certificate, &keyring.key].map(|text| STANDARD.encode(text));
    format!(
        r"tls: {{ root_ca_certificate_base64: {ca:?}, enable_mtls: true, verify_name_on_connect: true, close_link_on_expiration: false,
        listen_certificate_base64: {certificate:?}, listen_private_key_base64: {key:?},
        connect_certificate_base64: {certificate:?}, connect_private_key_base64: {key:?} }},"
    )
}

#[derive(Debug)]
pub struct Router<'a> {
    /// The zenoh locators that the router listens on.
    pub listen: &'a [String],
    /// The router that this router is connected to. The connection is retried until it succeeds, and again after every
    /// loss.
    pub uplink: Option<&'a Login>,
    pub members: &'a Members,
    /// The certificates of the router, if it uses TLS.
    pub keyring: Option<&'a Keyring>,
    /// The contents of `access_control`; empty to allow everything.
    pub access: String,
}

/// Returns the configuration (JSON5) of a router.
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

/// Returns the configuration (JSON5) of a client of a router. It tries to connect for ten seconds, or only once.
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

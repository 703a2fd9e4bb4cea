//! Zenoh configuration of both ends of the star (ZENOH.md "Configuration"): every value that differs from zenoh's default,
//! and why.

use crate::panics;

/// Value of `ZENOH_RUNTIME` for every process: one worker for everything.
/// Measured with 10 agents: 3,300 ticks/s against 1,730 with zenoh's own seven threads a process.
const RUNTIME: &str = "(rx:(handover:app),acc:(handover:app),tx:(handover:app),net:(handover:app),app:(worker_threads:1))";

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

/// What both ends share.
/// - Nobody is searched for: default scouting costs 500 ms in every open, and leaves the machine. A router
///   waits those 500 ms even with scouting off, unless told not to.
/// - Simulated time is the only clock.
/// - A token that goes means a closed socket and nothing else: the lease is ten minutes, so a stopped process keeps its token.
/// - A stopped receiver fills its queue, and whoever sends to it does not wait for it: no wait before a drop. Lockstep bounds
///   what is under way to a live one; its queue holds a tick's worth many times over (16 batches of 64 KiB).
/// - Ticks, reports and team messages all go with one priority, interactive-high, and so keep their order; what anybody else
///   puts on the bus has a queue of its own and waits behind them.
/// - No message is larger than 1 MiB: what claims to be is not buffered.
/// - Senders die here on purpose, and shared mappings of a dead sender leak.
const COMMON: &str = r"
  scouting: { delay: 0, multicast: { enabled: false }, gossip: { enabled: false } },
  timestamping: { enabled: false },
  transport: {
    link: {
      tx: { lease: 600000, queue: { size: { interactive_high: 16, data: 16 }, congestion_control: { drop: { wait_before_drop: 0 } } } },
      rx: { max_message_size: 1048576 },
    },
    shared_memory: { enabled: false },
  },
";

/// What the world passes on, it drops rather than waits with, whatever the sender asked for: a message for a stopped or slow
/// receiver that must not be dropped would hold the world's one worker for five seconds, and then cut the receiver off.
/// Answers go the way of their query.
const NEVER_WAIT: &str = r#"
  qos: { network: [{ messages: ["put", "delete", "query"], overwrite: { congestion_control: "drop" } }] },
"#;

/// Configuration (JSON5) of the world: the router in the middle of the star, listening on a locator such as
/// `tcp/127.0.0.1:7447`.
#[must_use]
pub fn world(endpoint: &str) -> String {
    format!(
        r#"{{
  mode: "router", listen: {{ endpoints: ["{endpoint}"] }}, connect: {{ endpoints: [] }},
  {NEVER_WAIT} {COMMON} }}"#
    )
}

/// Configuration (JSON5) of everybody else: a client of the world at that locator.
#[must_use]
pub fn client(endpoint: &str) -> String {
    format!(
        r#"{{
  mode: "client",
  listen: {{ endpoints: [] }},
  connect: {{
    endpoints: ["{endpoint}"], timeout_ms: 10000, exit_on_failure: true,
    retry: {{ period_init_ms: 20, period_max_ms: 200, period_increase_factor: 2 }},
  }}, {COMMON} }}"#
    )
}

//! Zenoh settings of both ends of the star, as (key, JSON5 value) pairs (ZENOH.md "Configuration"): every value that
//! differs from zenoh's default, and why.

/// Value of `ZENOH_RUNTIME` for every process, to be set before its first session is opened: one worker for everything.
/// Measured: 3,300 ticks/s against 1,730 with zenoh's own seven threads a process.
pub const RUNTIME: &str = "(rx:(handover:app),acc:(handover:app),tx:(handover:app),net:(handover:app),app:(worker_threads:1))";

/// Settings that both ends share.
fn common() -> Vec<(&'static str, String)> {
    [
        // Nobody is searched for: default scouting costs 500 ms in every open and leaves the machine.
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
        // Simulated time is the only clock.
        ("timestamping/enabled", "false"),
        // A token that goes shall mean a closed socket and nothing else: a stopped process keeps its lease for ten minutes.
        ("transport/link/tx/lease", "600000"),
        // A stopped receiver fills its queue; whoever sends to it shall not wait for it.
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "0"),
        // Senders die here on purpose, and mappings of a dead sender leak.
        ("transport/shared_memory/enabled", "false"),
    ]
    .map(|(key, value)| (key, value.to_owned()))
    .to_vec()
}

/// The world: the router in the middle of the star. `endpoint` is a zenoh locator such as `tcp/127.0.0.1:0`.
#[must_use]
pub fn world(endpoint: &str) -> Vec<(&'static str, String)> {
    let mut settings = common();
    settings.push(("mode", "\"router\"".to_owned()));
    settings.push(("listen/endpoints", format!("[\"{endpoint}\"]")));
    settings.push(("connect/endpoints", "[]".to_owned()));
    settings
}

/// Everybody else: a client of the world.
#[must_use]
pub fn client(endpoint: &str) -> Vec<(&'static str, String)> {
    let mut settings = common();
    settings.push(("mode", "\"client\"".to_owned()));
    settings.push(("connect/endpoints", format!("[\"{endpoint}\"]")));
    settings.push(("connect/timeout_ms", "10000".to_owned()));
    settings.push(("connect/exit_on_failure", "true".to_owned()));
    settings.push((
        "connect/retry",
        "{period_init_ms: 20, period_max_ms: 200, period_increase_factor: 2}".to_owned(),
    ));
    settings.push(("listen/endpoints", "[]".to_owned()));
    settings
}

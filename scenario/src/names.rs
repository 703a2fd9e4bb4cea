//! Names of robots, runs, hosts and tasks.

/// The word for all robots in faults.
pub const ALL: &str = "all";
/// The word for any robot in the trigger of a fault.
pub const ANY: &str = "any";
/// The word for an idle robot in faults.
pub const IDLE: &str = "idle";
/// The world: its log file, its rows in ticks.csv, its frame in exports and its identity in certificates.
pub const WORLD: &str = "world";
/// The process of the page: its log file.
pub const PAGE: &str = "page";
/// The host of the launcher that started the world; no other host can have the name.
pub const LAUNCHER: &str = "launcher";

/// The names that no robot can have, each with its meaning. Logs and faults would confuse a robot with it.
pub const RESERVED: [(&str, &str); 5] = [
    (ALL, "every robot"),
    (ANY, "every robot"),
    (IDLE, "an idle robot"),
    (WORLD, "the world"),
    (PAGE, "the page"),
];

/// Returns whether a name is valid in key expressions, file names and CSV columns: letters, digits, `-` and `_`, at
/// most 32, starting with a letter or digit.
#[must_use]
pub fn is_name(name: &str) -> bool {
    name.len() <= 32
        && name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '-' || c == '_')
}

//! Identities of the world, the robots and the hosts: user names on the bus and names in certificates.

/// The identity of the world: the first name in its certificate, and the stem of its file names.
pub const WORLD: &str = scenario::names::WORLD;

#[must_use]
pub fn robot(name: &str) -> String {
    format!("robot-{name}")
}

#[must_use]
pub fn host(name: &str) -> String {
    format!("host-{name}")
}

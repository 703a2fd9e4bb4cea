//! Tests that need a program which is not everywhere.

use std::io::Write;

/// With this variable set to 1, what cannot be tried here is left out; else it fails. `.cargo/config.toml` sets it for those who have Rust
/// alone, and `.ci/run` to 0, for nobody shall take for tried what was not.
pub const SKIP: &str = "ALLIANCE_SKIP_TESTS";

/// Fails, or says that a test is skipped; `how` tells what is missing and how to get it.
#[track_caller]
pub fn cannot_run(how: &str) {
    let may_skip = std::env::var_os(SKIP).is_some_and(|value| value == "1");
    assert!(
        may_skip,
        "{how}; or set {SKIP}=1 to leave out what cannot be tried here"
    );
    // Not by a macro, whose output a test that passes keeps to itself.
    let _ = writeln!(std::io::stderr(), "skipped: {how}");
}

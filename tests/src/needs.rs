//! Tests that need programs that may not be installed.

use std::io::Write;

/// With this variable set to 1, tests without their programs are skipped. Otherwise they fail. `.cargo/config.toml`
/// sets it to 1 for local runs, and the complete test script sets it to 0.
pub const SKIP: &str = "ALLIANCE_SKIP_TESTS";

/// Fails, or prints that a test is skipped. `how` states the missing program and how to install it.
#[track_caller]
pub fn cannot_run(how: &str) {
    let may_skip = std::env::var_os(SKIP).is_some_and(|value| value == "1");
    assert!(
        may_skip,
        "{how}; or set {SKIP}=1 to skip the tests that cannot run here"
    );
    // The test harness captures the output of `eprintln!` in a passing test.
    let _ = writeln!(std::io::stderr(), "skipped: {how}");
}

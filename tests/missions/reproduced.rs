//! The page docs/REPRODUCED.md: a cheap part of its figures, measured again, and the page from the stored figures.

use std::io::Write;
use std::process::Command;

use alliance_tests::harness::alliance;
use alliance_tests::python::python;
use alliance_tests::testkit::in_repository;

/// The line of a section without its data, which are not in the repository, or without a package.
const SKIPPED: &str = "skipped: ";

#[test]
fn results_of_others_are_as_on_the_page() {
    let Some(python) = python(&["scipy", "pyvrp"]) else {
        return;
    };
    let check = Command::new(python)
        .arg(in_repository("tests/python/reproduced"))
        .arg("--check")
        .arg("--program")
        .arg(alliance())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&check.stderr);
    assert!(check.status.success(), "{printed}");
    for line in printed.lines().filter(|line| line.starts_with(SKIPPED)) {
        // The test harness captures the output of `eprintln!` in a passing test.
        let _ = writeln!(std::io::stderr(), "{line}");
    }
}

//! The page docs/REPRODUCED.md: a cheap part of its figures, measured again, and the page from the stored figures. The
//! tables of the study of imperfect radio, from its stored results.

use std::io::Write;
use std::process::Command;

use alliance_tests::harness::{Lab, alliance};
use alliance_tests::python::{python, run};
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

#[test]
fn the_tables_of_the_radio_study_are_those_of_its_results() {
    let lab = Lab::new();
    let Some(python) = python(&["csv"]) else {
        return;
    };
    run(&lab, &python, "radio_tables.py", &["--check"]);
}

//! Python programs as external users write them.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::harness::{Lab, alliance};
use crate::needs::cannot_run;

/// Returns a Python with these modules: one in a `python` folder next to the programs under test, or that of the
/// system. Returns `None` without one, if the test may be skipped.
pub fn python(modules: &[&str]) -> Option<PathBuf> {
    let program = alliance();
    let made = program
        .ancestors()
        .map(|folder| folder.join("python/bin/python3"));
    let import = format!("import {}", modules.join(", "));
    let found = made
        .filter(|python| python.is_file())
        .chain([PathBuf::from("python3")])
        .find(|python| {
            let tried = Command::new(python).args(["-c", &import]).output();
            tried.is_ok_and(|tried| tried.status.success())
        });
    if found.is_none() {
        let how = format!(
            "no Python with {}: run `.ci/run`, or `pip install -r tests/python/requirements.txt`",
            modules.join(", ")
        );
        cannot_run(&how);
    }
    found
}

/// Runs a script of tests/python in the lab and returns its output.
#[track_caller]
pub fn run(lab: &Lab, python: &Path, script: &str, arguments: &[&str]) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    let output = Command::new(python)
        .arg(folder.join(script))
        .args(arguments)
        .current_dir(lab.path(""))
        .env("XDG_RUNTIME_DIR", lab.path("runtime"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{script}: {stderr}");
    String::from_utf8(output.stdout).unwrap()
}

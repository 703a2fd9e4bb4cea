//! Processes that observe a live run for other tools, and their clients in Python.

use std::path::Path;

use nix::sys::signal::{Signal, kill};
use serde_json::Value;

use crate::harness::{Lab, alliance};
use crate::python::run;
use crate::testkit::DEFAULT_HASH;

/// Runs a script with these words, which starts a run with the folder `out`. Returns its facts.
#[track_caller]
pub fn facts(
    lab: &Lab,
    python: &Path,
    script: &str,
    words: &[&str],
    (out, arguments): (&str, &str),
) -> Value {
    let program = alliance();
    let program = program.to_str().unwrap();
    let words = words.iter().copied().chain([program, out, "--no-page"]);
    let words: Vec<&str> = words.chain(arguments.split_whitespace()).collect();
    serde_json::from_str(&run(lab, python, script, &words)).unwrap()
}

/// Starts the default mission in the folder `run`, kills the process whose id follows `shown`, and checks that the run does not
/// change.
#[track_caller]
pub fn assert_observer_can_die(lab: &Lab, arguments: &str, shown: &str, title: &str) {
    let mut launcher = lab.start(arguments);
    kill(launcher.shown_pid(shown), Signal::SIGKILL).unwrap();
    let ended = format!("the process for {title} was killed by SIGKILL; the run continues");
    launcher.wait_for_stderr(&ended);
    launcher.wait().expect(0);
    assert_eq!(lab.log("run").run.hash.as_deref(), Some(DEFAULT_HASH));
}

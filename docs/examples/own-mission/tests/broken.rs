//! Missions and allocators that fail: one line names the failed part, and the log up to the failure stays readable.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs the program with a controller, a world or an allocator that fails after three seconds.
fn broken(how: &str, arguments: &[&str]) -> (Option<i32>, String, PathBuf) {
    let folder =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("broken-{how}-{}", arguments.len()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("visit.toml"), include_str!("../visit.toml")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_broken"));
    command
        .env("BREAKS", how)
        .current_dir(&folder)
        .env("XDG_RUNTIME_DIR", &folder)
        .env_remove("RUST_BACKTRACE");
    let run = command.args(arguments).output().unwrap();
    let stderr = String::from_utf8_lossy(&run.stderr).into_owned();
    (run.status.code(), stderr, folder)
}

#[test]
fn in_one_process_one_line_names_the_failed_part_and_the_log_stays_readable() {
    for (how, names) in [
        (
            "world",
            "panicked at docs/examples/own-mission/src/bin/broken.rs",
        ),
        (
            "controller",
            "panicked at docs/examples/own-mission/src/bin/broken.rs",
        ),
        (
            "nan",
            "the mission's controller returned an invalid speed: NaN m/s",
        ),
        ("allocator", "the allocator gives task 0 the utility NaN"),
    ] {
        let arguments = ["run", "--in-process", "--out", "run", "visit.toml"];
        let (status, stderr, folder) = broken(how, &arguments);
        assert_eq!(status, Some(101), "{how}: {stderr}");
        let panics: Vec<&str> = stderr
            .lines()
            .filter(|line| line.contains("panicked"))
            .collect();
        let [line] = panics[..] else {
            panic!("{how}: {stderr}")
        };
        assert!(
            line.starts_with("alliance run (mission visit, allocator ") && line.contains(names),
            "{how}: {line}"
        );
        let (status, stderr, _) = (command_in(&folder, &["report", "run"]), stderr, ());
        assert_eq!(status, Some(0), "{how}: the log must be readable: {stderr}");
    }
}

#[test]
fn with_processes_the_agent_or_the_run_ends_and_one_line_names_the_failed_part() {
    let arguments = [
        "run",
        "--no-page",
        "--out",
        "run",
        "--limit",
        "20",
        "visit.toml",
    ];
    let (_, stderr, folder) = broken("controller", &arguments);
    assert!(stderr.contains("robot-agent blue (mission visit, allocator alliance): panicked at docs/examples/own-mission/src/bin/broken.rs"), "{stderr}");
    let events = fs::read_to_string(folder.join("run/events.csv")).unwrap();
    assert!(events.contains(",gone,blue,"), "{events}");
    let (status, stderr, folder) = broken("world", &arguments);
    assert!(
        status.is_some_and(|status| status > 1),
        "{status:?}: {stderr}"
    );
    assert!(
        stderr.contains(
            "world (mission visit): panicked at docs/examples/own-mission/src/bin/broken.rs"
        ),
        "{stderr}"
    );
    assert_eq!(command_in(&folder, &["report", "run"]), Some(0));
}

#[test]
fn a_sweep_records_the_failure_as_a_failed_run() {
    let (_, _, folder) = broken("none", &["list", "missions"]);
    fs::write(
        folder.join("plan.toml"),
        "scenario = \"visit.toml\"\nseeds = 2\n",
    )
    .unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_broken"));
    command
        .env("BREAKS", "controller")
        .current_dir(&folder)
        .env("XDG_RUNTIME_DIR", &folder);
    let run = command
        .args(["sweep", "plan.toml", "--out", "swept"])
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&run.stderr);
    let results = fs::read_to_string(folder.join("swept/failures.csv"))
        .or_else(|_| fs::read_to_string(folder.join("swept/results.csv")));
    let results = results.unwrap_or_else(|error| panic!("{error}: {stderr}"));
    assert!(
        stderr.contains("panicked at docs/examples/own-mission/src/bin/broken.rs")
            || results.contains("panicked at"),
        "{stderr}\n{results}"
    );
}

fn command_in(folder: &Path, arguments: &[&str]) -> Option<i32> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_broken"));
    command
        .env("BREAKS", "none")
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder);
    command.args(arguments).output().unwrap().status.code()
}

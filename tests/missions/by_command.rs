//! `alliance run` from start to end: its processes, its output, its run folder and its exit.

use std::collections::BTreeSet;

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::team::Team;
use alliance_tests::testkit::{ROBOTS, files};
use missions::waste::data::WasteRow;
use nix::sys::signal::Signal;
use proto::tick::Outcome;
use run_log::{EventRow, MessageRow, MotivationRow, PoseRow, RunLog, RunOutcome, TickRow};
use scenario::testkit::entry;
use serde_json::{Value, json};

/// Checks that the launcher has four child processes, with their part in the command line.
#[track_caller]
fn assert_world_and_one_agent_per_robot(team: &Team<'_>) -> [u32; 4] {
    let names = ["world", "blue", "gold", "green"];
    let pids = names.map(|name| team.pid(name));
    let children: BTreeSet<u32> = team.launcher().children().into_iter().collect();
    assert_eq!(children, BTreeSet::from(pids));
    for (name, pid) in names.iter().zip(pids) {
        let part = match *name {
            "world" => " world ".to_owned(),
            robot => format!(" agent --robot {robot} "),
        };
        // A process has no command line immediately after its start.
        wait_until(name, || {
            command_line(pid).is_some_and(|command| command.contains(&part))
        });
    }
    pids
}

/// Checks that every table is readable and complete up to the last tick.
#[track_caller]
fn assert_readable(log: &RunLog) {
    log.rows::<MotivationRow>().unwrap();
    log.rows::<MessageRow>().unwrap();
    log.rows::<EventRow>().unwrap();
    log.rows::<PoseRow>().unwrap();
    log.rows::<WasteRow>().unwrap();
    log.inputs().unwrap();
    let last = log.rows::<TickRow>().unwrap().pop().unwrap();
    assert_eq!(last.tick + 1, log.run.result.ticks);
    assert_eq!(Some(format!("{:016x}", last.hash)), log.run.hash);
}

#[test]
fn a_run_shows_its_processes_its_progress_and_a_summary() {
    let lab = Lab::new();
    // The time limit passes before the mission is complete.
    let finished = lab.mission("run", "--seed 7 --limit 20 --speed 10x");
    let finished = finished.expect(1);
    let stderr = &finished.stderr;
    let line = |part: &str| {
        let found = stderr.lines().find(|line| line.contains(part));
        found.unwrap_or_else(|| panic!("no '{part}' in:\n{stderr}"))
    };
    for (label, part) in [
        ("process ids: ", "world "),
        ("process ids: ", ", blue "),
        ("process ids: ", ", gold "),
        ("process ids: ", ", green "),
        (" delivered; ", " s simulated"),
        (" delivered; ", ", 0 of 24 items delivered; "),
        // Without a terminal the table has a default width, so that column names can take two lines.
        ("activations", ""),
        ("delivered", ""),
        ("messages", ""),
        ("time-limit: 0 of 24 items delivered, reports made 0", ""),
    ] {
        assert!(line(label).contains(part), "no '{part}' in:\n{stderr}");
    }
    assert_eq!(line("folder"), "folder  run");
    assert_eq!(line("seed"), "seed    7");
    let log = lab.log("run");
    assert_readable(&log);
    let hash = log.run.hash.unwrap();
    assert_eq!(line("hash"), format!("hash    {hash}"));
    assert_eq!(finished.stdout, "", "texts for people go to stderr");

    // The run folder has the documented files, headers and keys.
    let mut listing = String::new();
    for (name, bytes) in files(&lab.path("run")) {
        if name.ends_with(".csv") {
            let text = String::from_utf8(bytes).unwrap();
            let mut lines = text.lines();
            listing += &entry(&name, lines.next().unwrap());
            assert!(lines.next().is_some(), "{name} has no row");
        } else {
            listing += &format!("{name}\n\n");
        }
    }
    let run = lab.json("run/run.json");
    for (rank, robot) in ROBOTS.into_iter().enumerate() {
        assert_eq!(run["alliance"]["robots"][robot]["rank"], rank);
    }
    let keys: Vec<&String> = run.as_object().unwrap().keys().collect();
    listing += &format!("run.json: {keys:?}\n");
    add_keys(&mut listing, "alliance", &run["alliance"]);
    insta::assert_snapshot!(listing);
}

/// Adds a line with the keys of each table in a value.
fn add_keys(listing: &mut String, path: &str, value: &Value) {
    let Some(table) = value.as_object() else {
        return;
    };
    let keys: Vec<&String> = table.keys().collect();
    *listing += &format!("{path}: {keys:?}\n");
    for (key, inner) in table {
        add_keys(listing, &format!("{path}.{key}"), inner);
    }
}

#[test]
fn every_process_is_a_child_and_the_result_is_on_stdout_as_json() {
    let lab = Lab::new();
    // The run is paused until all processes have been checked.
    let team = Team::start(&lab, "--seed 7 --limit 20 --paused --speed max");
    let pids = assert_world_and_one_agent_per_robot(&team);
    wait_until("a live run", || lab.run("status").status.success());
    lab.run("clock resume").expect(0);
    let result = team.wait().expect(1).json();
    let is_over = |pid: &u32| command_line(*pid).is_none();
    assert!(pids.iter().all(is_over), "no process outlives its run");
    let run = lab.log("run").run;
    let [world, blue, gold, green] = pids;
    for (key, expected) in [
        ("/outcome", json!("time-limit")),
        ("/seed", json!(7)),
        ("/folder", json!("run")),
        ("/unscripted", json!(false)),
        ("/hash", json!(run.hash)),
        ("/result", serde_json::to_value(run.result).unwrap()),
        ("/host/pids/world", json!(world)),
        (
            "/host/pids/robots",
            json!({"blue": blue, "gold": gold, "green": green}),
        ),
    ] {
        assert_eq!(result.pointer(key), Some(&expected), "{key}");
    }
}

#[test]
fn without_an_out_folder_a_run_creates_one_below_runs() {
    let lab = Lab::new();
    for number in 1..=2 {
        lab.run("run --seed 3 --limit 1").expect(1);
        let names = lab.names("runs");
        assert_eq!(names.len(), number + 1, "{names:?}");
        assert_eq!(names[0], "latest");
        let has_prefix = |name: &String| name.starts_with("waste-cleanup-seed3-");
        assert!(names[1..].iter().all(has_prefix), "{names:?}");
        assert_eq!(lab.log("runs/latest").run.setup.seed, 3);
    }
}

#[test]
fn an_interrupt_ends_every_process_and_leaves_a_readable_log() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let lab = Lab::new();
        let mut team = Team::start(&lab, "--speed 20x");
        team.wait_for_row("events.csv", &[",activated,"]);
        let pids = assert_world_and_one_agent_per_robot(&team);
        team.launcher().signal(signal);
        let finished = team.wait().expect(130);
        assert!(pids.iter().all(|pid| command_line(*pid).is_none()));
        let stderr = &finished.stderr;
        assert!(!stderr.contains("had to be killed"), "{stderr}");
        assert_eq!(finished.json()["outcome"], "interrupted");
        let log = lab.log("run");
        assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::Interrupted));
        assert!(!log.run.unscripted);
        assert_readable(&log);
    }
}

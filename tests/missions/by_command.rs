//! `alliance run` from start to end: its processes, its output and its exit.

use std::collections::BTreeSet;

use alliance_tests::harness::{Lab, command_line, wait_until};
use alliance_tests::team::Team;
use missions::waste::data::WasteRow;
use nix::sys::signal::Signal;
use proto::tick::Outcome;
use run_log::{EventRow, MessageRow, MotivationRow, PoseRow, RunLog, RunOutcome, TickRow};
use serde_json::Value;

/// Checks that the launcher has four child processes, with their part in the command line.
#[track_caller]
fn assert_world_and_one_agent_per_robot(team: &Team<'_>) -> Vec<u32> {
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
    pids.to_vec()
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
    let arguments = ["--seed", "7", "--limit", "20", "--speed", "10x"];
    // The time limit passes before the mission is complete.
    let finished = lab.mission("run", &arguments).expect(1);
    let stderr = &finished.stderr;
    let line = |part: &str| {
        let found = stderr.lines().find(|line| line.contains(part));
        found.unwrap_or_else(|| panic!("no '{part}' in:\n{stderr}"))
    };
    for part in ["world ", ", blue ", ", gold ", ", green "] {
        assert!(
            line("process ids: ").contains(part),
            "no '{part}' in:\n{stderr}"
        );
    }
    for part in [" s simulated", ", 0 of 24 items delivered; "] {
        assert!(
            line(" delivered; ").contains(part),
            "no '{part}' in:\n{stderr}"
        );
    }
    // Without a terminal the table has a default width, so that column names can take two lines.
    for column in ["activations", "delivered", "messages"] {
        line(column);
    }
    line("time-limit: 0 of 24 items delivered, reports made 0");
    assert_eq!(line("folder"), "folder  run");
    assert_eq!(line("seed"), "seed    7");
    let log = lab.log("run");
    assert_readable(&log);
    let hash = log.run.hash.unwrap();
    assert_eq!(line("hash"), format!("hash    {hash}"));
    assert_eq!(finished.stdout, "", "texts for people go to stderr");
}

#[test]
fn every_process_is_a_child_and_the_result_is_on_stdout_as_json() {
    let lab = Lab::new();
    // The run is paused until all processes have been checked.
    let team = Team::start(
        &lab,
        &["--seed", "7", "--limit", "20", "--paused", "--speed", "max"],
    );
    let pids = assert_world_and_one_agent_per_robot(&team);
    wait_until("a live run", || lab.run(&["status"]).status.success());
    lab.run(&["clock", "resume"]).expect(0);
    let finished = team.wait().expect(1);
    assert!(
        pids.iter().all(|pid| command_line(*pid).is_none()),
        "no process outlives its run"
    );
    let result = finished.json();
    assert_eq!(result["outcome"], "time-limit");
    assert_eq!(result["seed"], 7);
    assert_eq!(result["folder"], "run");
    assert_eq!(result["unscripted"], false);
    let run = lab.log("run").run;
    assert_eq!(result["hash"], Value::from(run.hash));
    assert_eq!(result["result"], serde_json::to_value(run.result).unwrap());
    let host = &result["host"]["pids"];
    let robots = &host["robots"];
    assert_eq!(
        [
            &host["world"],
            &robots["blue"],
            &robots["gold"],
            &robots["green"]
        ]
        .map(Value::as_u64),
        [0, 1, 2, 3].map(|index: usize| Some(u64::from(pids[index])))
    );
}

#[test]
fn without_an_out_folder_a_run_creates_one_below_runs() {
    let lab = Lab::new();
    for number in 1..=2 {
        lab.run(&["run", "--seed", "3", "--limit", "1"]).expect(1);
        let entries = std::fs::read_dir(lab.path("runs")).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names.len(), number + 1, "{names:?}");
        assert_eq!(names[0], "latest");
        assert!(
            names[1..]
                .iter()
                .all(|name| name.starts_with("waste-cleanup-seed3-"))
        );
        assert_eq!(lab.log("runs/latest").run.setup.seed, 3);
    }
}

#[test]
fn an_interrupt_ends_every_process_and_leaves_a_readable_log() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let lab = Lab::new();
        let mut team = Team::start(&lab, &["--speed", "20x"]);
        team.wait_for_row("events.csv", &[",activated,"]);
        let pids = assert_world_and_one_agent_per_robot(&team);
        team.launcher().signal(signal);
        let finished = team.wait().expect(130);
        assert!(pids.iter().all(|pid| command_line(*pid).is_none()));
        assert!(
            !finished.stderr.contains("had to be killed"),
            "{}",
            finished.stderr
        );
        assert_eq!(finished.json()["outcome"], "interrupted");
        let log = lab.log("run");
        assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::Interrupted));
        assert!(!log.run.unscripted);
        assert_readable(&log);
    }
}

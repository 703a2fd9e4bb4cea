//! Processes that end unexpectedly, and the state of the run afterwards.

use std::process::Command;

use alliance_tests::harness::{Lab, alliance, command_line, wait_until};
use alliance_tests::team::Team;
use alliance_tests::testkit::{ROBOTS, assert_whole_up_to_a_tick};
use nix::sys::signal::Signal;
use proto::tick::Outcome;
use run_log::RunOutcome;

#[test]
fn when_the_world_is_killed_the_agents_end_and_the_launcher_reports_it() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 20x");
    team.wait_for_row("poses.csv", &["7000,"]);
    let agents = ROBOTS.map(|robot| team.pid(robot));
    team.signal("world", Signal::SIGKILL);
    let finished = team.wait().expect(3);
    finished.shows("the world was killed by SIGKILL");
    let stderr = &finished.stderr;
    let is_killed = stderr.contains("had to be killed");
    assert!(!is_killed, "the agents must end by themselves: {stderr}");
    assert!(agents.iter().all(|pid| command_line(*pid).is_none()));
    assert_whole_up_to_a_tick(&lab.log("run"));
    assert_changes_are_found(&lab);
}

/// The tick that has not ended is not in the log, and its orders and hits are not in run.json.
#[test]
fn a_run_that_ends_within_a_tick_is_repeated() {
    let bias = r#"{ robot = "blue", device = "position", mode.bias = { m = 0.5 } }"#;
    for is_paused in [false, true] {
        let lab = Lab::new();
        let timeline = format!("faults.timeline = [{{ fault.sensor = {bias} }}]");
        lab.write("bias.toml", timeline);
        let mut team = Team::start(&lab, "bias.toml --speed 5x");
        team.wait_for_row("poses.csv", &["1000,"]);
        if is_paused {
            lab.run("clock pause").expect(0);
            lab.run("fault kill gold").expect(0);
        }
        team.launcher().signal(Signal::SIGTERM);
        team.wait().expect(130);
        lab.assert_repeated("run");
    }
}

/// A write above the limit of file sizes fails as on a full disk, in place of a signal that ends the process.
#[test]
fn a_log_above_the_limit_of_file_sizes_ends_the_run_with_one_line() {
    for mode in ["--in-process", "--no-page"] {
        let lab = Lab::new();
        std::fs::create_dir(lab.path("runtime")).unwrap();
        let script = "ulimit -f 128; exec \"$0\" run --out run \"$1\"";
        let output = Command::new("sh")
            .args(["-c", script])
            .arg(alliance())
            .arg(mode)
            .current_dir(lab.path(""))
            .env("XDG_RUNTIME_DIR", lab.path("runtime"))
            .output()
            .unwrap();
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{mode}: {stderr}");
        let lines = stderr.lines().filter(|line| line.contains("cannot write"));
        let lines: Vec<&str> = lines.collect();
        let is_one = matches!(lines[..], [line] if line.contains("File too large"));
        assert!(is_one, "{mode}: {stderr}");
        assert_whole_up_to_a_tick(&lab.log("run"));
        lab.assert_repeated("run");
    }
}

/// Ticks can take seconds, so a run must look for signals in each of them.
#[test]
fn a_run_in_one_process_ends_in_the_tick_of_a_signal() {
    let lab = Lab::new();
    let ticks = ["a", "b", "c"].map(|out| {
        let run = format!("run --robots 300 --in-process --no-page --log summary --out {out}");
        let mut run = lab.start(run.as_str());
        run.wait_for_stderr("in one process");
        run.signal(Signal::SIGTERM);
        run.wait().expect(130);
        let result = lab.json(&format!("{out}/run.json"));
        result["result"]["ticks"].as_u64().unwrap()
    });
    assert!(ticks.iter().any(|ticks| ticks % 64 != 0), "{ticks:?}");
}

/// Checks that the log of a killed world replays, and that a change of any kind is a difference.
#[track_caller]
fn assert_changes_are_found(lab: &Lab) {
    lab.assert_repeated("run");
    let differs = |file: &str, changed: String| {
        let path = lab.path("run").join(file);
        let before = std::fs::read(&path).ok();
        std::fs::write(&path, changed).unwrap();
        let found = lab.run(["replay", "run"]).expect(1);
        assert!(found.answer().contains(file), "{file}: {}", found.stderr);
        match before {
            Some(before) => std::fs::write(&path, before).unwrap(),
            None => std::fs::remove_file(&path).unwrap(),
        }
    };
    let with = |key: &str, value: serde_json::Value| {
        let mut run = lab.json("run/run.json");
        run[key] = value;
        run.to_string()
    };
    differs("run.json", with("unscripted", true.into()));
    let origin = serde_json::json!({"run": "other", "hash": "0", "tick": 3, "t_ms": 1});
    differs("run.json", with("branch", origin));
    let poses = lab.text("run/poses.csv");
    let rows = poses.split_inclusive('\n').enumerate();
    let without_one = rows.filter(|(row, _)| *row != 20).map(|(_, row)| row);
    differs("poses.csv", without_one.collect());
    let invented =
        "from_ms,robot,behavior_set,utility,holder,state\n0,blue,find-locations,1,,active\n";
    differs("allocation.csv", invented.to_owned());
    lab.assert_repeated("run");
}

#[test]
fn when_the_launcher_is_killed_all_processes_end_including_a_stopped_agent() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 20x");
    team.wait_for_row("events.csv", &[",activated,"]);
    team.signal("gold", Signal::SIGSTOP);
    team.wait_for_row("events.csv", &[",stalled,gold,"]);
    let children = team.launcher().children();
    assert_eq!(children.len(), 4);
    team.launcher().signal(Signal::SIGKILL);
    wait_until("the end of every process", || {
        children.iter().all(|pid| command_line(*pid).is_none())
    });
    let log = lab.log("run");
    assert!(log.last.is_some());
    // The world had time to complete its log.
    assert_eq!(log.run.outcome, RunOutcome::Ended(Outcome::Interrupted));
}

#[test]
fn an_agent_that_panics_is_reported_as_a_crash_with_its_message_and_the_team_continues() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, "--speed 60x --limit 10000");
    team.wait_for_row("events.csv", &[",delivered,"]);
    team.signal("gold", Signal::SIGUSR1);
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    let finished = team.wait().expect(0);
    finished.shows("gold crashed").shows("a bug in the agent");
    assert_eq!(finished.json()["result"]["items"]["delivered"], 24);
}

//! External controllers, named in the scenario and started by `--controller`. Here they are the command's own agent, which
//! launcher, log and replay treat like any other program.

use std::fs;

use alliance_tests::harness::{Finished, Lab, command_line, wait_until};
use alliance_tests::python::python;
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::{EventRow, RunLog, Table};
use scenario::testkit::entry;

const PROGRAM: &str = env!("CARGO_BIN_EXE_alliance-under-test");

/// A scenario of the usual team in which gold and green have external controllers.
const CONTROLLERS: &str = "
name = 'controllers'
[[robots]]
name = 'blue'
[[robots]]
name = 'gold'
controller = 'agent'
[[robots]]
name = 'green'
side_sensor = true
controller = 'other'
";

fn write(lab: &Lab, file: &str, text: &str) {
    fs::write(lab.path(file), text).unwrap();
}

fn controller(name: &str) -> String {
    format!("--controller={name}={PROGRAM} cluster agent")
}

/// Runs the scenario with the command's own agents as external controllers.
#[track_caller]
fn run(lab: &Lab, out: &str, arguments: &[&str]) -> Finished {
    let controllers = [controller("agent@7"), controller("other")];
    let mut all = vec!["controllers.toml", &controllers[0], &controllers[1]];
    all.extend(arguments);
    lab.mission(out, &all)
}

fn hash(lab: &Lab, out: &str) -> Option<String> {
    lab.log(out).run.hash
}

#[track_caller]
fn assert_identical(finished: &Finished) {
    assert!(
        finished.answer().starts_with("identical"),
        "{}",
        finished.stderr
    );
}

fn kinds(log: &RunLog, robot: &str) -> Vec<String> {
    let event_kinds = ["joined", "gone", "stalled", "back"];
    let rows = log.rows::<EventRow>().unwrap().into_iter();
    let rows = rows.filter(|row| row.robot == robot && event_kinds.contains(&row.kind.as_str()));
    rows.map(|row| row.kind).collect()
}

#[test]
fn external_controllers_give_the_hash_of_the_built_in_ones_and_a_replay_needs_no_controller() {
    let lab = Lab::new();
    write(&lab, "controllers.toml", CONTROLLERS);
    let built_in = CONTROLLERS
        .replace("controller = 'agent'", "")
        .replace("controller = 'other'", "");
    write(&lab, "own.toml", &built_in.replace("controllers", "own"));
    for level in ["full", "summary", "off"] {
        let arguments = ["--limit=20", "--log", level];
        run(&lab, &format!("controllers-{level}"), &arguments).expect(1);
        lab.mission(
            &format!("own-{level}"),
            &[&["own.toml"], &arguments[..]].concat(),
        )
        .expect(1);
        let (controllers, built_in) = (format!("controllers-{level}"), format!("own-{level}"));
        assert!(hash(&lab, &controllers).is_some());
        assert_eq!(hash(&lab, &controllers), hash(&lab, &built_in));
        assert!(!lab.path(&built_in).join("foreign.bin").exists());
        assert_identical(&lab.run(&["replay", &controllers]).expect(0));
    }
    let log = lab.log("controllers-full");
    let version = |name: &str| log.run.controllers[name].version.clone();
    assert_eq!(
        (version("agent"), version("other")),
        (Some("7".to_owned()), None)
    );
    assert_eq!(
        log.external_answers().unwrap().len(),
        2 * 400,
        "two robots, 400 ticks"
    );

    // The tables written by a replay have the same bytes.
    lab.run(&["replay", "controllers-full", "--out", "again"])
        .expect(0);
    lab.assert_same_bytes("controllers-full", "again");
}

#[test]
fn process_faults_reach_external_controllers_and_replays_are_identical() {
    let lab = Lab::new();
    let faults = r#"
        [[faults.timeline]]
        fault.kill = "gold"
        at_s = 4.0
        for_s = 4.0
        [[faults.timeline]]
        fault.pause = "gold"
        at_s = 10.0
        for_s = 2.0
        [[faults.timeline]]
        fault.restart = "green"
        at_s = 13.0
        [[faults.timeline]]
        fault.terminate = "green"
        at_s = 16.0
        for_s = 2.0
        [[faults.timeline]]
        fault.drop.p = 0.4
        at_s = 2.0
    "#;
    write(&lab, "controllers.toml", &format!("{CONTROLLERS}{faults}"));
    run(&lab, "run", &["--limit=20"]).expect(1);
    let log = lab.log("run");
    assert!(
        log.run.faults.iter().all(|fault| fault.hits > 0),
        "{:?}",
        log.run.faults
    );
    assert!(!log.run.unscripted);
    assert_eq!(
        kinds(&log, "gold"),
        ["joined", "gone", "joined", "stalled", "back"]
    );
    assert_eq!(
        kinds(&log, "green"),
        ["joined", "gone", "joined", "gone", "joined"]
    );
    let agent_log = fs::read_to_string(lab.path("run/logs/gold.log")).unwrap();
    assert_eq!(agent_log.matches("joined").count(), 2, "{agent_log}");

    assert_identical(&lab.run(&["replay", "run"]).expect(0));
    assert_identical(
        &lab.run(&["replay", "run", &controller("agent"), &controller("other")])
            .expect(0),
    );
    // A replay with one of the two controllers.
    assert_identical(&lab.run(&["replay", "run", &controller("other")]).expect(0));
}

#[test]
fn a_controller_that_answers_differently_is_reported_with_tick_and_field() {
    let lab = Lab::new();
    write(&lab, "controllers.toml", CONTROLLERS);
    run(&lab, "run", &["--limit=10"]).expect(1);
    // The recorded world now states another allocator for the robot.
    let path = lab.path("run/run.json");
    let mut run: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    run["scenario"]["robots"][1]["allocator"] = "nearest".into();
    fs::write(&path, run.to_string()).unwrap();
    assert_identical(&lab.run(&["replay", "run"]).expect(0));
    let differs = lab
        .run(&["replay", "run", "--json", &controller("agent")])
        .expect(1);
    let found = differs.json();
    assert_eq!(
        (
            &found["result"],
            &found["tick"],
            &found["robot"],
            &found["section"]
        ),
        (
            &"differs".into(),
            &0.into(),
            &"gold".into(),
            &"controller".into()
        )
    );
    assert!(found["field"].is_string(), "{found}");
    // A controller that does not answer at all.
    let silent = lab
        .run(&["replay", "run", "--controller=agent=sh -c 'exit 7'"])
        .expect(2);
    assert!(
        silent
            .stderr
            .contains("gold: its controller ended with exit status 7"),
        "{}",
        silent.stderr
    );
    let unknown = lab.run(&["replay", "run", &controller("agnt")]).expect(2);
    assert!(
        unknown.stderr.contains("there are agent, other"),
        "{}",
        unknown.stderr
    );
}

#[test]
fn a_killed_world_leaves_the_answers_of_every_complete_tick() {
    let lab = Lab::new();
    write(&lab, "controllers.toml", CONTROLLERS);
    let controllers = [controller("agent"), controller("other")];
    let mut team = Team::start(
        &lab,
        &[
            "controllers.toml",
            "--speed=8x",
            &controllers[0],
            &controllers[1],
        ],
    );
    team.wait_for_row("ticks.csv", &[",run,"]);
    wait_until("a second of the run", || {
        fs::metadata(lab.path("run/foreign.bin")).is_ok_and(|file| file.len() > 5000)
    });
    let gold = team.pid("gold");
    team.signal("world", Signal::SIGKILL);
    team.wait().expect(3);
    wait_until("the end of gold's controller", || {
        command_line(gold).is_none()
    });
    let log = lab.log("run");
    let ticks = log.last.unwrap().tick + 1;
    assert_eq!(log.external_answers().unwrap().len() as u64, 2 * ticks);
    assert!(!log.table(Table::External).is_empty());
    assert_identical(&lab.run(&["replay", "run"]).expect(0));
}

#[test]
fn external_controllers_and_their_children_end_with_the_launcher() {
    let lab = Lab::new();
    write(&lab, "controllers.toml", CONTROLLERS);
    // A shell that waits for its child, like a wrapper script. The child is the controller.
    let wrapped = format!("--controller=agent=sh -c '{PROGRAM} cluster agent & wait'");
    let mut team = Team::start(
        &lab,
        &[
            "controllers.toml",
            "--speed=4x",
            &wrapped,
            &controller("other"),
        ],
    );
    team.wait_for_row("ticks.csv", &[",run,"]);
    let mut pids = ["world", "gold", "green"]
        .map(|name| team.pid(name))
        .to_vec();
    let gold = team.pid("gold");
    let children = fs::read_to_string(format!("/proc/{gold}/task/{gold}/children")).unwrap();
    pids.extend(
        children
            .split_whitespace()
            .map(|pid| pid.parse::<u32>().unwrap()),
    );
    assert_eq!(pids.len(), 4, "{children}");
    team.launcher().signal(Signal::SIGKILL);
    for pid in pids {
        wait_until("the end of all started processes", || {
            command_line(pid).is_none()
        });
    }
}

/// The result of an order is in the list of faults and in the log, in addition to the terminal.
#[test]
fn a_failed_order_is_reported_with_its_reason_and_the_run_continues() {
    let lab = Lab::new();
    write(&lab, "controllers.toml", CONTROLLERS);
    write(
        &lab,
        "controller.sh",
        &format!("exec {PROGRAM} cluster agent\n"),
    );
    let mut team = Team::start(
        &lab,
        &[
            "controllers.toml",
            "--speed=10x",
            "--controller=agent=sh controller.sh",
            &controller("other"),
        ],
    );
    team.wait_for_row("poses.csv", &["2000,"]);
    let order = |arguments: &[&str]| {
        lab.run(&[&["fault"], arguments].concat()).expect(0);
    };
    order(&["kill", "gold", "--id", "end"]);
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    write(&lab, "controller.sh", "exit 7\n");
    order(&["restart", "gold", "--id", "in-vain"]);
    team.wait_for_row("events.csv", &[",failed,", "in-vain"]);
    let reason = "its process ended before it joined";
    let list = lab.run(&["fault", "list", "--json"]).expect(0).json();
    let status = |id: &str| {
        let faults = list["faults"].as_array().unwrap().iter();
        faults
            .clone()
            .find(|fault| fault["id"] == id)
            .unwrap()
            .clone()
    };
    assert_eq!(status("in-vain")["failed"], reason);
    assert_eq!(status("in-vain")["hits"], 0);
    assert_eq!(status("end")["failed"], serde_json::Value::Null);
    let table = lab.run(&["fault", "list"]).expect(0).stderr;
    assert!(table.contains("failed: "), "{table}");

    write(
        &lab,
        "controller.sh",
        &format!("exec {PROGRAM} cluster agent\n"),
    );
    order(&["restart", "gold", "--id", "again"]);
    team.wait_for_row("events.csv", &[",joined,gold,", "incarnation 2"]);
    lab.run(&["clock", "speed", "max"]).expect(0);
    team.wait().expect(0);
    let log = lab.log("run");
    assert_eq!(kinds(&log, "gold"), ["joined", "gone", "joined"]);
    let failed = log.run.faults.iter().find(|fault| fault.id == "in-vain");
    assert_eq!(failed.unwrap().failed.as_deref(), Some(reason));
    assert_identical(&lab.run(&["replay", "run"]).expect(0));
}

/// Runs the Python reference agent with a change as gold's controller, with Rust teammates. Returns the log.
#[track_caller]
fn run_changed(lab: &Lab, change: (&str, &str), faults: &str) -> Option<RunLog> {
    let python = python(&["zenoh", "xxhash"])?;
    let program = include_str!("../python/agent.py");
    let changed = program.replace(change.0, change.1);
    assert_ne!(changed, program);
    write(lab, "changed.py", &changed);
    let gold_only = CONTROLLERS.replace("controller = 'other'", "");
    write(lab, "changed.toml", &format!("{gold_only}{faults}"));
    let command = format!("--controller=agent={} changed.py", python.display());
    lab.mission("run", &["changed.toml", "--limit=10", &command])
        .expect(1);
    assert_identical(&lab.run(&["replay", "run"]).expect(0));
    Some(lab.log("run"))
}

#[test]
fn a_controller_that_ignores_a_link_fault_is_dismissed_and_the_run_continues() {
    // The agent processes a message that the link has cut.
    let lab = Lab::new();
    let (from, to) = ("return \"Cut\",", "return \"Received\",");
    let mute = "[[faults.timeline]]\nfault.mute = 'blue'\nat_s = 4.0\n";
    let Some(log) = run_changed(&lab, (from, to), mute) else {
        return;
    };
    assert_eq!(kinds(&log, "gold"), ["joined", "gone"]);
    assert_eq!(log.run.result.ticks, 200);
    assert!(!log.run.unscripted);
    let world_log = fs::read_to_string(lab.path("run/logs/world.log")).unwrap();
    assert!(world_log.contains("controller dismissed"), "{world_log}");
    assert!(
        world_log.contains("from blue: 'received', but the link's result is 'cut'"),
        "{world_log}"
    );
    let rows = log.rows::<EventRow>().unwrap();
    let gone = rows.iter().find(|row| row.kind == "gone").unwrap();
    assert!(
        (4000..5200).contains(&gone.t_ms.0),
        "at the first heartbeat: {gone:?}"
    );
}

#[test]
fn a_controller_with_impossible_reports_is_dismissed_and_the_run_continues() {
    for (from, to) in [
        (
            "\"active\": None",
            "\"active\": 999 if tick[\"tick\"] > 100 else None",
        ),
        (
            "\"broadcasts\": len(sealed)",
            "\"broadcasts\": 300 if tick[\"tick\"] > 100 else len(sealed)",
        ),
    ] {
        let lab = Lab::new();
        let Some(log) = run_changed(&lab, (from, to), "") else {
            return;
        };
        assert_eq!(kinds(&log, "gold"), ["joined", "gone"], "{to}");
        assert_eq!((log.run.result.ticks, log.run.unscripted), (200, false));
        let world_log = fs::read_to_string(lab.path("run/logs/world.log")).unwrap();
        assert!(world_log.contains("impossible contents"), "{world_log}");
    }
}

#[test]
fn mistakes_give_one_line() {
    let lab = Lab::new();
    write(&lab, "controllers.toml", CONTROLLERS);
    write(
        &lab,
        "clash.toml",
        &CONTROLLERS.replace("'agent'", "'nearest'"),
    );
    write(
        &lab,
        "word.toml",
        &CONTROLLERS.replace("'agent'", "'my controller'"),
    );
    let (agent, other) = (controller("agent"), controller("other"));
    let cases: [&[&str]; 8] = [
        &["controllers.toml"],
        &["controllers.toml", &agent],
        &["janitorial", &agent],
        &["controllers.toml", &agent, &other, "--controller=agnt=x"],
        &["controllers.toml", &agent, &agent],
        &["controllers.toml", &agent, &other, "--in-process"],
        &["clash.toml"],
        &["word.toml"],
    ];
    let answers = cases.map(|arguments| {
        let error = lab.refusal(&[&["run", "--out", "out"], arguments].concat());
        assert!(!lab.path("out").exists());
        entry(&arguments.join(" "), &error).replace(PROGRAM, "PROGRAM")
    });
    insta::assert_snapshot!(answers.concat());
    // A controller that cannot be started counts as a crashed robot, and its error output is shown.
    let controllers = [
        "controllers.toml",
        "--limit=2",
        "--controller=agent=no-such-program",
        &other,
    ];
    let failed = lab.mission("out", &controllers).expect(1);
    let stderr = &failed.stderr;
    assert!(
        stderr.contains("gold ended with exit status 127"),
        "{stderr}"
    );
    assert!(stderr.contains("no-such-program"), "{stderr}");
}

//! External controllers, named in the scenario and started by `--controller`. Here they are the command's own agent, which
//! launcher, log and replay treat like any other program.

use std::fs;

use alliance_tests::harness::{Arguments, Finished, Lab, command_line, join, wait_until};
use alliance_tests::python::python;
use alliance_tests::runs::Events;
use alliance_tests::team::Team;
use nix::sys::signal::Signal;
use run_log::{EventRow, RunLog, Table};
use scenario::testkit::entry;
use serde_json::json;

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

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("controllers.toml", CONTROLLERS);
    lab
}

/// Returns the option that runs the command's own agent as a controller.
fn controller(name: &str) -> String {
    format!("--controller={name}={PROGRAM} cluster agent")
}

/// Returns the arguments of a run of the scenario with this controller of gold.
fn with(gold: &str, arguments: impl Arguments) -> Vec<String> {
    let other = controller("other");
    join(["controllers.toml", gold, &other], arguments)
}

/// Runs the scenario with the command's own agents as external controllers.
#[track_caller]
fn run(lab: &Lab, out: &str, arguments: &str) {
    let arguments = with(&controller("agent@7"), arguments);
    lab.mission(out, arguments).expect(1);
}

fn kinds(log: &RunLog, robot: &str) -> String {
    let mut rows = log.rows::<EventRow>().unwrap();
    let kinds = ["joined", "gone", "stalled", "back"];
    rows.retain(|row| row.robot == robot && kinds.contains(&row.kind.as_str()));
    let kinds: Vec<String> = rows.into_iter().map(|row| row.kind).collect();
    kinds.join(" ")
}

#[track_caller]
fn assert_identical(finished: &Finished) {
    let is_identical = finished.answer().starts_with("identical");
    assert!(is_identical, "{}", finished.stderr);
}

#[test]
fn external_controllers_give_the_hash_of_the_built_in_ones_and_a_replay_needs_no_controller() {
    let lab = lab();
    let built_in = CONTROLLERS
        .replace("controller = 'agent'", "")
        .replace("controller = 'other'", "");
    lab.write("own.toml", built_in.replace("controllers", "own"));
    for level in ["full", "summary", "off"] {
        let arguments = format!("--limit=20 --log {level}");
        let [controllers, own] = ["controllers", "own"].map(|name| format!("{name}-{level}"));
        run(&lab, &controllers, &arguments);
        lab.mission(&own, format!("own.toml {arguments}")).expect(1);
        let hash = |out: &str| lab.log(out).run.hash;
        assert!(hash(&controllers).is_some());
        assert_eq!(hash(&controllers), hash(&own));
        assert!(!lab.exists(&format!("{own}/foreign.bin")));
        lab.assert_repeated(&controllers);
    }
    let log = lab.log("controllers-full");
    let versions = ["agent", "other"].map(|name| log.run.controllers[name].version.clone());
    assert_eq!(versions, [Some("7".to_owned()), None]);
    // Two robots, 400 ticks.
    assert_eq!(log.external_answers().unwrap().len(), 2 * 400);

    // The tables written by a replay have the same bytes.
    lab.run("replay controllers-full --out again").expect(0);
    lab.assert_same_bytes("controllers-full", "again");
}

#[test]
fn process_faults_reach_external_controllers_and_replays_are_identical() {
    let lab = Lab::new();
    let faults = r#"
        [faults]
        timeline = [
            { fault.kill = "gold", at_s = 4.0, for_s = 4.0 },
            { fault.pause = "gold", at_s = 10.0, for_s = 2.0 },
            { fault.restart = "green", at_s = 13.0 },
            { fault.terminate = "green", at_s = 16.0, for_s = 2.0 },
            { fault.drop.p = 0.4, at_s = 2.0 },
        ]
    "#;
    lab.write("controllers.toml", format!("{CONTROLLERS}{faults}"));
    run(&lab, "run", "--limit=20");
    let log = lab.log("run");
    let faults = &log.run.faults;
    assert!(faults.iter().all(|fault| fault.hits > 0), "{faults:?}");
    assert!(!log.run.unscripted);
    assert_eq!(kinds(&log, "gold"), "joined gone joined stalled back");
    assert_eq!(kinds(&log, "green"), "joined gone joined gone joined");
    let agent_log = lab.text("run/logs/gold.log");
    assert_eq!(agent_log.matches("joined").count(), 2, "{agent_log}");

    lab.assert_repeated("run");
    // A replay with one of the two controllers, and with both.
    let (agent, other) = (controller("agent"), controller("other"));
    for controllers in [&[&other][..], &[&agent, &other]] {
        let again = lab.run(join("replay run", controllers)).expect(0);
        assert_identical(&again);
    }
}

#[test]
fn a_controller_that_answers_differently_is_reported_with_tick_and_field() {
    let lab = lab();
    run(&lab, "run", "--limit=10");
    // The recorded world now states another allocator for the robot.
    let mut run = lab.json("run/run.json");
    run["scenario"]["robots"][1]["allocator"] = "nearest".into();
    lab.write("run/run.json", run.to_string());
    lab.assert_repeated("run");
    let replay = |controller: &str| lab.run(join("replay run --json", [controller]));
    let found = replay(&controller("agent")).expect(1).json();
    let place = ["result", "tick", "robot", "section"].map(|key| found[key].clone());
    assert_eq!(json!(place), json!(["differs", 0, "gold", "controller"]));
    assert!(found["field"].is_string(), "{found}");
    // A controller that does not answer at all.
    let silent = replay("--controller=agent=sh -c 'exit 7'").expect(2);
    silent.shows("gold: its controller ended with exit status 7");
    let unknown = replay(&controller("agnt")).expect(2);
    unknown.shows("there are agent, other");
}

#[test]
fn a_killed_world_leaves_the_answers_of_every_complete_tick() {
    let lab = lab();
    let mut team = Team::start(&lab, with(&controller("agent"), "--speed=8x"));
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
    let ticks = log.last.as_ref().unwrap().tick + 1;
    assert_eq!(log.external_answers().unwrap().len() as u64, 2 * ticks);
    assert!(!log.table(Table::External).is_empty());
    lab.assert_repeated("run");
}

#[test]
fn external_controllers_and_their_children_end_with_the_launcher() {
    let lab = lab();
    // A shell that waits for its child, like a wrapper script. The child is the controller.
    let wrapped = format!("--controller=agent=sh -c '{PROGRAM} cluster agent & wait'");
    let mut team = Team::start(&lab, with(&wrapped, "--speed=4x"));
    team.wait_for_row("ticks.csv", &[",run,"]);
    let gold = team.pid("gold");
    let children = fs::read_to_string(format!("/proc/{gold}/task/{gold}/children")).unwrap();
    let children = children.split_whitespace();
    let mut pids: Vec<u32> = children.map(|pid| pid.parse().unwrap()).collect();
    pids.extend([team.pid("world"), gold, team.pid("green")]);
    assert_eq!(pids.len(), 4, "{pids:?}");
    team.launcher().signal(Signal::SIGKILL);
    wait_until("the end of all started processes", || {
        pids.iter().all(|pid| command_line(*pid).is_none())
    });
}

/// The result of an order is in the list of faults and in the log, in addition to the terminal.
#[test]
fn a_failed_order_is_reported_with_its_reason_and_the_run_continues() {
    let lab = lab();
    let script = format!("exec {PROGRAM} cluster agent\n");
    lab.write("controller.sh", &script);
    let gold = "--controller=agent=sh controller.sh";
    let mut team = Team::start(&lab, with(gold, "--speed=10x"));
    team.wait_for_row("poses.csv", &["2000,"]);
    lab.run("fault kill gold --id end").expect(0);
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    lab.write("controller.sh", "exit 7\n");
    lab.run("fault restart gold --id in-vain").expect(0);
    team.wait_for_row("events.csv", &[",failed,", "in-vain"]);
    let reason = "its process ended before it joined";
    let list = lab.run("fault list --json").expect(0).json();
    let faults = list["faults"].as_array().unwrap().iter();
    let results = faults.map(|fault| json!([fault["id"], fault["failed"], fault["hits"]]));
    let expected = [json!(["end", null, 1]), json!(["in-vain", reason, 0])];
    assert_eq!(results.collect::<Vec<_>>(), expected);
    lab.run("fault list").expect(0).shows("failed: ");

    lab.write("controller.sh", &script);
    lab.run("fault restart gold --id again").expect(0);
    team.wait_for_row("events.csv", &[",joined,gold,", "incarnation 2"]);
    lab.run("clock speed max").expect(0);
    team.wait().expect(0);
    let log = lab.log("run");
    assert_eq!(kinds(&log, "gold"), "joined gone joined");
    let failed = log.run.faults.iter().find(|fault| fault.id == "in-vain");
    assert_eq!(failed.unwrap().failed.as_deref(), Some(reason));
    lab.assert_repeated("run");
}

/// The Python reference agent with a change: it processes a message that the link has cut, it reports an unknown
/// behavior, or it reports too many broadcasts. It is dismissed, and the run continues.
#[test]
fn a_controller_that_breaks_a_rule_is_dismissed_and_the_run_continues() {
    let Some(python) = python(&["zenoh", "xxhash"]) else {
        return;
    };
    let gold_only = CONTROLLERS.replace("controller = 'other'", "");
    let mute = "[[faults.timeline]]\nfault.mute = 'blue'\nat_s = 4.0\n";
    let impossible = "impossible contents";
    for (from, to, faults, reason) in [
        (
            "[\"Cut\"] * link",
            "[\"Received\"] * link",
            mute,
            "from blue: 'received', but the link's result is 'cut'",
        ),
        (
            "\"active\": None",
            "\"active\": 999 if tick[\"tick\"] > 100 else None",
            "",
            impossible,
        ),
        (
            "\"broadcasts\": len(sealed)",
            "\"broadcasts\": 300 if tick[\"tick\"] > 100 else len(sealed)",
            "",
            impossible,
        ),
    ] {
        let lab = Lab::new();
        let program = include_str!("../python/agent.py");
        let changed = program.replace(from, to);
        assert_ne!(changed, program);
        // The program reads the schema by its own place.
        for folder in ["tests/python", "docs"] {
            fs::create_dir_all(lab.path(folder)).unwrap();
        }
        lab.write("tests/python/changed.py", changed);
        lab.write(
            "docs/wire.schema.json",
            include_str!("../../docs/wire.schema.json"),
        );
        lab.write("changed.toml", format!("{gold_only}{faults}"));
        let python = python.display();
        let command = format!("--controller=agent={python} tests/python/changed.py");
        let arguments = ["changed.toml", "--limit=10", &command];
        lab.mission("run", arguments).expect(1);
        lab.assert_repeated("run");
        let log = lab.log("run");
        assert_eq!(kinds(&log, "gold"), "joined gone", "{to}");
        assert_eq!((log.run.result.ticks, log.run.unscripted), (200, false));
        let world_log = lab.text("run/logs/world.log");
        for text in ["controller dismissed", reason] {
            assert!(world_log.contains(text), "no '{text}': {world_log}");
        }
        if faults == mute {
            // At the first heartbeat.
            let gone_ms = log.times_of("gold", "gone")[0];
            assert!((4000..5200).contains(&gone_ms), "{gone_ms}");
        }
    }
}

#[test]
fn mistakes_give_one_line() {
    let lab = lab();
    let clash = CONTROLLERS.replace("'agent'", "'nearest'");
    lab.write("clash.toml", clash);
    let word = CONTROLLERS.replace("'agent'", "'my controller'");
    lab.write("word.toml", word);
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
        let error = lab.refusal(join("run --out out", arguments));
        assert!(!lab.exists("out"));
        entry(&arguments.join(" "), &error).replace(PROGRAM, "PROGRAM")
    });
    insta::assert_snapshot!(answers.concat());
    // A controller that cannot be started counts as a crashed robot, and its error output is shown.
    let missing = with("--controller=agent=no-such-program", "--limit=2");
    let failed = lab.mission("out", missing).expect(1);
    failed.shows("gold ended with exit status 127");
    failed.shows("no-such-program");
}

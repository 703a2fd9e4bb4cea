//! `alliance run --from RUN --at TIME`: a branch repeats a run up to a tick, by processes and in one process, and then goes
//! on with other faults or parameters.

use alliance_tests::harness::Lab;
use alliance_tests::team::Team;
use run_log::{Input, RunLog, TickRow};
use scenario::ids::Tick;
use scenario::testkit::entry;

/// Faults that are in force, armed, repeated and waiting at the times of the branches.
const FAULTS: &str = r#"
limit_s = 90

[[faults.timeline]]
id = "loss"
at_s = 5.0
fault.drop = { p = 0.2 }

[[faults.timeline]]
at_s = 10.0
for_s = 30.0
fault.kill = "gold"

[[faults.timeline]]
at_s = 15.0
for_s = 40.0
fault.pause = "green"

[[faults.timeline]]
at_s = 12.0
every_s = 20.0
for_s = 5.0
fault.mute = "blue"

[[faults.timeline]]
at_s = 60.0
fault.terminate = "blue"

[[faults.timeline]]
when = "gold dies"
fault.deaf = "blue"
"#;

/// A delay and a restart after the branch.
const OTHER: &str = r#"
[[faults.timeline]]
id = "late"
at_s = 25.0
fault.delay = { delay_s = 0.4, jitter_s = 0.3 }

[[faults.timeline]]
at_s = 35.0
fault.restart = "gold"

[[faults.timeline]]
when = "green activates report-progress"
for_s = 3.0
fault.power = "green"
"#;

/// Checks that both logs have the same rows of ticks.csv before a tick. They contain the hash of each table up to then.
#[track_caller]
fn assert_same_before(a: &RunLog, b: &RunLog, tick: Tick) {
    let rows = |log: &RunLog| -> Vec<TickRow> {
        let rows = log.rows::<TickRow>().unwrap().into_iter();
        rows.filter(|row| row.tick < tick).collect()
    };
    let (a, b) = (rows(a), rows(b));
    assert!(tick == 0 || !a.is_empty());
    assert_eq!(a, b);
}

/// Makes a branch by processes and another in one process, and checks that they are equal, that they equal the run before
/// the tick, and that their replays are identical.
#[track_caller]
fn branch(lab: &Lab, run: &str, at: &str, arguments: &[&str]) -> RunLog {
    let arguments = [&["--from", run, "--at", at][..], arguments].concat();
    for out in ["many", "one"] {
        // The folders of an earlier branch.
        let _ = std::fs::remove_dir_all(lab.path(out));
    }
    let many = lab.mission("many", &arguments);
    let in_one = ["run", "--in-process", "--check", "--out", "one"];
    let one = lab.run([&in_one[..], &arguments].concat());
    assert!(
        matches!(many.status.code(), Some(0 | 1)),
        "{arguments:?}: {}",
        many.stderr
    );
    assert_eq!(
        one.status.code(),
        many.status.code(),
        "{arguments:?}: {}",
        one.stderr
    );
    assert!(
        !one.stderr.contains("violated"),
        "{arguments:?}: {}",
        one.stderr
    );
    lab.assert_same_bytes("many", "one");
    let (parent, log) = (lab.log(run), lab.log("many"));
    assert_eq!(log.run, lab.log("one").run, "{arguments:?}");
    let origin = log.run.branch.as_ref().unwrap();
    assert_eq!(origin.run, run);
    assert_eq!(Some(&origin.hash), parent.run.hash.as_ref());
    assert_same_before(&parent, &log, origin.tick);
    lab.run(["replay", "many"]).expect(0);
    log
}

#[test]
fn each_change_of_a_scripted_run_takes_effect_after_the_branch_only() {
    let lab = Lab::new();
    std::fs::write(lab.path("faults.toml"), FAULTS).unwrap();
    std::fs::write(lab.path("other.toml"), OTHER).unwrap();
    std::fs::write(lab.path("nothing.toml"), "# no fault\n").unwrap();
    lab.run(["run", "faults.toml", "--in-process", "--out", "run"]);
    let parent = lab.log("run").run;
    // Gold is dead and green is paused at 20 s; both are alive at 58 s.
    let cases: &[(&str, &[&str])] = &[
        ("20s", &[]),
        ("0", &["--faults", "none"]),
        ("20s", &["--faults", "none"]),
        ("20s", &["--faults", "other.toml"]),
        ("58s", &["--faults", "nothing.toml"]),
        (
            "20s",
            &[
                "--set",
                "fast_impatience=9",
                "--set",
                "blue.report-progress.fast_impatience=30",
            ],
        ),
        (
            "58s",
            &["--faults", "none", "--set", "green.slow_impatience=0.1"],
        ),
    ];
    for (at, changes) in cases {
        let log = branch(&lab, "run", at, changes);
        let is_same = log.run.hash == parent.hash;
        assert_eq!(is_same, changes.is_empty(), "{at} {changes:?}");
        if is_same {
            lab.assert_same_bytes("run", "many");
            lab.run(["diff", "run", "many"]).expect(0);
            continue;
        }
        let difference = lab.run(["diff", "run", "many"]).expect(1).stderr;
        assert!(
            difference.contains("inputs: a branch with "),
            "{difference}"
        );
        let applied = |id: &str| {
            log.run
                .faults
                .iter()
                .any(|fault| fault.id == id && fault.hits > 0)
        };
        assert_eq!(
            applied("late"),
            changes.contains(&"other.toml"),
            "{changes:?}"
        );
    }
}

#[test]
fn each_allocator_adopts_other_times_or_gives_the_reason() {
    let lab = Lab::new();
    let scenario =
        "limit_s = 40\n[[faults.timeline]]\nat_s = 12.0\nfor_s = 15.0\nfault.kill = \"gold\"\n";
    std::fs::write(lab.path("run.toml"), scenario).unwrap();
    for (allocator, change) in [
        ("cbba", "refresh_s=0.3"),
        ("cbaa", "refresh_s=0.3"),
        ("acbba", "repeat_s=0.3"),
        ("ble", "rate_hz=4"),
        ("grape", "refresh_s=0.3"),
        ("ssi", "bid_window_s=0.3"),
        ("dhba", "refresh_s=0.3"),
        ("threshold", "alpha=30"),
        ("random", "redraw_s=2"),
        ("murdoch", "lease_s=2"),
    ] {
        let run = [
            "run",
            "run.toml",
            "--in-process",
            "--allocator",
            allocator,
            "--out",
            allocator,
        ];
        assert!(
            matches!(lab.run(run).status.code(), Some(0 | 1)),
            "{allocator}"
        );
        let change = format!("allocators.{allocator}.{change}");
        if allocator == "murdoch" {
            let refused =
                lab.refusal(["run", "--from", allocator, "--at", "20s", "--set", &change]);
            assert!(
                refused.contains("depends on this parameter of murdoch"),
                "{refused}"
            );
            continue;
        }
        // Gold is dead and starts again with the new parameter.
        let log = branch(&lab, allocator, "20s", &["--set", &change]);
        assert_ne!(log.run.hash, lab.log(allocator).run.hash, "{allocator}");
    }
}

#[test]
fn a_branch_before_a_real_kill_spares_the_robot_and_needs_no_other_file() {
    let lab = Lab::new();
    let mut team = Team::start(&lab, ["--speed", "20x"]);
    team.wait_for_row("events.csv", &[",picked,"]);
    lab.run(["fault", "delay", "--by", "0.2s", "--for", "5s"])
        .expect(0);
    team.wait_for_row("events.csv", &[",healed,"]);
    team.kill("gold");
    team.wait_for_row("events.csv", &[",gone,gold,"]);
    lab.run(["fault", "mute", "blue", "--for", "5s"]).expect(0);
    team.wait().expect(0);
    let parent = lab.log("run");
    let inputs = parent.inputs().unwrap();
    let is_kill = |input: &Input| matches!(input, Input::Gone { robot, .. } if robot == "gold");
    let killed = inputs
        .iter()
        .find(|line| is_kill(&line.input))
        .unwrap()
        .tick;
    let at = format!("{}ms", (killed - 10) * parent.run.setup.scenario.step_ms);

    // The kill and both orders are repeated.
    let same = branch(&lab, "run", &at, &[]);
    assert_eq!(same.run.hash, parent.run.hash);
    lab.assert_same_bytes("run", "many");

    // The order before the branch is repeated. The kill and the order after it are not.
    let spared = branch(&lab, "run", &at, &["--faults", "none"]);
    let inputs = spared.inputs().unwrap();
    assert!(!inputs.iter().any(|line| is_kill(&line.input)));
    let orders = inputs.iter();
    let orders = orders.filter(|line| matches!(line.input, Input::Order { .. }));
    assert_eq!(orders.count(), 1);
    assert_eq!(spared.run.result.robots["gold"].incarnations, 1);
    lab.run(["report", "run", "many", "--out", "both"])
        .expect(0);

    // A branch of a branch, which replays without the runs that it comes from.
    std::fs::rename(lab.path("many"), lab.path("spared")).unwrap();
    let later = format!("{}ms", (killed + 100) * parent.run.setup.scenario.step_ms);
    let again = branch(
        &lab,
        "spared",
        &later,
        &["--faults", "none", "--set", "fast_impatience=7"],
    );
    assert_ne!(again.run.hash, spared.run.hash);
    std::fs::rename(lab.path("many"), lab.path("again")).unwrap();
    for parent in ["run", "spared"] {
        std::fs::remove_dir_all(lab.path(parent)).unwrap();
    }
    lab.run(["replay", "again"]).expect(0);
    let same = branch(&lab, "again", &later, &[]);
    assert_eq!(same.run.hash, again.run.hash);
}

#[test]
fn impossible_branches_are_refused_in_one_line() {
    let lab = Lab::new();
    let write = |name: &str, text: &str| std::fs::write(lab.path(name), text).unwrap();
    let fault = |at: &str, fault: &str| format!("[[faults.timeline]]\n{at}fault.{fault}\n");
    write("early.toml", &fault("at_s = 3.0\n", "kill = \"gold\""));
    write("late.toml", &fault("at_s = 12.0\n", "kill = \"gold\""));
    write("robot.toml", &fault("at_s = 20.0\n", "kill = \"glod\""));
    write(
        "id.toml",
        &fault("id = \"f1\"\nat_s = 11.0\n", "mute = \"gold\""),
    );
    write("random.toml", "[faults.random]\nmtbf_s = 100.0\n");
    write("key.toml", "[[fault.timeline]]\nat_s = 20.0\n");
    let scenario = format!(
        "limit_s = 12\n{}",
        fault("at_s = 2.0\nfor_s = 2.0\n", "mute = \"blue\"")
    );
    write("run.toml", &scenario);
    let make = |out: &str, arguments: &[&str]| {
        let all = [
            &["run", "run.toml", "--in-process", "--out", out][..],
            arguments,
        ]
        .concat();
        assert!(matches!(lab.run(&all).status.code(), Some(0 | 1)));
    };
    make("run", &[]);
    make("cbba", &["--allocator", "cbba"]);
    for torn in ["torn", "unfinished", "damaged", "old"] {
        make(torn, &["--log", "full"]);
    }
    let poses = lab.path("torn/poses.csv");
    let bytes = std::fs::read(&poses).unwrap();
    std::fs::write(&poses, &bytes[..bytes.len() / 2]).unwrap();
    let edit = |run: &str, from: &str, to: &str| {
        let path = lab.path(run).join("run.json");
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{run}: {from}");
        std::fs::write(path, text.replacen(from, to, 1)).unwrap();
    };
    edit("unfinished", "\"time-limit\"", "\"running\"");
    edit("damaged", "\"seed\": 1", "\"seed\": 2");
    edit("old", "\"version\": \"0.1.0\"", "\"version\": \"0.0.9\"");
    let cases = [
        "--from run",
        "--at 10s",
        "--faults none",
        "--from nowhere --at 10s",
        "--from torn --at 10s",
        "--from unfinished --at 10s",
        "--from damaged --at 10s",
        "--from old --at 10s",
        "--from run --at 12s",
        "--from run --at 1h",
        "--from run --at -1s",
        "--from run --at 10s --faults nowhere.toml",
        "--from run --at 10s --faults early.toml",
        "--from run --at 10s --faults late.toml",
        "--from run --at 10s --faults robot.toml",
        "--from run --at 10s --faults id.toml",
        "--from run --at 10s --faults random.toml",
        "--from run --at 10s --faults key.toml",
        "--from run --at 10s --set fast_impatience",
        "--from run --at 10s --set threshold=50",
        "--from run --at 10s --set glod.fast_impatience=2",
        "--from run --at 10s --set fast_impatience=-2",
        "--from cbba --at 10s --set fast_impatience=2",
        "--from cbba --at 10s --set allocators.ble.rate_hz=2",
        "--from cbba --at 10s --set allocators.cbba.refresh=2",
        "--from cbba --at 10s --set allocators.cbba.refresh_s=-2",
        "--from cbba --at 10s --set allocators.cbba.bundle=3",
        "--from run --at 10s --allocator cbba",
        "--from run --at 10s --step-order in-order",
        "--from run --at 10s --limit 60s",
        "--from run --at 10s --seed 2",
        "--from run --at 10s service",
    ];
    let answers = cases.iter().map(|case| {
        let arguments: Vec<&str> = ["run"].into_iter().chain(case.split(' ')).collect();
        let error = lab.refusal(&arguments);
        let command = arguments.join(" ");
        // The runs above have created the link `latest`.
        let entries = std::fs::read_dir(lab.path("runs")).unwrap();
        assert_eq!(entries.count(), 1, "{command}: a folder was created");
        assert!(
            !lab.path("runtime/alliance").exists(),
            "{command}: a process was started"
        );
        entry(&command, &error)
    });
    insta::assert_snapshot!(answers.collect::<String>());
}

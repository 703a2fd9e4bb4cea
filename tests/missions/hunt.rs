//! `alliance hunt`: its findings, continuation after a kill, equal bytes for any number of jobs, and mistakes in the plan.

use std::fs;

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::testkit::{Row, files, journal_rows, rows};
use nix::sys::signal::Signal;
use scenario::testkit::entry;

/// The tasks of a lost robot stay with `static`, so both searches find the loss of a robot soon.
const PLAN: &str = "
question = 'Which faults stop a team with fixed tasks?'
scenario = 'little.toml'
limit_s = 54.0
seeds = 2
allocators = ['static', 'nearest']
violations = ['incomplete', 'exclusive-tasks']
budget = { runs = 40 }

[faults]
min = 1
max = 3
until_s = 20.0
only = ['kill', 'mute', 'drop', 'restart']
[shrink]
runs = 120
";

const LITTLE: &str = "
name = 'little'
robots = [{ name = 'blue', side_sensor = true }, { name = 'gold' }]
room = { width_m = 7.0, height_m = 5.0 }
[waste]
border_known = true
spills = [{ name = 'only', items = 4 }]
";

fn lab() -> Lab {
    let lab = Lab::new();
    fs::write(lab.path("plan.toml"), PLAN).unwrap();
    fs::write(lab.path("little.toml"), LITTLE).unwrap();
    lab
}

fn table(lab: &Lab, folder: &str) -> Vec<Row> {
    rows(&fs::read(lab.path(folder).join("results.csv")).unwrap())
}

#[test]
fn a_killed_hunt_continues_and_ends_with_the_same_bytes_on_any_number_of_jobs() {
    let lab = lab();
    let whole = ["hunt", "plan.toml", "--out", "whole", "--jobs", "2"];
    let stderr = lab.run(whole).expect(1).stderr;
    let all = journal_rows(&lab.path("whole"));
    let arguments = ["hunt", "plan.toml", "--out", "torn", "--jobs", "1"];
    for (signal, done) in [(Signal::SIGKILL, 1), (Signal::SIGINT, 4)] {
        let hunt = lab.start(arguments);
        wait_until("batches", || journal_rows(&lab.path("torn")) >= done);
        hunt.signal(signal);
        let finished = hunt.wait();
        assert!(
            journal_rows(&lab.path("torn")) < all,
            "interrupted too late"
        );
        assert!(!lab.path("torn/results.csv").exists());
        if signal == Signal::SIGINT {
            let stderr = &finished.expect(130).stderr;
            assert!(stderr.contains("of them done before"), "{stderr}");
            assert!(
                stderr.contains("alliance hunt plan.toml --out torn --jobs 1"),
                "{stderr}"
            );
        }
    }
    lab.run(arguments).expect(1);
    assert_eq!(files(&lab.path("whole")), files(&lab.path("torn")));
    // No run is repeated, and a changed plan is refused.
    lab.run(arguments).expect(1);
    assert_eq!(files(&lab.path("whole")), files(&lab.path("torn")));
    let changed = PLAN.replace("runs = 40", "runs = 41");
    fs::write(lab.path("plan.toml"), changed).unwrap();
    let refused = lab.refusal(arguments);
    assert!(
        refused.contains("torn holds another hunt, or this one before it was changed"),
        "{refused}"
    );

    // Both searches of the fixed assignment find a violation, which one fault is enough for.
    let found = table(&lab, "whole");
    assert_eq!(found.len(), 4);
    for row in found.iter().filter(|row| row["allocator"] == "static") {
        assert_eq!(row["violation"], "incomplete", "{row:?}");
        assert_eq!(row["faults_least"], "1", "{row:?}");
    }
    // Each printed command shows its violation.
    let shown: Vec<&str> = stderr
        .lines()
        .filter_map(|line| line.strip_prefix("show     alliance "))
        .collect();
    assert!(shown.len() >= 2, "{stderr}");
    for command in shown {
        let mut words: Vec<&str> = command.split(' ').collect();
        words.extend(["--out", "shown"]);
        let _ = fs::remove_dir_all(lab.path("shown"));
        lab.run(&words).expect(1);
    }
    let least = fs::read_to_string(lab.path("whole/least-static-guided.toml")).unwrap();
    assert!(
        least.contains(
            "\n#   alliance run least-static-guided.toml --seed 2 --in-process   # exit status 1\n"
        ),
        "{least}"
    );
    let report = "least-static-guided/report/report.html";
    assert!(lab.path("whole").join(report).exists());
    let page = fs::read_to_string(lab.path("whole/hunt.html")).unwrap();
    assert!(page.contains("Which faults stop a team with fixed tasks?") && page.contains(report));
    assert!(!page.contains("<script") && !page.contains("<link"));
}

#[test]
fn the_worst_par2_time_uses_the_whole_budget_and_a_time_is_a_budget() {
    let lab = lab();
    let worst = PLAN
        .replace(
            "violations = ['incomplete', 'exclusive-tasks']",
            "objective = 'par2'",
        )
        .replace(
            "allocators = ['static', 'nearest']",
            "allocators = ['nearest']",
        );
    fs::write(lab.path("worst.toml"), &worst).unwrap();
    lab.run(["hunt", "worst.toml", "--out", "worst"]).expect(0);
    let found = table(&lab, "worst");
    assert_eq!(found.len(), 2);
    for row in &found {
        assert_eq!(
            (&*row["runs"], &*row["violation"]),
            ("40", "worst-par2"),
            "{row:?}"
        );
    }

    let timed = PLAN
        .replace("{ runs = 40 }", "{ seconds = 0.5 }")
        .replace("['incomplete', 'exclusive-tasks']", "['numbers-in-range']");
    fs::write(lab.path("timed.toml"), timed).unwrap();
    lab.run(["hunt", "timed.toml", "--out", "timed"]).expect(0);
    for row in table(&lab, "timed") {
        let runs: usize = row["runs"].parse().unwrap();
        assert!(runs >= 16 && runs.is_multiple_of(16), "{row:?}");
    }

    let stderr = lab.run(["hunt", "plan.toml", "--dry-run"]).expect(0).stderr;
    // For two allocators: 2 runs without faults, and two searches of 40 runs with 120 more to shrink.
    assert!(stderr.contains("hunt plan: at most 644 runs"), "{stderr}");
    assert!(
        stderr.contains("1 to 3 faults of 4 kinds: kill, restart, drop, mute"),
        "{stderr}"
    );
    assert!(!lab.path("hunts").exists());
}

#[test]
fn mistakes_give_one_line_before_any_run() {
    let lab = lab();
    let refusal = |plan: &str| {
        fs::write(lab.path("bad.toml"), plan).unwrap();
        lab.refusal(["hunt", "bad.toml"])
    };
    let changes = [
        ("budget = { runs = 40 }\n", ""),
        ("{ runs = 40 }", "{ runs = 0 }"),
        ("{ runs = 40 }", "{ runs = 40, seconds = 9.0 }"),
        ("{ runs = 40 }", "{ seconds = -1.0 }"),
        ("'exclusive-tasks'", "'exclusive-task'"),
        (
            "violations = ['incomplete', 'exclusive-tasks']",
            "violations = []",
        ),
        ("budget =", "objective = 'par2'\nbudget ="),
        ("budget =", "budgets ="),
        ("budget =", "methods = ['guide']\nbudget ="),
        ("budget =", "slow_factor = 1.0\nbudget ="),
        ("'incomplete'", "'abandoned'"),
        ("'nearest'", "'nearst'"),
        ("'nearest'", "'static'"),
        ("'little.toml'", "'nowhere'"),
        ("limit_s = 54.0", "limit_s = -1.0"),
        ("seeds = 2", "seeds = []"),
        ("max = 3", "max = 0"),
        ("max = 3", "max = 101"),
        ("min = 1", "min = 4"),
        ("until_s = 20.0", "until_s = 55.0"),
        ("'kill', ", "'kil', "),
        ("['kill', 'mute', 'drop', 'restart']", "['skill']"),
        ("[shrink]\nruns = 120", "[shrink]\nruns = 1.5"),
    ];
    let answers = changes.map(|(from, to)| {
        assert!(PLAN.contains(from), "{from}");
        let error = refusal(&PLAN.replacen(from, to, 1));
        entry(&format!("{from:?} becomes {to:?}"), &error)
    });
    let nothing = entry("hunt nothing.toml", &lab.refusal(["hunt", "nothing.toml"]));
    insta::assert_snapshot!(answers.concat() + &nothing);
    assert!(!lab.path("hunts").exists());
}

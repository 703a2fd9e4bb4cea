//! `alliance sweep`: killed, interrupted, in shards, with mistakes in the plan, and with runs that fail.

use std::fs;
use std::io::Write;
use std::process::Command;

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::needs::cannot_run;
use alliance_tests::testkit::{Row, journal_rows, results, rows};
use nix::sys::signal::Signal;
use scenario::testkit::entry;
use serde_json::Value;

/// A short mission in 24 variants, some of which complete.
const PLAN: &str = "
limit_s = 150.0
seeds = { from = 3, to = 5 }
presets = ['team', 'par98']

[scenario]
name = 'little'
robots = [{ name = 'blue', side_sensor = true }, { name = 'gold' }]
room = { width_m = 7.0, height_m = 5.0 }

[scenario.waste]
spills = [{ name = 'only', items = 2 }]

[grid]
alliance.defaults.ceased_after_s = [4.0, 20.0]

[faults.none]
[faults.gold-dies]
timeline = [{ fault.kill = 'gold', at_s = 5.0 }]
";

const RUNS: usize = 24;

fn lab() -> Lab {
    let lab = Lab::new();
    fs::write(lab.path("plan.toml"), PLAN).unwrap();
    lab
}

fn result_rows(lab: &Lab, folder: &str) -> Vec<Row> {
    rows(&fs::read(lab.path(folder).join("results.csv")).unwrap())
}

/// Returns the arguments of the command at the end of the line that contains `mark`.
fn printed_command<'s>(output: &'s str, mark: &str) -> Vec<&'s str> {
    let mut lines = output.lines().filter_map(|line| line.split_once(mark));
    let (_, command) = lines
        .next()
        .unwrap_or_else(|| panic!("no '{mark}' in:\n{output}"));
    command.split_whitespace().collect()
}

#[test]
fn a_sweep_has_a_row_for_each_run_and_each_run_can_be_repeated() {
    let lab = lab();
    let finished = lab.run(&["sweep", "plan.toml"]).expect(0);
    let stderr = &finished.stderr;
    assert!(stderr.contains("24 runs: "), "{stderr}");
    assert!(stderr.contains("gold-dies"), "{stderr}");
    let rows = result_rows(&lab, "sweeps/plan");
    assert_eq!(rows.len(), RUNS);
    let settings: Vec<String> = rows
        .iter()
        .map(|row| {
            let columns = [
                "run",
                "alliance.defaults.ceased_after_s",
                "preset",
                "faults",
                "seed",
            ];
            columns.map(|column| row[column].as_str()).join(" ")
        })
        .collect();
    assert_eq!(settings[0], "0 4 team gold-dies 3");
    assert_eq!(settings[11], "11 4 par98 none 5");
    assert_eq!(settings[23], "23 20 par98 none 5");
    assert!(rows.iter().any(|row| row["outcome"] == "complete"));
    for row in &rows {
        let has_kill = row["faults"] == "gold-dies";
        assert_eq!(
            row["faults_hit"],
            if has_kill { "1" } else { "0" },
            "{row:?}"
        );
    }
    let created = results(&lab.path("sweeps/plan"));
    let names: Vec<&str> = created.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "by-0-alliance-defaults-ceased_after_s.svg",
            "by-1-preset.svg",
            "by-2-faults.svg",
            "faults.csv",
            "plan.toml",
            "results.csv",
            "results.parquet",
            "scenario.toml",
            "summary.csv",
            "summary.html",
        ]
    );
    let conditions = String::from_utf8(created["summary.csv"].clone()).unwrap();
    assert_eq!(conditions.lines().count(), 1 + RUNS / 3);
    let faults = String::from_utf8(created["faults.csv"].clone()).unwrap();
    let half = RUNS / 2;
    assert_eq!(
        faults,
        format!("kind,armed,hit,hits\nkill,{half},{half},{half}\n")
    );

    // The printed command repeats the run.
    for run in [0, 14] {
        let number = run.to_string();
        let printed = lab
            .run(&["sweep", "plan.toml", "--scenario", &number])
            .expect(0);
        fs::write(lab.path(&format!("run-{run}.toml")), &printed.stdout).unwrap();
        let mut arguments = printed_command(&printed.stderr, "alliance ");
        let out = format!("again-{run}");
        arguments.extend(["--json", "--out", &out]);
        let code = i32::from(rows[run]["outcome"] != "complete");
        let result = lab.run(&arguments).expect(code).json();
        assert_eq!(result["hash"], Value::from(rows[run]["hash"].as_str()));
        assert_eq!(result["outcome"], rows[run]["outcome"].as_str());
    }
}

#[test]
fn a_killed_or_interrupted_sweep_continues_and_ends_with_the_same_bytes() {
    const RUNS: usize = 8 * 12;
    let lab = Lab::new();
    // The sweep is long enough to be killed in the middle.
    let plan = PLAN.replace("to = 5", "to = 14");
    fs::write(lab.path("plan.toml"), plan).unwrap();
    lab.run(&["sweep", "plan.toml", "--out", "whole"]).expect(0);
    let arguments = ["sweep", "plan.toml", "--out", "torn", "--jobs", "1"];
    for (signal, rows) in [(Signal::SIGKILL, 2), (Signal::SIGINT, 10)] {
        let sweep = lab.start(&arguments);
        wait_until("rows", || journal_rows(&lab.path("torn")) >= rows);
        sweep.signal(signal);
        let finished = sweep.wait();
        assert!(
            journal_rows(&lab.path("torn")) < RUNS,
            "the sweep was interrupted too late"
        );
        assert!(!lab.path("torn/results.csv").exists());
        if signal == Signal::SIGINT {
            let stderr = &finished.expect(130).stderr;
            assert!(stderr.contains("done before"), "{stderr}");
            assert_eq!(printed_command(stderr, "  alliance "), arguments);
        }
        let mut journal = fs::OpenOptions::new()
            .append(true)
            .open(lab.path("torn/journal.jsonl"))
            .unwrap();
        journal.write_all(b"{\"run\":9,\"end\":{\"en").unwrap();
    }
    lab.run(&arguments).expect(0);
    lab.assert_same_results("whole", "torn");

    // Another start has nothing to do and changes nothing.
    let before = journal_rows(&lab.path("torn"));
    lab.run(&arguments).expect(0);
    assert_eq!((before, journal_rows(&lab.path("torn"))), (RUNS, RUNS));
    lab.assert_same_results("whole", "torn");
}

#[test]
fn merged_shards_equal_the_whole_sweep() {
    let lab = lab();
    lab.run(&["sweep", "plan.toml", "--out", "whole"]).expect(0);
    let shard = |number: &str, out: &str| {
        let shard = format!("{number}/3");
        lab.run(&["sweep", "plan.toml", "--out", out, "--shard", &shard])
            .expect(0)
    };
    // Two shards are in one folder, the third is from another machine.
    shard("0", "here");
    let stderr = shard("2", "here").stderr;
    assert_eq!(
        printed_command(&stderr, "  alliance "),
        ["sweep", "--merge", "here"]
    );
    let stderr = lab.run(&["sweep", "--merge", "here"]).expect(2).stderr;
    assert_eq!(stderr.lines().count(), 1, "{stderr}");
    assert!(
        stderr
            .starts_with("alliance sweep: 8 of 24 runs are missing: 1, 4, 7, 10, 13, 16, 19, 22;"),
        "{stderr}"
    );
    assert!(!lab.path("here/results.csv").exists());
    shard("1", "there");
    lab.run(&["sweep", "--merge", "here", "there", "--out", "together"])
        .expect(0);
    lab.assert_same_results("whole", "together");
    // The whole sweep reuses the runs of its shards.
    let finished = lab.run(&["sweep", "plan.toml", "--out", "here"]).expect(0);
    assert!(finished.stderr.contains("16 of them done before"));
    lab.assert_same_results("whole", "here");
}

/// Runs the jobs of an array with GNU parallel. Slurm and Kubernetes number jobs in the same way.
#[test]
fn gnu_parallel_runs_shards() {
    let version = Command::new("parallel").arg("--version").output();
    let is_installed = version.is_ok_and(|output| output.stdout.starts_with(b"GNU parallel"));
    if !is_installed {
        let how = "no GNU parallel: install Debian's package `parallel`";
        cannot_run(how);
        return;
    }
    let lab = lab();
    lab.run(&["sweep", "plan.toml", "--out", "whole"]).expect(0);
    let output = Command::new("parallel")
        .args(["--will-cite", "--jobs", "3"])
        .arg(env!("CARGO_BIN_EXE_alliance-under-test"))
        .args(["sweep", "plan.toml", "--out", "shards", "--jobs", "1"])
        .args(["--shard", "{}/3", ":::", "0", "1", "2"])
        .current_dir(lab.path(""))
        // GNU parallel writes files to the home folder.
        .env("HOME", lab.path(""))
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    for shard in 0..3 {
        let line = format!("shard {shard}/3: 8 runs done");
        assert!(stderr.contains(&line), "{stderr}");
    }
    lab.run(&["sweep", "--merge", "shards"]).expect(0);
    lab.assert_same_results("whole", "shards");
}

#[test]
fn a_failing_run_is_kept_and_the_other_runs_continue() {
    let lab = Lab::new();
    // Large robots have space, and so have small robots next to the obstacle.
    let plan = "
limit_s = 2.0
seeds = [8]
[scenario]
robots = [{ name = 'blue', side_sensor = true, start = { x_m = 4.6, y_m = 4.5 } }]
obstacles = [{ x_m = 8.0, y_m = 4.0, width_m = 1.0, height_m = 1.0 }]
[grid]
body.radius_m = [0.2, 0.5]
obstacles.0.x_m = [8.0, 5.0]
";
    fs::write(lab.path("big robots.toml"), plan).unwrap();
    let stderr = lab.run(&["sweep", "big robots.toml"]).expect(1).stderr;
    assert!(
        stderr.contains("4 runs: 0 complete, 3 not complete, 1 failed"),
        "{stderr}"
    );
    let rows = result_rows(&lab, "sweeps/big robots");
    let failed = &rows[3];
    assert_eq!(
        (failed["outcome"].as_str(), failed["hash"].as_str()),
        ("failed", "")
    );
    let reason = stderr
        .lines()
        .find_map(|line| line.strip_prefix("run 3 failed: "))
        .unwrap();
    let kept = fs::read_to_string(lab.path("sweeps/big robots/failures/3.toml")).unwrap();
    let head: Vec<&str> = kept.lines().take(2).collect();
    assert_eq!(
        head,
        [
            format!("# run 3 failed: {reason}").as_str(),
            "# alliance run 3.toml --seed 8 --in-process"
        ]
    );

    let again = stderr
        .lines()
        .find(|line| line.contains("; repeat it with: "))
        .unwrap();
    let (_, again) = again.split_once("; repeat it with: alliance ").unwrap();
    assert_eq!(
        again,
        "run 'sweeps/big robots/failures/3.toml' --seed 8 --in-process"
    );
    let again = lab
        .run(&[
            "run",
            "sweeps/big robots/failures/3.toml",
            "--seed",
            "8",
            "--in-process",
        ])
        .expect(2)
        .stderr;
    assert!(again.trim_end().ends_with(reason), "{again}\n{reason}");
    // There is no other failure.
    let failures = fs::read_dir(lab.path("sweeps/big robots/failures")).unwrap();
    assert_eq!(failures.count(), 1);
}

#[test]
fn mistakes_give_one_line_and_create_no_files() {
    let lab = lab();
    let plans = [
        "[grod]\n",
        "[grid]\nalliance.defaults.ceased_after = [4.0]\n",
        "scenario = 'nowhere'\n",
        "presets = ['tem']\n",
        "seeds = 0\n",
        "[faults.a]\ntimeline = [{ fault.kill = 'glod' }]\n",
    ];
    let plans = plans.map(|plan| {
        fs::write(lab.path("bad.toml"), plan).unwrap();
        entry(plan, &lab.refusal(&["sweep", "bad.toml"]))
    });
    let commands: [&[&str]; 6] = [
        &["sweep", "nothing.toml"],
        &["sweep", "a.toml", "b.toml"],
        &["sweep", "plan.toml", "--shard", "3/3"],
        &["sweep", "plan.toml", "--jobs", "0"],
        &["sweep", "plan.toml", "--scenario", "24"],
        &["sweep", "--merge", "."],
    ];
    let commands = commands.map(|command| entry(&command.join(" "), &lab.refusal(command)));
    assert!(!lab.path("sweeps").exists());

    // A folder can contain only one sweep.
    fs::write(lab.path("little.toml"), "limit_s = 1.0\n").unwrap();
    lab.run(&["sweep", "little.toml"]).expect(0);
    fs::write(lab.path("little.toml"), "limit_s = 2.0\n").unwrap();
    let before = results(&lab.path("sweeps/little"));
    let changed = entry(
        "another sweep in the same folder",
        &lab.refusal(&["sweep", "little.toml"]),
    );
    insta::assert_snapshot!(plans.concat() + &commands.concat() + &changed);
    assert_eq!(before, results(&lab.path("sweeps/little")));
}

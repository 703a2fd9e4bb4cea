//! `alliance sweep`: killed, interrupted, in shards, with mistakes in the plan, and with runs that fail.

use std::fs;
use std::io::Write;
use std::process::Command;

use alliance_tests::harness::{Lab, join, wait_until};
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
    lab.write("plan.toml", PLAN);
    lab
}

fn result_rows(lab: &Lab, folder: &str) -> Vec<Row> {
    rows(&lab.bytes(&format!("{folder}/results.csv")))
}

/// Returns the command at the end of the line that contains `mark`.
#[track_caller]
fn printed_command<'s>(output: &'s str, mark: &str) -> &'s str {
    let mut lines = output.lines().filter_map(|line| line.split_once(mark));
    let line = lines.next();
    line.unwrap_or_else(|| panic!("no '{mark}' in:\n{output}"))
        .1
}

/// Runs of `observe` last equally long and have no recurring events.
#[test]
fn the_printed_table_has_the_measure_of_the_scenario_and_no_empty_column() {
    let lab = Lab::new();
    let plan =
        "scenario = 'cmommt'\nseeds = 2\nlimit_s = 10.0\n[grid]\nobserve.range_m = [1.0, 3.0]\n";
    lab.write("plan.toml", plan);
    let finished = lab.run("sweep plan.toml").expect(0);
    let (_, table) = finished.stderr.split_once("range_m").unwrap();
    let (head, _) = table.split_once('─').unwrap();
    assert!(finished.stderr.contains("observed"), "{}", finished.stderr);
    assert!(!head.contains("lateness"), "{}", finished.stderr);
}

#[test]
fn a_sweep_has_a_row_for_each_run_and_each_run_can_be_repeated() {
    let lab = lab();
    let finished = lab.run("sweep plan.toml").expect(0);
    finished.shows("24 runs: ").shows("gold-dies");
    let rows = result_rows(&lab, "sweeps/plan");
    assert_eq!(rows.len(), RUNS);
    let setting = "alliance.defaults.ceased_after_s";
    for (run, expected) in [
        (0, "0 4 team gold-dies 3"),
        (11, "11 4 par98 none 5"),
        (23, "23 20 par98 none 5"),
    ] {
        let columns = ["run", setting, "preset", "faults", "seed"];
        let settings = columns.map(|column| rows[run][column].as_str());
        assert_eq!(settings.join(" "), expected);
    }
    assert!(rows.iter().any(|row| row["outcome"] == "complete"));
    for row in &rows {
        let hits = i32::from(row["faults"] == "gold-dies");
        assert_eq!(row["faults_hit"], hits.to_string(), "{row:?}");
    }
    let created = results(&lab.path("sweeps/plan"));
    let names: Vec<&str> = created.keys().map(String::as_str).collect();
    let figures = [
        "by-0-alliance-defaults-ceased_after_s",
        "by-1-preset",
        "by-2-faults",
    ];
    let formats =
        |figure: &str| ["csv", "pdf", "png", "svg"].map(|ending| format!("{figure}.{ending}"));
    let figures = figures.map(|figure| formats(figure).join(" ")).join(" ");
    let tables = "faults.csv plan.toml plot.py results.csv results.parquet scenario.toml summary.csv summary.html summary.tex";
    assert_eq!(names.join(" "), format!("{figures} {tables}"));
    let conditions = lab.text("sweeps/plan/summary.csv");
    assert_eq!(conditions.lines().count(), 1 + RUNS / 3);
    let expected = "kind,armed,hit,hits\nkill,12,12,12\n";
    assert_eq!(lab.text("sweeps/plan/faults.csv"), expected);

    // The printed command repeats the run.
    for run in [0, 14] {
        let printed = lab.run(format!("sweep plan.toml --scenario {run}"));
        let printed = printed.expect(0);
        lab.write(&format!("run-{run}.toml"), &printed.stdout);
        let command = printed_command(&printed.stderr, "alliance ");
        let again = lab.run(format!("{command} --json --out again-{run}"));
        let code = i32::from(rows[run]["outcome"] != "complete");
        let result = again.expect(code).json();
        assert_eq!(result["hash"], Value::from(rows[run]["hash"].as_str()));
        assert_eq!(result["outcome"], rows[run]["outcome"].as_str());
    }
}

#[test]
fn a_killed_or_interrupted_sweep_continues_and_ends_with_the_same_bytes() {
    const RUNS: usize = 8 * 12;
    let lab = Lab::new();
    // The sweep is long enough to be killed in the middle.
    lab.write("plan.toml", PLAN.replace("to = 5", "to = 14"));
    lab.run("sweep plan.toml --out whole").expect(0);
    let command = "sweep plan.toml --out torn --jobs 1";
    let torn = lab.path("torn");
    for (signal, rows) in [(Signal::SIGKILL, 2), (Signal::SIGINT, 10)] {
        let sweep = lab.start(command);
        wait_until("rows", || journal_rows(&torn) >= rows);
        sweep.signal(signal);
        let finished = sweep.wait();
        assert!(journal_rows(&torn) < RUNS, "interrupted too late");
        assert!(!lab.exists("torn/results.csv"));
        if signal == Signal::SIGINT {
            let finished = finished.expect(130);
            finished.shows("done before");
            assert_eq!(printed_command(&finished.stderr, "  alliance "), command);
        }
        let mut journal = fs::OpenOptions::new();
        let journal = journal.append(true).open(torn.join("journal.jsonl"));
        let unfinished = b"{\"run\":9,\"end\":{\"en";
        journal.unwrap().write_all(unfinished).unwrap();
    }
    // The second start has nothing to do and changes nothing.
    for _ in 0..2 {
        lab.run(command).expect(0);
        assert_eq!(journal_rows(&torn), RUNS);
        lab.assert_same_results("whole", "torn");
    }
}

/// GNU parallel runs the jobs of an array. Slurm and Kubernetes number jobs in the same way.
#[test]
fn merged_shards_equal_the_whole_sweep() {
    let lab = lab();
    lab.run("sweep plan.toml --out whole").expect(0);
    let shard = |number: u32, out: &str| {
        let shard = format!("sweep plan.toml --out {out} --shard {number}/3");
        lab.run(shard).expect(0)
    };
    // Two shards are in one folder, the third is from another machine.
    shard(0, "here");
    let stderr = shard(2, "here").stderr;
    let merge = printed_command(&stderr, "  alliance ");
    assert_eq!(merge, "sweep --merge here");
    let incomplete = lab.refusal(merge);
    let missing = "alliance sweep: 8 of 24 runs are missing: 1, 4, 7, 10, 13, 16, 19, 22;";
    assert!(incomplete.starts_with(missing), "{incomplete}");
    assert!(!lab.exists("here/results.csv"));
    shard(1, "there");
    lab.run("sweep --merge here there --out together").expect(0);
    lab.assert_same_results("whole", "together");
    // The whole sweep reuses the runs of its shards.
    let whole = lab.run("sweep plan.toml --out here").expect(0);
    whole.shows("16 of them done before");
    lab.assert_same_results("whole", "here");

    let version = Command::new("parallel").arg("--version").output();
    let is_installed = version.is_ok_and(|output| output.stdout.starts_with(b"GNU parallel"));
    if !is_installed {
        cannot_run("no GNU parallel: install Debian's package `parallel`");
        return;
    }
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
    lab.run("sweep --merge shards").expect(0);
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
    lab.write("big robots.toml", plan);
    let finished = lab.run(["sweep", "big robots.toml"]).expect(1);
    finished.shows("4 runs: 0 complete, 3 not complete, 1 failed");
    let rows = result_rows(&lab, "sweeps/big robots");
    let end = ["outcome", "hash"].map(|column| rows[3][column].as_str());
    assert_eq!(end, ["failed", ""]);
    let reason = printed_command(&finished.stderr, "run 3 failed: ");
    let kept = lab.text("sweeps/big robots/failures/3.toml");
    let head = format!("# run 3 failed: {reason}\n# alliance run 3.toml --seed 8 --in-process\n");
    assert!(kept.starts_with(&head), "{kept}");
    // There is no other failure.
    assert_eq!(lab.names("sweeps/big robots/failures"), ["3.toml"]);

    let again = printed_command(&finished.stderr, "; repeat it with: alliance ");
    let file = "sweeps/big robots/failures/3.toml";
    let options = "--seed 8 --in-process";
    assert_eq!(again, format!("run '{file}' {options}"));
    let again = lab.run(join(["run", file], options)).expect(2).stderr;
    assert!(again.trim_end().ends_with(reason), "{again}\n{reason}");
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
        lab.write("bad.toml", plan);
        entry(plan, &lab.refusal("sweep bad.toml"))
    });
    let commands = [
        "sweep nothing.toml",
        "sweep a.toml b.toml",
        "sweep plan.toml --shard 3/3",
        "sweep plan.toml --jobs 0",
        "sweep plan.toml --scenario 24",
        "sweep --merge .",
    ];
    let commands = commands.map(|command| entry(command, &lab.refusal(command)));
    assert!(!lab.exists("sweeps"));

    // A folder can contain only one sweep.
    lab.write("little.toml", "limit_s = 1.0\n");
    lab.run("sweep little.toml").expect(0);
    lab.write("little.toml", "limit_s = 2.0\n");
    let before = results(&lab.path("sweeps/little"));
    let changed = lab.refusal("sweep little.toml");
    let changed = entry("another sweep in the same folder", &changed);
    insta::assert_snapshot!(plans.concat() + &commands.concat() + &changed);
    assert_eq!(before, results(&lab.path("sweeps/little")));
}

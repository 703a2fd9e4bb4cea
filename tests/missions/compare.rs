//! `alliance compare`: its tables, runs that are killed or split into shards, and mistakes in the plan.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use nix::sys::signal::Signal;

use crate::harness::{Lab, wait_until};

/// Three allocators in two short missions under three classes of faults. The kill has another victim in the second
/// mission.
const PLAN: &str = "
question = 'Which allocator copes best?'
seeds = 4
limit_s = 120.0

[grid]
allocator = ['static', 'nearest', 'oracle']

[missions.one]
scenario = 'little.toml'
[missions.two]
scenario = 'little.toml'
set = { 'waste.spills.0.items' = 1 }

[faults.none]
[faults.gold-dies]
timeline = [{ fault.kill = 'gold', at_s = 4.0 }]
[missions.two.faults.gold-dies]
timeline = [{ fault.kill = 'blue', at_s = 4.0 }]
[faults.never]
timeline = [{ fault.kill = 'gold', at_s = 5000.0 }]

[hypotheses.not-complete-at-once]
says = 'The mission takes some time.'
faults = ['none']
at_least = 1.0
[hypotheses.complete-at-once]
says = 'The mission takes no time.'
faults = ['none']
at_most = 1.0
[hypotheses.without-effect]
says = 'A fault without an effect gives no data.'
faults = ['never']
at_least = 0.0
";

const LITTLE: &str = "
name = 'little'
robots = [{ name = 'blue', side_sensor = true }, { name = 'gold' }]
room = { width_m = 7.0, height_m = 5.0 }
[energy]
[waste]
border_known = true
spills = [{ name = 'only', items = 2 }]
";

const CELLS: usize = 2 * 3 * 3;
const SEEDS: usize = 4;

fn lab() -> Lab {
    let lab = Lab::new();
    fs::write(lab.path("plan.toml"), PLAN).unwrap();
    fs::write(lab.path("little.toml"), LITTLE).unwrap();
    lab
}

/// Returns all files of a folder except journals, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    entries
        .filter(|path| path.extension().is_some_and(|ending| ending != "jsonl"))
        .map(|path| {
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            (name, fs::read(path).unwrap())
        })
        .collect()
}

#[track_caller]
fn assert_same_files(lab: &Lab, a: &str, b: &str) {
    let (left, right) = (files(&lab.path(a)), files(&lab.path(b)));
    assert!(left.contains_key("comparison.html"), "{:?}", left.keys());
    assert_eq!(
        left.keys().collect::<Vec<_>>(),
        right.keys().collect::<Vec<_>>()
    );
    for (name, bytes) in &left {
        assert!(*bytes == right[name], "{name} of {a} and {b}");
    }
}

/// Parses a CSV table into rows by column name.
fn rows(text: &str) -> Vec<BTreeMap<String, String>> {
    let mut lines = text.lines().map(|line| line.split(','));
    let header: Vec<&str> = lines.next().unwrap().collect();
    let cells = |cells: std::str::Split<'_, char>| {
        let cells = header.iter().zip(cells);
        cells
            .map(|(name, cell)| ((*name).to_owned(), cell.to_owned()))
            .collect()
    };
    lines.map(cells).collect()
}

fn table(lab: &Lab, folder: &str, name: &str) -> Vec<BTreeMap<String, String>> {
    rows(&fs::read_to_string(lab.path(folder).join(name)).unwrap())
}

fn journal_rows(lab: &Lab, folder: &str) -> usize {
    let text = fs::read(lab.path(folder).join("journal.jsonl")).unwrap_or_default();
    let lines = text.iter().filter(|byte| **byte == b'\n').count();
    lines.saturating_sub(1)
}

#[test]
fn the_tables_match_the_runs_and_a_cell_can_be_repeated() {
    let lab = lab();
    let stderr = lab
        .run(&["compare", "plan.toml", "--out", "whole"])
        .expect(0)
        .stderr;
    assert!(stderr.contains("Which allocator copes best?"), "{stderr}");
    assert!(
        stderr.contains(
            "- No data, because the fault never hit or every run failed: static in one, never; "
        ),
        "{stderr}"
    );
    let claims =
        "1 held (not-complete-at-once), 1 failed (complete-at-once), 1 undecided (without-effect)";
    assert!(stderr.contains(claims), "{stderr}");

    // Each figure of each cell must follow from the rows of the runs.
    let runs = table(&lab, "whole", "results.csv");
    let cells = table(&lab, "whole", "cells.csv");
    assert_eq!(runs.len(), CELLS * SEEDS);
    let number = |text: &str| text.parse::<f64>().unwrap();
    let mut without_data = 0;
    for cell in &cells {
        let first: usize = cell["cell"].parse::<usize>().unwrap() * SEEDS;
        let cell_runs = &runs[first..first + SEEDS];
        for run in cell_runs {
            for column in ["mission", "faults", "allocator"] {
                assert_eq!(run[column], cell[column]);
            }
        }
        if cell["faults"] == "never" {
            assert_eq!(
                (
                    cell["not_hit"].as_str(),
                    cell["n"].as_str(),
                    cell["mean"].as_str()
                ),
                ("4", "0", "")
            );
            without_data += 1;
            continue;
        }
        let values: Vec<f64> = match cell["metric"].as_str() {
            "par2_s" => cell_runs
                .iter()
                .map(|run| {
                    if run["outcome"] == "complete" {
                        number(&run["sim_time_ms"]) / 1000.0
                    } else {
                        240.0
                    }
                })
                .collect(),
            "messages" => cell_runs
                .iter()
                .map(|run| number(&run["messages_sent"]))
                .collect(),
            "distance_m" | "energy_j" | "orphan_s" => cell_runs
                .iter()
                .map(|run| number(&run[&cell["metric"]]))
                .collect(),
            _ => continue,
        };
        let mean = values.iter().sum::<f64>() / SEEDS as f64;
        assert!(
            (number(&cell["mean"]) - mean).abs() < 1e-9 * mean.max(1.0),
            "{cell:?}"
        );
        assert!(
            number(&cell["mean_from"]) <= mean + 1e-9 && mean <= number(&cell["mean_to"]) + 1e-9
        );
    }
    assert_eq!(without_data, 2 * 3 * cells.len() / CELLS);
    for run in &runs {
        let kinds: f64 = run
            .iter()
            .filter(|(name, _)| name.ends_with("_messages"))
            .map(|(_, cell)| number(cell))
            .sum();
        let bytes: f64 = run
            .iter()
            .filter(|(name, _)| name.ends_with("_bytes"))
            .map(|(_, cell)| number(cell))
            .sum();
        assert_eq!(
            (kinds, bytes),
            (number(&run["messages_sent"]), number(&run["bytes_sent"]))
        );
        // A robot uses 5 W always and 20 W more at top speed: at most 50 W for two robots.
        let seconds = number(&run["sim_time_ms"]) / 1000.0;
        assert!(number(&run["energy_j"]) <= 50.0 * seconds + 1.0);
    }
    // The killed robot differs between the missions. With `nearest` all runs still complete.
    let of = |mission: &str, metric: &str| {
        let mut found = cells.iter().filter(|cell| {
            (
                cell["mission"].as_str(),
                cell["faults"].as_str(),
                cell["allocator"].as_str(),
                cell["metric"].as_str(),
            ) == (mission, "gold-dies", "nearest", metric)
        });
        number(&found.next().unwrap()["n"])
    };
    assert_eq!(
        (of("one", "completion"), of("two", "completion")),
        (4.0, 4.0)
    );

    // All cells use the same seeds and worlds, so the oracle has no regret against itself.
    for cell in cells
        .iter()
        .filter(|cell| cell["metric"] == "regret_s" && cell["allocator"] == "oracle")
    {
        assert!(cell["faults"] == "never" || cell["mean"] == "0", "{cell:?}");
    }
    let ranks = table(&lab, "whole", "ranks.csv");
    let of_par2 = ranks.iter().filter(|row| row["metric"] == "par2_s");
    assert_eq!(
        of_par2.map(|row| number(&row["mean_rank"])).sum::<f64>(),
        6.0
    );

    // The page needs no other file, and its links lead to the files next to it.
    let page = fs::read_to_string(lab.path("whole/comparison.html")).unwrap();
    assert!(page.find("Which allocator copes best?") < page.find("<svg "));
    assert!(
        page.contains(
            "no data: the fault never hit; repeat with: <code>alliance compare plan.toml --cell 6</code>"
        ),
        "no command"
    );
    for reference in page
        .replace("http://www.w3.org/2000/svg", "")
        .split("href=\"")
        .skip(1)
    {
        let name = reference.split('"').next().unwrap();
        assert!(lab.path("whole").join(name).is_file(), "{name}");
    }
    assert!(
        !page
            .replace("http://www.w3.org/2000/svg", "")
            .contains("http")
    );

    // The page prints this command.
    let again = lab
        .run(&["compare", "plan.toml", "--cell", "4"])
        .expect(0)
        .stdout;
    let again = rows(&again);
    assert_eq!(again.len(), SEEDS);
    for (run, again) in runs[4 * SEEDS..].iter().zip(&again) {
        assert_eq!((&run["run"], &run["hash"]), (&again["run"], &again["hash"]));
        assert_eq!(run["orphan_s"], again["orphan_s"]);
    }
}

#[test]
fn killed_in_shards_and_on_one_core_a_comparison_ends_with_the_same_bytes() {
    let lab = lab();
    let plan = PLAN.replace("seeds = 4", "seeds = 8");
    fs::write(lab.path("plan.toml"), plan).unwrap();
    lab.run(&["compare", "plan.toml", "--out", "whole"])
        .expect(0);
    let arguments = ["compare", "plan.toml", "--out", "torn", "--jobs", "1"];
    let killed = lab.start(&arguments);
    wait_until("rows", || journal_rows(&lab, "torn") >= 3);
    killed.signal(Signal::SIGKILL);
    killed.wait();
    assert!(
        journal_rows(&lab, "torn") < CELLS * 8,
        "the comparison was killed too late"
    );
    assert!(!lab.path("torn/comparison.html").exists());
    lab.run(&arguments).expect(0);
    assert_same_files(&lab, "whole", "torn");
    for shard in ["0/2", "1/2"] {
        lab.run(&["compare", "plan.toml", "--out", "parts", "--shard", shard])
            .expect(0);
    }
    lab.run(&["compare", "--merge", "parts"]).expect(0);
    assert_same_files(&lab, "whole", "parts");

    // A hypothesis must not be changed after the runs.
    fs::write(
        lab.path("plan.toml"),
        PLAN.replace("seeds = 4", "seeds = 8")
            .replace("at_most = 1.0", "at_most = 500.0"),
    )
    .unwrap();
    let stderr = lab.run(&arguments).expect(2).stderr;
    assert!(
        stderr.contains("holds another sweep, or this one before it was changed"),
        "{stderr}"
    );
}

#[test]
fn mistakes_give_one_line_before_any_run() {
    let lab = lab();
    let grid = "[grid]\nallocator = ['alliance', 'nearest']\n";
    for (plan, text) in [
        (
            String::new(),
            "a comparison needs two or more allocators, but the plan varies none; write [grid] allocator = ",
        ),
        (
            "[grid]\nallocator = ['nearest']\n".to_owned(),
            "but the plan varies one",
        ),
        (
            "[grid]\nallocator = ['nearest', 'cbab']\n".to_owned(),
            "did you mean 'cbaa'?",
        ),
        (
            "[grid]\nallocator = []\n".to_owned(),
            "bad.toml:2: grid.allocator: the list is empty",
        ),
        (
            format!("seeds = []\n{grid}"),
            "bad.toml:1: seeds: the list is empty",
        ),
        (
            format!("{grid}body.speed_m_s = [-1.0]\n"),
            "bad.toml:3: body.speed_m_s: ",
        ),
        (
            format!("{grid}[missions.a]\nscenario = 'nowhere'\n"),
            "bad.toml:4: 'nowhere' is neither a built-in scenario nor a file",
        ),
        (
            format!("{grid}[missions.a]\nset.limit_s = -1.0\n"),
            "bad.toml:4: limit_s: -1 ",
        ),
        (
            format!("{grid}[missions.a]\nrobots = 0\n"),
            "bad.toml:4: missions.a.robots: 0 is out of range; write a number from 1 to 10000",
        ),
        (
            format!("scenario = 'waste-cleanup'\n{grid}[missions.a]\n"),
            "bad.toml:1: scenario: a plan has either a scenario or [missions]",
        ),
        (
            format!("{grid}[missions.a]\n[missions.b.faults.none]\n"),
            "missions.a: the mission lacks the faults 'none' that other missions have; write [missions.a.faults.none]",
        ),
        (
            format!("{grid}[missions.a.faults.dead]\ntimeline = [{{ fault.kill = 'glod' }}]\n"),
            "bad.toml:3: faults.timeline[0].fault.kill: the scenario has no robot 'glod'; did you mean 'gold'?",
        ),
        (
            format!("{grid}[hypotheses.h]\norder = ['alliance', 'nearst']\n"),
            "line 3: hypotheses.h: there is no allocator 'nearst'; did you mean 'nearest'?",
        ),
        (
            format!("{grid}[hypotheses.h]\nmetric = 'par2'\nat_most = 1.0\n"),
            "there is no metric 'par2'; did you mean 'par2_s'?",
        ),
        (
            format!("{grid}[hypotheses.h]\nfaults = ['none']\nat_most = 1.0\n"),
            "there is no class of faults 'none'; there are none",
        ),
        (
            format!("{grid}[hypotheses.h]\nsays = 'much'\n"),
            "state one of order, at_most and at_least",
        ),
        (
            format!("limit_s = 1e8\n{grid}"),
            "use --jobs, or take a shorter limit_s, fewer robots or fewer runs",
        ),
    ] {
        fs::write(lab.path("bad.toml"), &plan).unwrap();
        let stderr = lab.run(&["compare", "bad.toml"]).expect(2).stderr;
        assert_eq!(stderr.lines().count(), 1, "{plan}: {stderr}");
        assert!(stderr.contains(text), "no '{text}': {stderr}");
    }
    let stderr = lab
        .run(&["compare", "plan.toml", "--cell", "18"])
        .expect(2)
        .stderr;
    assert!(
        stderr.contains("there is no cell 18; cells are numbered from 0 to 17"),
        "{stderr}"
    );
    assert!(!lab.path("comparisons").exists());
}

#[test]
fn the_campaigns_are_valid_plans() {
    let lab = Lab::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for (plan, runs) in [("allocators", 92_400), ("allocators-small", 1344)] {
        let file = root.join(format!("campaigns/{plan}.toml"));
        let last = (runs - 1).to_string();
        lab.run(&["compare", file.to_str().unwrap(), "--scenario", &last])
            .expect(0);
        let next = runs.to_string();
        lab.run(&["compare", file.to_str().unwrap(), "--scenario", &next])
            .expect(2);
    }
}

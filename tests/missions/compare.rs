//! `alliance compare`: its tables, and mistakes in the plan. It has the journal and the shards of `alliance sweep`.

use std::fs;
use std::path::Path;

use alliance_tests::harness::Lab;
use alliance_tests::testkit::{Row, rows};
use scenario::testkit::entry;

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

fn table(lab: &Lab, folder: &str, name: &str) -> Vec<Row> {
    rows(&fs::read(lab.path(folder).join(name)).unwrap())
}

#[test]
fn the_tables_match_the_runs_and_a_cell_can_be_repeated() {
    let lab = lab();
    let stderr = lab
        .run(&["compare", "plan.toml", "--out", "whole"])
        .expect(0)
        .stderr;
    assert!(stderr.contains("Which allocator copes best?"), "{stderr}");
    // 4 seeds cannot show a difference between 3 allocators. The command prints this before the runs, and again in the answer.
    let note = "note: with 4 seeds no difference between 3 allocators can be significant: \
                the least p value of 3 pairs per block is 0.38; use 7 seeds or more";
    assert!(
        stderr.find(note) < stderr.find("Which allocator copes best?"),
        "{stderr}"
    );
    assert!(stderr.contains(note), "{stderr}");
    assert!(
        stderr.contains("- 4 seeds are too few to show any difference within a block"),
        "{stderr}"
    );
    assert!(stderr.contains("; no data in 6 of 18 cells."), "{stderr}");
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
    // The answer and one figure come before the details.
    let (first, details) = page.split_once("<h2>Details</h2>").unwrap();
    assert_eq!(
        (
            first.matches("<li>").count(),
            first.matches("<svg ").count()
        ),
        (3, 1)
    );
    let no_data =
        "No data, because the fault never hit or every run failed: static in one, never; ";
    assert!(details.contains(no_data), "{details}");
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
    let again = rows(again.as_bytes());
    assert_eq!(again.len(), SEEDS);
    for (run, again) in runs[4 * SEEDS..].iter().zip(&again) {
        assert_eq!((&run["run"], &run["hash"]), (&again["run"], &again["hash"]));
        assert_eq!(run["orphan_s"], again["orphan_s"]);
    }
}

#[test]
fn mistakes_give_one_line_before_any_run() {
    let lab = lab();
    let grid = "[grid]\nallocator = ['alliance', 'nearest']\n";
    let plans = [
        String::new(),
        "[grid]\nallocator = ['nearest']\n".to_owned(),
        "[grid]\nallocator = ['nearest', 'cbab']\n".to_owned(),
        "[grid]\nallocator = []\n".to_owned(),
        format!("seeds = []\n{grid}"),
        format!("{grid}body.speed_m_s = [-1.0]\n"),
        format!("{grid}[missions.a]\nscenario = 'nowhere'\n"),
        format!("{grid}[missions.a]\nset.limit_s = -1.0\n"),
        format!("{grid}[missions.a]\nrobots = 0\n"),
        format!("scenario = 'waste-cleanup'\n{grid}[missions.a]\n"),
        format!("{grid}[missions.a]\n[missions.b.faults.none]\n"),
        format!("{grid}[missions.a.faults.dead]\ntimeline = [{{ fault.kill = 'glod' }}]\n"),
        format!("{grid}[hypotheses.h]\norder = ['alliance', 'nearst']\n"),
        format!("{grid}[hypotheses.h]\nmetric = 'par2'\nat_most = 1.0\n"),
        format!("{grid}[hypotheses.h]\nfaults = ['none']\nat_most = 1.0\n"),
        format!("{grid}[hypotheses.h]\nsays = 'much'\n"),
    ];
    let answers = plans.map(|plan| {
        fs::write(lab.path("bad.toml"), &plan).unwrap();
        entry(&plan, &lab.refusal(&["compare", "bad.toml"]))
    });
    // This message contains the memory of the machine.
    fs::write(lab.path("bad.toml"), format!("limit_s = 1e8\n{grid}")).unwrap();
    let too_long = lab.refusal(&["compare", "bad.toml"]);
    assert!(too_long.contains("take a shorter limit_s"), "{too_long}");
    let no_cell = lab.refusal(&["compare", "plan.toml", "--cell", "18"]);
    insta::assert_snapshot!(answers.concat() + &entry("--cell 18", &no_cell));
    assert!(!lab.path("comparisons").exists());
}

#[test]
fn the_campaigns_are_valid_plans() {
    let lab = Lab::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for (plan, runs) in [("allocators", 92_400), ("allocators-small", 1680)] {
        let file = root.join(format!("campaigns/{plan}.toml"));
        let last = (runs - 1).to_string();
        lab.run(&["compare", file.to_str().unwrap(), "--scenario", &last])
            .expect(0);
        let next = runs.to_string();
        lab.run(&["compare", file.to_str().unwrap(), "--scenario", &next])
            .expect(2);
    }
}

//! `alliance compare`: its tables, and mistakes in the plan. It has the journal and the shards of `alliance sweep`.

use alliance_tests::harness::Lab;
use alliance_tests::runs::without_allocators;
use alliance_tests::testkit::{Row, campaign, number, rows};
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
    lab.write("plan.toml", PLAN);
    lab.write("little.toml", LITTLE);
    lab
}

/// Returns a figure of a run, by the name of the metric in cells.csv.
fn figure(run: &Row, metric: &str) -> Option<f64> {
    Some(match metric {
        "par2_s" if run["outcome"] != "complete" => 240.0,
        "par2_s" => number(run, "sim_time_ms") / 1000.0,
        "done" => number(run, "items_delivered"),
        "messages" => number(run, "messages_sent"),
        "distance_m" | "energy_j" | "orphan_s" => number(run, metric),
        _ => return None,
    })
}

#[test]
fn the_tables_match_the_runs_and_a_cell_can_be_repeated() {
    let lab = lab();
    let finished = lab.run("compare plan.toml --out whole").expect(0);
    // 4 seeds cannot show a difference between 3 allocators. The command prints this before the runs, and again in the answer.
    let note = "note: with 4 seeds no difference between 3 allocators can be significant: \
                the least p value of 3 pairs per block is 0.38; use 7 seeds or more";
    let claims =
        "1 held (not-complete-at-once), 1 failed (complete-at-once), 1 undecided (without-effect)";
    finished
        .shows("Which allocator copes best?")
        .shows(note)
        .shows("- 4 seeds are too few to show any difference within a block")
        .shows("; no data in 6 of 18 cells.")
        .shows(claims);
    let stderr = &finished.stderr;
    assert!(stderr.find(note) < stderr.find("Which allocator copes best?"));

    // Each figure of each cell must follow from the rows of the runs.
    let table = |name: &str| rows(&lab.bytes(&format!("whole/{name}.csv")));
    let (runs, cells) = (table("results"), table("cells"));
    assert_eq!(runs.len(), CELLS * SEEDS);
    let mut without_data = 0;
    for cell in &cells {
        let first = number(cell, "cell") as usize * SEEDS;
        let cell_runs = &runs[first..first + SEEDS];
        for run in cell_runs {
            for column in ["mission", "faults", "allocator"] {
                assert_eq!(run[column], cell[column]);
            }
        }
        if cell["faults"] == "never" {
            let figures = ["not_hit", "n", "mean"].map(|column| cell[column].as_str());
            assert_eq!(figures, ["4", "0", ""]);
            without_data += 1;
            continue;
        }
        let values = cell_runs.iter().map(|run| figure(run, &cell["metric"]));
        let Some(values) = values.collect::<Option<Vec<f64>>>() else {
            continue;
        };
        let mean = values.iter().sum::<f64>() / SEEDS as f64;
        let difference = (number(cell, "mean") - mean).abs();
        assert!(difference < 1e-9 * mean.max(1.0), "{cell:?}");
        assert!(number(cell, "mean_from") <= mean + 1e-9, "{cell:?}");
        assert!(mean <= number(cell, "mean_to") + 1e-9, "{cell:?}");
    }
    assert_eq!(without_data, 2 * 3 * cells.len() / CELLS);
    for run in &runs {
        let sum_of = |end: &str| -> f64 {
            let columns = run.keys().filter(|name| name.ends_with(end));
            columns.map(|name| number(run, name)).sum()
        };
        assert_eq!(sum_of("_messages"), number(run, "messages_sent"));
        assert_eq!(sum_of("_bytes"), number(run, "bytes_sent"));
        // A robot uses 5 W always and 20 W more at top speed: at most 50 W for two robots.
        let seconds = number(run, "sim_time_ms") / 1000.0;
        assert!(number(run, "energy_j") <= 50.0 * seconds + 1.0);
    }
    // The killed robot differs between the missions. With `nearest` all runs still complete.
    let completed = cells.iter().filter(|cell| {
        let key = ["faults", "allocator", "metric"].map(|column| cell[column].as_str());
        key == ["gold-dies", "nearest", "completion"]
    });
    let completed: Vec<f64> = completed.map(|cell| number(cell, "n")).collect();
    assert_eq!(completed, [4.0, 4.0]);
    // All cells use the same seeds and worlds, so the oracle has no regret against itself.
    let is_regret = |cell: &&Row| cell["metric"] == "regret_s" && cell["allocator"] == "oracle";
    for cell in cells.iter().filter(is_regret) {
        assert!(cell["faults"] == "never" || cell["mean"] == "0", "{cell:?}");
    }
    let ranks = table("ranks");
    let of_par2 = ranks.iter().filter(|row| row["metric"] == "par2_s");
    assert_eq!(
        of_par2.map(|row| number(row, "mean_rank")).sum::<f64>(),
        6.0
    );

    // The page needs no other file, and its links lead to the files next to it. The answer and one figure come first, then
    // the heat maps, and then the details.
    let page = lab.text("whole/comparison.html");
    let page = page.replace("http://www.w3.org/2000/svg", "");
    assert!(!page.contains("http"));
    for reference in page.split("href=\"").skip(1) {
        let name = reference.split('"').next().unwrap();
        let is_there = match name.strip_prefix('#') {
            Some(part) => page.contains(&format!("<h2 id=\"{part}\">")),
            None => lab.path("whole").join(name).is_file(),
        };
        assert!(is_there, "{name}");
    }
    assert!(page.find("Which allocator copes best?") < page.find("<svg "));
    let (first, figures) = page.split_once("<h2 id=\"figures\">Figures</h2>").unwrap();
    let (figures, details) = figures
        .split_once("<h2 id=\"details\">Details</h2>")
        .unwrap();
    let (_, names) = figures.split_once("<figure id=\"").unwrap();
    assert!(names.starts_with("heat-"), "{figures}");
    let count = |part: &str| first.matches(part).count();
    assert_eq!((count("<li>"), count("<svg ")), (3, 1));
    let no_data =
        "No data, because the fault never hit or every run failed: static in one, never; ";
    assert!(details.contains(no_data), "{details}");
    let command = "no data: the fault never hit; repeat with: <code>alliance compare plan.toml --cell 6</code>";
    assert!(page.contains(command), "no command");

    // The page prints this command.
    let again = lab.run("compare plan.toml --cell 4").expect(0).stdout;
    let again = rows(again.as_bytes());
    assert_eq!(again.len(), SEEDS);
    for (run, again) in runs[4 * SEEDS..].iter().zip(&again) {
        for column in ["run", "hash", "orphan_s"] {
            assert_eq!(run[column], again[column]);
        }
    }
}

#[test]
fn a_dry_run_states_the_number_of_runs_and_the_power_and_creates_no_folder() {
    let lab = Lab::new();
    let plan = "seeds = 2\nlimit_s = 5.0\n[grid]\nallocator = ['cbba', 'nearest']\n";
    lab.write("two.toml", plan);
    lab.run("compare two.toml --dry-run")
        .expect(0)
        .shows("compare two: 4 runs, about ")
        .shows(", estimated from 4 runs")
        .shows("note: with 2 seeds no difference between 2 allocators can be significant");
    assert!(!lab.exists("comparisons"));
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
    let refusal = |plan: &str| {
        lab.write("bad.toml", plan);
        lab.refusal("compare bad.toml")
    };
    let answers = plans.map(|plan| entry(&plan, &refusal(&plan)));
    // This message contains the memory of the machine.
    let too_long = refusal(&format!("limit_s = 1e8\n{grid}"));
    assert!(too_long.contains("take a shorter limit_s"), "{too_long}");
    let no_cell = entry("--cell 18", &lab.refusal("compare plan.toml --cell 18"));
    insta::assert_snapshot!(without_allocators(&(answers.concat() + &no_cell)));
    assert!(!lab.exists("comparisons"));
}

#[test]
fn the_campaigns_are_valid_plans() {
    let lab = Lab::new();
    for (plan, runs) in [
        ("allocators", 49_280),
        ("allocators-small", 1680),
        ("radio", 32_000),
        ("radio-small", 162),
    ] {
        for (run, status) in [(runs - 1, 0), (runs, 2)] {
            let plan = campaign(plan);
            let run = run.to_string();
            lab.run(["compare", &plan, "--scenario", &run])
                .expect(status);
        }
    }
}

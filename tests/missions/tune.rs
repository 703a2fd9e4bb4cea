//! `alliance tune`: its results, continuation after a kill, and mistakes in the plan.

use std::fs;
use std::path::Path;

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::testkit::{Row, files, journal_rows, rows};
use nix::sys::signal::Signal;
use scenario::testkit::entry;

const PLAN: &str = "
question = 'How impatient should the robots be?'
limit_s = 120.0

[missions.one]
scenario = 'little.toml'

[faults.none]
[faults.gold-dies]
timeline = [{ fault.kill = 'gold', at_s = 4.0 }]
[faults.deaf]
timeline = [{ fault.deaf = 'gold', at_s = 4.0 }]

[tune]
budget = 60
seeds_per_candidate = 3
training = { from = 11, to = 40 }
selection = [51, 52, 53]
finalists = 2
test = 4
unseen = ['deaf']

[tune.parameters.alliance]
alliance.defaults.fast_impatience = { from = 1.0, to = 200.0, log = true }
alliance.defaults.slow_impatience = { from = 0.01, to = 0.9, log = true, times = 'alliance.defaults.fast_impatience' }
";

const LITTLE: &str = "
name = 'little'
robots = [{ name = 'blue', side_sensor = true }, { name = 'gold' }]
room = { width_m = 7.0, height_m = 5.0 }
[waste]
border_known = true
spills = [{ name = 'only', items = 2 }]
";

fn lab() -> Lab {
    let lab = Lab::new();
    fs::write(lab.path("plan.toml"), PLAN).unwrap();
    fs::write(lab.path("little.toml"), LITTLE).unwrap();
    lab
}

fn table(lab: &Lab, folder: &str, name: &str) -> Vec<Row> {
    rows(&fs::read(lab.path(folder).join(name)).unwrap())
}

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap()
}

#[test]
fn the_tuned_scenario_gives_the_figures_of_the_table() {
    let lab = lab();
    let stderr = lab
        .run(&["tune", "plan.toml", "--out", "out"])
        .expect(0)
        .stderr;
    assert!(stderr.contains("- alliance: "), "{stderr}");
    let rows = table(&lab, "out", "test.csv");
    // For both methods: all seen conditions, all unseen conditions, and three single conditions.
    assert_eq!(rows.len(), 2 * 5);
    let better = stderr.contains("better than the defaults");
    let method = if stderr.contains("found by CMA-ES") {
        "CMA-ES"
    } else {
        "random search"
    };
    let tuned = fs::read_to_string(lab.path("out/tuned.toml")).unwrap();
    assert!(tuned.starts_with("# one, none with parameters found by alliance tune plan.toml."));

    // A sweep of the defaults and of the written scenario has the same runs.
    let mean = |scenario: &str, allocator: &str| {
        let plan = format!(
            "scenario = '{scenario}'\nseeds = 4\nlimit_s = 120.0\n[grid]\nallocator = ['{allocator}']\n"
        );
        fs::write(lab.path("again.toml"), plan).unwrap();
        let _ = fs::remove_dir_all(lab.path("again"));
        lab.run(&["sweep", "again.toml", "--out", "again"])
            .expect(0);
        let runs = table(&lab, "again", "results.csv");
        let par2 = runs.iter().map(|run| {
            if run["outcome"] == "complete" {
                number(run, "sim_time_ms") / 1000.0
            } else {
                240.0
            }
        });
        par2.sum::<f64>() / 4.0
    };
    let row = rows
        .iter()
        .find(|row| row["method"] == method && row["condition"] == "one, none");
    let row = row.unwrap();
    assert!((number(row, "default") - mean("little.toml", "alliance")).abs() < 1e-9);
    let written = if better { "tuned" } else { "default" };
    assert!((number(row, written) - mean("out/tuned.toml", "alliance")).abs() < 1e-9);
    let difference = number(row, "tuned") - number(row, "default");
    assert!((number(row, "difference") - difference).abs() < 1e-9);

    // Each method uses its budget, plus at most one generation of 6 candidates with 2 conditions and 3 seeds.
    let candidates = table(&lab, "out", "candidates.csv");
    for method in ["CMA-ES", "random search"] {
        let of_method = candidates.iter().filter(|row| row["method"] == method);
        let runs: f64 = of_method.map(|row| number(row, "runs")).sum();
        assert!((60.0..60.0 + 36.0).contains(&runs), "{runs}");
    }
    let page = fs::read_to_string(lab.path("out/tuning.html")).unwrap();
    assert!(page.find("How impatient should the robots be?") < page.find("<svg "));
    assert_eq!(page.matches("<svg ").count(), 4);
    assert!(!page.contains("<script") && !page.contains("<link"));
}

#[test]
fn a_killed_or_interrupted_tuning_continues_and_ends_with_the_same_bytes() {
    let lab = lab();
    lab.run(&["tune", "plan.toml", "--out", "whole", "--jobs", "2"])
        .expect(0);
    let all = journal_rows(&lab.path("whole"));
    let arguments = ["tune", "plan.toml", "--out", "torn", "--jobs", "1"];
    for (signal, done) in [(Signal::SIGKILL, 1), (Signal::SIGINT, 4)] {
        let tuning = lab.start(&arguments);
        wait_until("batches", || journal_rows(&lab.path("torn")) >= done);
        tuning.signal(signal);
        let finished = tuning.wait();
        assert!(
            journal_rows(&lab.path("torn")) < all,
            "the tuning was interrupted too late"
        );
        assert!(!lab.path("torn/tuned.toml").exists());
        if signal == Signal::SIGINT {
            let stderr = &finished.expect(130).stderr;
            assert!(stderr.contains("of them done before"), "{stderr}");
            assert!(
                stderr.contains("alliance tune plan.toml --out torn --jobs 1"),
                "{stderr}"
            );
        }
    }
    lab.run(&arguments).expect(0);
    assert_eq!(files(&lab.path("whole")), files(&lab.path("torn")));
    // No run is repeated, and a changed plan is refused.
    lab.run(&arguments).expect(0);
    assert_eq!(files(&lab.path("whole")), files(&lab.path("torn")));
    fs::write(
        lab.path("plan.toml"),
        PLAN.replace("budget = 60", "budget = 61"),
    )
    .unwrap();
    let stderr = lab.run(&arguments).expect(2).stderr;
    assert!(
        stderr.contains("torn holds another tuning, or this one before it was changed"),
        "{stderr}"
    );
}

#[test]
fn shards_are_merged_to_the_bytes_of_the_whole() {
    let lab = lab();
    lab.run(&["tune", "plan.toml", "--out", "whole"]).expect(0);
    let shard = |number: usize| {
        let (out, part) = (format!("part-{number}"), format!("{number}/2"));
        lab.run(&["tune", "plan.toml", "--out", &out, "--shard", &part])
    };
    let stderr = shard(0).expect(0).stderr;
    let advice = "alliance tune plan.toml --merge part-0";
    assert!(stderr.contains(advice), "{stderr}");
    assert!(!lab.path("part-0/tuned.toml").exists());

    let merge = [
        "tune",
        "plan.toml",
        "--out",
        "merged",
        "--merge",
        "part-0",
        "part-1",
    ];
    let missing = lab.refusal(&merge);
    fs::create_dir(lab.path("part-1")).unwrap();
    let empty = lab.refusal(&merge);
    shard(1).expect(0);
    lab.run(&merge).expect(0);
    assert_eq!(files(&lab.path("whole")), files(&lab.path("merged")));

    // Half of a shard is no shard.
    let journal = lab.path("part-1/journal-alliance-random.jsonl");
    let text = fs::read_to_string(&journal).unwrap();
    let half: Vec<&str> = text.lines().take(text.lines().count() / 2).collect();
    fs::write(&journal, half.join("\n") + "\n").unwrap();
    fs::remove_dir_all(lab.path("merged")).unwrap();
    let unfinished = lab.refusal(&merge);
    let many = lab.refusal(&["tune", "plan.toml", "--shard", "2/3"]);
    let refusals = [missing, empty, unfinished, many];
    insta::assert_snapshot!(refusals.join("\n"));
}

#[test]
fn mistakes_give_one_line_before_any_run() {
    let lab = lab();
    let refusal = |plan: &str| {
        fs::write(lab.path("bad.toml"), plan).unwrap();
        lab.refusal(&["tune", "bad.toml"])
    };
    let changes = [
        (
            "alliance.defaults.slow_impatience",
            "alliance.defaults.sluggish",
        ),
        ("[tune.parameters.alliance]", "[tune.parameters.aliance]"),
        ("from = 1.0, to = 200.0", "from = 200.0, to = 1.0"),
        ("from = 1.0, to = 200.0", "from = 2.0, to = 2.0"),
        ("{ from = 1.0, to = 200.0, log = true }", "{ from = 1.0 }"),
        ("from = 1.0, to = 200.0", "from = -1.0, to = 200.0"),
        ("to = 0.9", "to = 1.5"),
        (
            "times = 'alliance.defaults.fast_impatience'",
            "times = 'fast'",
        ),
        ("[tune]", "[tune]\nmetric = 'par2'"),
        ("test = 4", "test = []"),
        ("test = 4\n", ""),
        ("test = 4", "test = 12"),
        ("selection = [51", "selection = [40, 51"),
        ("unseen = ['deaf']", "unseen = ['deadly']"),
        (
            "unseen = ['deaf']",
            "unseen = ['deaf', 'none', 'gold-dies']",
        ),
        ("budget = 60", "budget = 0"),
        ("seeds_per_candidate = 3", "seeds_per_candidate = 31"),
        ("question = ", "seeds = 3\nquestion = "),
        (
            "times = 'alliance.defaults.fast_impatience' }",
            "times = 'alliance.defaults.fast_impatience' }\n[tune.parameters.cbba]\n\
alliance.defaults.fast_impatience = { from = 4.0, to = 9.0 }",
        ),
    ];
    let answers = changes.map(|(from, to)| {
        assert!(PLAN.contains(from), "{from}");
        let error = refusal(&PLAN.replacen(from, to, 1));
        entry(&format!("{from:?} becomes {to:?}"), &error)
    });
    let (without_tune, _) = PLAN.split_once("[tune]").unwrap();
    let without_tune = entry("no table [tune]", &refusal(without_tune));
    // The plan of a tuning is no plan of a sweep.
    let sweep = entry("sweep plan.toml", &lab.refusal(&["sweep", "plan.toml"]));
    insta::assert_snapshot!(answers.concat() + &without_tune + &sweep);
    assert!(!lab.path("tunings").exists() && !lab.path("sweeps").exists());
}

#[test]
fn the_campaign_is_a_valid_plan() {
    let lab = Lab::new();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let plan = root.join("campaigns/tune-alliance.toml");
    // The command reads and checks the plan, and fails only at the output folder, which is a file.
    fs::write(lab.path("no folder"), "").unwrap();
    let stderr = lab
        .run(&["tune", plan.to_str().unwrap(), "--out", "no folder"])
        .expect(2)
        .stderr;
    assert!(stderr.contains("cannot make no folder"), "{stderr}");
}

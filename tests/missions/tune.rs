//! `alliance tune`: its results, continuation after a kill, and mistakes in the plan.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use nix::sys::signal::Signal;

use crate::harness::{Lab, wait_until};

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

/// Returns all files of a folder, including the journal.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap();
    let each = entries.map(|entry| {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        (name, fs::read(path).unwrap())
    });
    each.collect()
}

/// Reads a CSV file of a folder into rows by column name.
fn table(lab: &Lab, folder: &str, name: &str) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::Reader::from_path(lab.path(folder).join(name)).unwrap();
    let rows = reader.deserialize();
    rows.map(|row| row.unwrap()).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

fn lines(lab: &Lab, folder: &str) -> usize {
    let text = fs::read_to_string(lab.path(folder).join("journal.jsonl"));
    text.unwrap_or_default().lines().count()
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
    let all = lines(&lab, "whole");
    let arguments = ["tune", "plan.toml", "--out", "torn", "--jobs", "1"];
    for (signal, done) in [(Signal::SIGKILL, 2), (Signal::SIGINT, 5)] {
        let tuning = lab.start(&arguments);
        wait_until("batches", || lines(&lab, "torn") >= done);
        tuning.signal(signal);
        let finished = tuning.wait();
        assert!(
            lines(&lab, "torn") < all,
            "the tuning was interrupted too late"
        );
        assert!(!lab.path("torn/tuned.toml").exists());
        if signal == Signal::SIGINT {
            let stderr = &finished.expect(1).stderr;
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
fn mistakes_give_one_line_before_any_run() {
    let lab = lab();
    let changed = |from: &str, to: &str| {
        assert!(PLAN.contains(from), "{from}");
        PLAN.replace(from, to)
    };
    let first = "alliance.defaults.fast_impatience = {";
    for (plan, text) in [
        (
            changed(
                "alliance.defaults.slow_impatience",
                "alliance.defaults.sluggish",
            ),
            "tune.parameters.alliance: alliance.defaults.sluggish: ",
        ),
        (
            changed("[tune.parameters.alliance]", "[tune.parameters.aliance]"),
            "tune.parameters.aliance: ",
        ),
        (
            changed("from = 1.0, to = 200.0", "from = 200.0, to = 1.0"),
            "fast_impatience: the lower bound 200 is not below the upper one, 1",
        ),
        (
            changed("from = 1.0, to = 200.0", "from = 2.0, to = 2.0"),
            "the lower bound 2 is not below the upper one, 2",
        ),
        (
            changed(
                &format!("{first} from = 1.0, to = 200.0, log = true }}"),
                &format!("{first} from = 1.0 }}"),
            ),
            "fast_impatience: missing field `to`; write { from = 1.0, to = 10.0 }",
        ),
        (
            changed("from = 1.0, to = 200.0", "from = -1.0, to = 200.0"),
            "the lower bound -1 has no logarithm",
        ),
        (
            changed("to = 0.9", "to = 1.5"),
            "tune.parameters.alliance: alliance.defaults.slow_impatience: ",
        ),
        (
            changed(
                "times = 'alliance.defaults.fast_impatience'",
                "times = 'fast'",
            ),
            "it is a multiple of 'fast', which is none of the parameters above it",
        ),
        (
            changed("[tune]", "[tune]\nmetric = 'par2'"),
            "tune.metric: there is no metric 'par2' to tune by; did you mean 'par2_s'?",
        ),
        (
            changed("test = 4", "test = []"),
            "tune.test: there are no test seeds",
        ),
        (
            changed("test = 4\n", ""),
            "bad.toml:14: tune.test: the key is missing; give it a value",
        ),
        (
            changed("test = 4", "test = 12"),
            "tune.test: seed 11 also belongs to training",
        ),
        (
            changed("selection = [51", "selection = [40, 51"),
            "tune.selection: seed 40 also belongs to training",
        ),
        (
            changed("unseen = ['deaf']", "unseen = ['deadly']"),
            "tune.unseen: there is no class of faults 'deadly'",
        ),
        (
            changed(
                "unseen = ['deaf']",
                "unseen = ['deaf', 'none', 'gold-dies']",
            ),
            "tune.unseen: no class of faults is left for the search",
        ),
        (
            changed("budget = 60", "budget = 0"),
            "tune.budget: 0 is out of range",
        ),
        (
            changed("seeds_per_candidate = 3", "seeds_per_candidate = 31"),
            "31 are more than the 30 training seeds",
        ),
        (
            format!("seeds = 3\n{PLAN}"),
            "seeds: [tune] states the seeds",
        ),
        (
            format!(
                "{PLAN}[tune.parameters.cbba]\nalliance.defaults.fast_impatience = {{ from = 4.0, to = 9.0 }}\n"
            ),
            "is also tuned for alliance, but one scenario contains both",
        ),
        (
            PLAN.split("[tune]").next().unwrap().to_owned(),
            "the plan has no search; write a table [tune]",
        ),
    ] {
        fs::write(lab.path("bad.toml"), &plan).unwrap();
        let stderr = lab.run(&["tune", "bad.toml"]).expect(2).stderr;
        assert_eq!(stderr.lines().count(), 1, "{plan}: {stderr}");
        assert!(stderr.contains(text), "no '{text}': {stderr}");
    }
    // The plan of a tuning is no plan of a sweep.
    let stderr = lab.run(&["sweep", "plan.toml"]).expect(2).stderr;
    assert!(
        stderr.contains("this is a plan for alliance tune"),
        "{stderr}"
    );
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

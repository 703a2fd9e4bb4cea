//! `alliance tune`: its results, continuation after a kill, and mistakes in the plan.

use std::fs;

use alliance_tests::harness::{Lab, wait_until};
use alliance_tests::runs::without_allocators;
use alliance_tests::testkit::{Row, campaign, files, journal_rows, number, rows};
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
    lab.write("plan.toml", PLAN);
    lab.write("little.toml", LITTLE);
    lab
}

fn table(lab: &Lab, name: &str) -> Vec<Row> {
    rows(&lab.bytes(name))
}

/// Returns the mean PAR2 of four runs in a sweep, in s.
fn mean_par2_s(lab: &Lab, scenario: &str) -> f64 {
    let out = scenario.replace('/', "-");
    let plan = format!(
        "scenario = '{scenario}'\nseeds = 4\nlimit_s = 120.0\n[grid]\nallocator = ['alliance']\n"
    );
    lab.write("again.toml", plan);
    lab.run(format!("sweep again.toml --out again-{out}"))
        .expect(0);
    let runs = table(lab, &format!("again-{out}/results.csv"));
    let par2 = runs.iter().map(|run| match run["outcome"].as_str() {
        "complete" => number(run, "sim_time_ms") / 1000.0,
        _ => 240.0,
    });
    par2.sum::<f64>() / 4.0
}

/// Checks that page and scenario mark a found value of the impatience within 2 % of a bound, on the logarithmic scale
/// from 1 to 200.
#[track_caller]
fn assert_bounds_are_marked(page: &str, tuned: &str, is_better: bool) {
    let head = "<td class=\"text\">alliance.defaults.fast_impatience</td>";
    let (_, cells) = page.split_once(head).unwrap();
    let cells = cells.split("<td>").skip(1).take(2);
    let cells: Vec<&str> = cells.filter_map(|cell| cell.split('<').next()).collect();
    for cell in cells.iter().copied() {
        let (value, mark) = cell.split_once(", ").unwrap_or((cell, ""));
        let share = value.parse::<f64>().unwrap().ln() / 200_f64.ln();
        let expected = match share {
            share if share <= 0.02 => "at its lower bound",
            share if share >= 0.98 => "at its upper bound",
            _ => "",
        };
        assert_eq!(mark, expected, "{value}");
        if is_better && !mark.is_empty() && tuned.contains(&format!("impatience = {value},")) {
            let line = format!("impatience = {value}, of 1 to 200, logarithmic, {mark}\n");
            assert!(tuned.contains(&line), "{tuned}");
        }
    }
    // Large values are the best ones in this mission, so that the test sees a mark.
    assert!(
        cells.iter().any(|cell| cell.contains(", at its ")),
        "{cells:?}"
    );
}

#[test]
fn the_tuned_scenario_gives_the_figures_of_the_table() {
    let lab = lab();
    let stderr = lab.run("tune plan.toml --out out").expect(0).stderr;
    assert!(stderr.contains("- alliance: "), "{stderr}");
    let rows = table(&lab, "out/test.csv");
    // For both methods: all seen conditions, all unseen conditions, and three single conditions.
    assert_eq!(rows.len(), 2 * 5);
    let method = match stderr.contains("found by CMA-ES") {
        true => "CMA-ES",
        false => "random search",
    };
    let written = match stderr.contains("better than the defaults") {
        true => "tuned",
        false => "default",
    };
    let tuned = lab.text("out/tuned.toml");
    let title = "# one, none with parameters found by alliance tune plan.toml.";
    assert!(tuned.starts_with(title));

    // A sweep of the defaults and of the written scenario has the same runs.
    let is_row = |row: &&Row| row["method"] == method && row["condition"] == "one, none";
    let row = rows.iter().find(is_row).unwrap();
    let difference = number(row, "tuned") - number(row, "default");
    for (column, expected) in [
        ("default", mean_par2_s(&lab, "little.toml")),
        (written, mean_par2_s(&lab, "out/tuned.toml")),
        ("difference", difference),
    ] {
        assert!((number(row, column) - expected).abs() < 1e-9, "{column}");
    }

    // Each method uses its budget, plus at most one generation of 6 candidates with 2 conditions and 3 seeds.
    let candidates = table(&lab, "out/candidates.csv");
    for method in ["CMA-ES", "random search"] {
        let of_method = candidates.iter().filter(|row| row["method"] == method);
        let runs: f64 = of_method.map(|row| number(row, "runs")).sum();
        assert!((60.0..60.0 + 36.0).contains(&runs), "{runs}");
    }
    let page = lab.text("out/tuning.html");
    assert!(page.find("How impatient should the robots be?") < page.find("<svg "));
    assert_eq!(page.matches("<svg ").count(), 4);
    assert_bounds_are_marked(&page, &tuned, written == "tuned");
    assert!(!page.contains("<script") && !page.contains("<link"));
}

#[test]
fn a_killed_or_interrupted_tuning_continues_and_ends_with_the_same_bytes() {
    let lab = lab();
    lab.run("tune plan.toml --out whole --jobs 2").expect(0);
    let [whole, torn] = ["whole", "torn"].map(|folder| lab.path(folder));
    let all = journal_rows(&whole);
    let command = "tune plan.toml --out torn --jobs 1";
    for (signal, done) in [(Signal::SIGKILL, 1), (Signal::SIGINT, 4)] {
        let tuning = lab.start(command);
        wait_until("batches", || journal_rows(&torn) >= done);
        tuning.signal(signal);
        let finished = tuning.wait();
        assert!(journal_rows(&torn) < all, "interrupted too late");
        assert!(!lab.exists("torn/tuned.toml"));
        if signal == Signal::SIGINT {
            let finished = finished.expect(130);
            finished.shows("of them done before");
            finished.shows(&format!("alliance {command}"));
        }
    }
    // The second start repeats no run.
    for _ in 0..2 {
        lab.run(command).expect(0);
        assert_eq!(files(&whole), files(&torn));
    }
    lab.write("plan.toml", PLAN.replace("budget = 60", "budget = 61"));
    let changed = lab.run(command).expect(2);
    changed.shows("torn holds another tuning, or this one before it was changed");
}

#[test]
fn shards_are_merged_to_the_bytes_of_the_whole() {
    let lab = lab();
    lab.run(["tune", "plan.toml", "--out", "whole"]).expect(0);
    let shard = |number: usize| {
        let (out, part) = (format!("part-{number}"), format!("{number}/2"));
        lab.run(["tune", "plan.toml", "--out", &out, "--shard", &part])
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
    let missing = lab.refusal(merge);
    fs::create_dir(lab.path("part-1")).unwrap();
    let empty = lab.refusal(merge);
    shard(1).expect(0);
    lab.run(merge).expect(0);
    assert_eq!(files(&lab.path("whole")), files(&lab.path("merged")));

    // Half of a shard is no shard.
    let journal = lab.path("part-1/journal-alliance-random.jsonl");
    let text = fs::read_to_string(&journal).unwrap();
    let half: Vec<&str> = text.lines().take(text.lines().count() / 2).collect();
    fs::write(&journal, half.join("\n") + "\n").unwrap();
    fs::remove_dir_all(lab.path("merged")).unwrap();
    let unfinished = lab.refusal(merge);
    let many = lab.refusal(["tune", "plan.toml", "--shard", "2/3"]);
    let refusals = [missing, empty, unfinished, many];
    insta::assert_snapshot!(refusals.join("\n"));
}

#[test]
fn mistakes_give_one_line_before_any_run() {
    let lab = lab();
    let refusal = |plan: &str| {
        lab.write("bad.toml", plan);
        lab.refusal("tune bad.toml")
    };
    let unseen = "unseen = ['deaf']";
    let range = "from = 1.0, to = 200.0";
    let times = "times = 'alliance.defaults.fast_impatience'";
    let of_another = format!(
        "{times} }}\n[tune.parameters.cbba]\n\
         alliance.defaults.fast_impatience = {{ from = 4.0, to = 9.0 }}"
    );
    let changes = [
        (
            "alliance.defaults.slow_impatience",
            "alliance.defaults.sluggish",
        ),
        ("[tune.parameters.alliance]", "[tune.parameters.aliance]"),
        (range, "from = 200.0, to = 1.0"),
        (range, "from = 2.0, to = 2.0"),
        ("{ from = 1.0, to = 200.0, log = true }", "{ from = 1.0 }"),
        (range, "from = -1.0, to = 200.0"),
        ("to = 0.9", "to = 1.5"),
        (times, "times = 'fast'"),
        ("[tune]", "[tune]\nmetric = 'par2'"),
        ("test = 4", "test = []"),
        ("test = 4\n", ""),
        ("test = 4", "test = 12"),
        ("selection = [51", "selection = [40, 51"),
        (unseen, "unseen = ['deadly']"),
        (unseen, "unseen = ['deaf', 'none', 'gold-dies']"),
        ("budget = 60", "budget = 0"),
        ("seeds_per_candidate = 3", "seeds_per_candidate = 31"),
        ("question = ", "seeds = 3\nquestion = "),
        (&*format!("{times} }}"), &*of_another),
    ];
    let answers = changes.map(|(from, to)| {
        assert!(PLAN.contains(from), "{from}");
        let error = refusal(&PLAN.replacen(from, to, 1));
        entry(&format!("{from:?} becomes {to:?}"), &error)
    });
    let (without_tune, _) = PLAN.split_once("[tune]").unwrap();
    let without_tune = entry("no table [tune]", &refusal(without_tune));
    // The plan of a tuning is no plan of a sweep.
    let sweep = entry("sweep plan.toml", &lab.refusal("sweep plan.toml"));
    let all = answers.concat() + &without_tune + &sweep;
    insta::assert_snapshot!(without_allocators(&all));
    assert!(!lab.exists("tunings") && !lab.exists("sweeps"));
}

#[test]
fn the_campaign_is_a_valid_plan() {
    let lab = Lab::new();
    // The command reads and checks the plan, and fails only at the output folder, which is a file.
    lab.write("no folder", "");
    let plan = campaign("tune-alliance");
    let tune = lab.run(["tune", &plan, "--out", "no folder"]).expect(2);
    tune.shows("cannot make no folder");
}

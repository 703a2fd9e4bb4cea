//! The suites stay as they are, and a forged result is refuted.

use std::num::NonZeroUsize;
use std::sync::OnceLock;

use missions::Registry;
use scenario::testkit::check_generated;
use world_server::mission_args::Known;

use super::check::{check_content, check_program, refuted, sample};
use super::result::{BenchResult, BenchRun};
use super::suite::{SUITES, Suite, SuitePlan};
use super::table::{insert, markdown};
use crate::sweep::run::{Row, execute_run};
use crate::workers::run_parallel;

/// A suite of 16 short runs with two allocators.
const TINY: Suite = Suite {
    name: "tiny",
    text: "
seeds = [3, 4]
limit_s = 20.0
[missions.visit]
scenario = 'janitorial'
[missions.watch]
scenario = 'cmommt-crowded'
[faults.none]
[faults.loss]
timeline = [{ fault.drop.p = 0.5 }]
",
};

const JOBS: NonZeroUsize = NonZeroUsize::new(2).unwrap();

fn known() -> Known {
    Known {
        vocabulary: Registry::built_in().vocabulary(),
        worlds: Registry::built_in().worlds().clone(),
    }
}

fn plan() -> SuitePlan {
    let allocators = ["nearest", "cbba"].map(str::to_owned);
    TINY.plan(&allocators, &known()).unwrap()
}

/// Returns the rows of these runs, in order.
fn rows(plan: &SuitePlan, runs: &[usize]) -> Vec<Row> {
    let mut rows = Vec::new();
    let attempt = |run, stops: &dyn Fn() -> bool| execute_run(&plan.plan, run, stops);
    run_parallel(runs, JOBS, &|| false, attempt, |row| {
        rows.push(row);
        Ok(())
    })
    .unwrap();
    rows.sort_by_key(|row| row.run);
    rows
}

/// Returns the result of all runs of the tiny suite.
fn result() -> BenchResult {
    static RESULT: OnceLock<BenchResult> = OnceLock::new();
    let make = || {
        let plan = plan();
        let runs: Vec<usize> = (0..plan.runs()).collect();
        BenchResult::new(&plan, None, &rows(&plan, &runs)).unwrap()
    };
    RESULT.get_or_init(make).clone()
}

/// Returns the lines of a check with this share of repeated runs. An intact result has none.
fn check(result: &BenchResult, share: f64) -> Vec<String> {
    let plan = plan();
    let checked = check_program("r.json", result, None);
    if let Err(problem) = checked.and_then(|()| check_content("r.json", result, &plan)) {
        return vec![problem.to_string()];
    }
    let repeated = rows(&plan, &sample(result, share));
    let lines = repeated
        .iter()
        .filter_map(|row| refuted(result, &plan, row));
    lines.collect()
}

/// A suite never changes. If a digest differs, then restore the missions of the suite, or write a new suite.
#[test]
fn the_suites_are_frozen() {
    let digests = SUITES.iter().map(|suite| {
        let plan = suite.plan(&["alliance".to_owned()], &known()).unwrap();
        (suite.name, plan.runs(), plan.digest)
    });
    let digests: Vec<(&str, usize, String)> = digests.collect();
    assert_eq!(digests, [("v1", 180, "3422a07664335dbf".to_owned())]);
}

#[test]
fn the_digest_of_a_suite_depends_on_missions_faults_and_seeds_only() {
    let digest = |text: &'static str, allocator: &str| {
        let suite = Suite { text, ..TINY };
        suite
            .plan(&[allocator.to_owned()], &known())
            .unwrap()
            .digest
    };
    let changed = |from: &str, to: &str| &*TINY.text.replace(from, to).leak();
    assert_eq!(digest(TINY.text, "nearest"), digest(TINY.text, "cbba"));
    for (from, to) in [
        ("limit_s = 20.0", "limit_s = 21.0"),
        ("p = 0.5", "p = 0.6"),
        ("[3, 4]", "[3, 5]"),
        ("missions.watch", "missions.look"),
        ("faults.loss", "faults.lost"),
        (
            "'janitorial'",
            "'janitorial'\nset = { body.speed_m_s = 0.6 }",
        ),
    ] {
        let other = digest(changed(from, to), "nearest");
        assert_ne!(other, digest(TINY.text, "nearest"), "{to}");
    }
}

#[test]
fn an_intact_result_survives_json_and_all_repetitions() {
    let result = result();
    let text = serde_json::to_string_pretty(&result).unwrap();
    let read: BenchResult = serde_json::from_str(&text).unwrap();
    assert_eq!(read, result);
    assert_eq!(check(&read, 1.0), Vec::<String>::new());
}

/// A change of the file after the runs, and the part of the line that reports it.
type Forgery = (fn(&mut BenchResult), &'static str);

#[test]
fn a_changed_file_gives_one_line_without_a_repetition() {
    let forgeries: [Forgery; 12] = [
        (
            |forged| forged.runs[1].value = Some(0.5),
            "r.json: the content has the digest ",
        ),
        (
            |forged| forged.runs[1].hash = "0123456789abcdef".to_owned(),
            "r.json: the content has the digest ",
        ),
        (
            |forged| forged.digest = "0123456789abcdef".to_owned(),
            "but the result states 0123456789abcdef; the result was changed after the runs",
        ),
        (
            |forged| drop(forged.runs.remove(1)),
            "runs[1] is (visit, none, cbba, seed 3), but tiny has (visit, none, nearest, seed 4) there",
        ),
        (
            |forged| drop(forged.runs.pop()),
            "runs[15] is missing: (watch, loss, cbba, seed 4); a result contains each run",
        ),
        (
            |forged| forged.runs.push(forged.runs[0].clone()),
            "runs[16] is (visit, none, nearest, seed 3), but tiny has only 16 runs",
        ),
        (
            |forged| forged.runs[0].seed = 9,
            "runs[0] is (visit, none, nearest, seed 9), but",
        ),
        (
            |forged| forged.allocators.swap(0, 1),
            "r.json: the content has the digest ",
        ),
        (
            |forged| forged.suite_digest = "0123456789abcdef".to_owned(),
            "in the result; a suite never changes: run the published one",
        ),
        (
            |forged| forged.version = "0.0.1".to_owned(),
            "r.json: version 0.0.1 (build ) made this result, and this is version ",
        ),
        (
            |forged| forged.controllers = Some("0123456789abcdef".to_owned()),
            "the result has controllers in Python; name their files with --controller",
        ),
        (
            |forged| forged.runs[2].messages += 1,
            "r.json: the content has the digest ",
        ),
    ];
    for (forge, expected) in forgeries {
        let mut forged = result();
        forge(&mut forged);
        let lines = check(&forged, 1.0);
        assert_eq!(lines.len(), 1, "{lines:?}");
        assert!(lines[0].contains(expected), "{expected}: {lines:?}");
    }
}

/// The forger also updates the digest. Only a repetition of the run refutes it.
#[test]
fn a_forged_run_with_a_new_digest_is_refuted_by_its_repetition() {
    let forgeries: [Forgery; 5] = [
        (
            |forged| forged.runs[5].value = Some(0.5),
            "value is 0.5, but ",
        ),
        (|forged| forged.runs[5].bytes -= 1, "bytes is "),
        (|forged| forged.runs[5].messages += 1, "messages is "),
        (
            |forged| forged.runs[5].hash.replace_range(15.., "g"),
            "g, but ",
        ),
        (
            |forged| forged.runs[5].outcome = proto::tick::Outcome::Complete,
            "outcome is complete, but time-limit when repeated",
        ),
    ];
    for (forge, expected) in forgeries {
        let mut forged = result();
        forge(&mut forged);
        forged.digest = forged.content_digest();
        let lines = check(&forged, 1.0);
        assert_eq!(lines.len(), 1, "{lines:?}");
        let place = "runs[5] (visit, loss, nearest, seed 4): ";
        assert!(lines[0].starts_with(place), "{lines:?}");
        assert!(lines[0].contains(expected), "{expected}: {lines:?}");
    }
}

#[test]
fn the_content_chooses_a_share_of_each_allocator_at_least_one_run() {
    let result = result();
    let of = |result: &BenchResult, share: f64, allocator: &str| {
        let sample = sample(result, share);
        let runs = sample
            .iter()
            .filter(|run| result.runs[**run].allocator == allocator);
        runs.count()
    };
    for (share, expected) in [(0.01, 1), (0.25, 2), (0.3, 3), (1.0, 8)] {
        for allocator in ["nearest", "cbba"] {
            assert_eq!(of(&result, share, allocator), expected, "{share}");
        }
    }
    // Over many contents every run is chosen.
    let chosen: std::collections::BTreeSet<usize> = (0..200)
        .flat_map(|change| {
            let mut changed = result.clone();
            changed.runs[0].bytes = change;
            changed.digest = changed.content_digest();
            sample(&changed, 0.01)
        })
        .collect();
    assert_eq!(chosen.len(), 16);
}

/// More is better in both missions. `cbba` does more except in one condition of four.
#[test]
fn the_table_ranks_allocators_by_the_means_of_their_conditions() {
    let mut result = result();
    for (number, run) in result.runs.iter_mut().enumerate() {
        let is_nearest = run.allocator == "nearest";
        let value = match (number / 4, is_nearest) {
            (0, true) => 5.0,
            (0, false) => 10.0,
            (1, true) => 6.0,
            (1, false) => 4.0,
            (_, true) => 0.25,
            (_, false) => 0.5,
        };
        *run = BenchRun {
            value: Some(value),
            bytes: 1500,
            outcome: match number % 8 {
                0..4 => proto::tick::Outcome::Complete,
                _ => proto::tick::Outcome::TimeLimit,
            },
            ..run.clone()
        };
    }
    let text = markdown(&result, &plan());
    let rows: Vec<&str> = text.lines().skip(2).collect();
    // Ranks of cbba: 1, 2, 1, 1.
    assert_eq!(
        rows,
        [
            "| allocator | mean rank | complete | visit, done | watch, observed | kB |",
            "|---|--:|--:|--:|--:|--:|",
            "| `cbba` | 1.25 | 50 % | 7.000 | 0.500 | 1.5 |",
            "| `nearest` | 1.75 | 50 % | 5.500 | 0.250 | 1.5 |",
        ]
    );
    let document =
        "a\n<!-- bench tiny -->\nold\n<!-- end -->\nb\n<!-- bench v1 -->\n<!-- end -->\n";
    let with_new = insert(document, "tiny", "new\n").unwrap();
    assert_eq!(insert(document, "v2", "new"), None);
    assert_eq!(
        with_new,
        "a\n<!-- bench tiny -->\n\nnew\n\n<!-- end -->\nb\n<!-- bench v1 -->\n<!-- end -->\n"
    );
    assert_eq!(insert(&with_new, "tiny", "new\n"), Some(with_new));
}

#[test]
fn the_published_schema_is_up_to_date() {
    let mut schema = schemars::schema_for!(BenchResult).to_value();
    schema["title"] = "Result of alliance bench".into();
    check_generated("docs/bench.schema.json", &format!("{schema:#}\n"));
}

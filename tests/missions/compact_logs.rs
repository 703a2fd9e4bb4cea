//! Compact logs contain every row of a full log, bit by bit, in random runs of all allocators with faults.

use alliance_tests::harness::Lab;
use alliance_tests::runs::vocabulary;
use analysis::diff::{Comparison, compare};
use analysis::replay::replay;
use run_log::{LogLevel, MotivationRow, RunLog, Table};

use crate::figures::random_run;

#[track_caller]
fn assert_same_rows(full: &RunLog, compact: &RunLog, seed: u64) {
    for table in Table::ALL
        .into_iter()
        .filter(|table| *table != Table::Ticks)
    {
        let (rows, recovered) = (
            String::from_utf8_lossy(full.table(table)),
            compact.full_table(table, None).unwrap(),
        );
        let recovered = String::from_utf8_lossy(&recovered);
        let mut lines = rows.lines().zip(recovered.lines()).enumerate();
        let different = lines.find(|(_, (row, recovered))| row != recovered);
        assert_eq!(different, None, "seed {seed}: {}", table.file_name());
        assert_eq!(
            rows.len(),
            recovered.len(),
            "seed {seed}: {}",
            table.file_name()
        );
    }
}

/// Seeds select missions and allocators in turn, so that these runs contain each allocator with each mission.
#[test]
fn every_row_of_a_full_log_is_recovered_to_the_bit() {
    let (mut rows, mut written) = (0, 0);
    let known = vocabulary();
    for seed in 0..(known.missions.len() * known.allocators.len()) as u64 {
        let first = random_run(seed);
        if first.last.is_none() {
            continue;
        }
        // The fault fuzzer records no messages of allocators, and a replay does.
        let (_, full) = replay(&first, LogLevel::Full, |_| {}).unwrap();
        let (memory, compact) = replay(&full, LogLevel::Compact, |_| {}).unwrap();
        assert_eq!(compact.run.hash, full.run.hash);
        assert_same_rows(&full, &compact, seed);
        let comparison = compare(&full, &compact).unwrap();
        let is_identical = matches!(comparison, Comparison::Identical { .. });
        assert!(is_identical, "seed {seed}: {comparison}");
        let lines = |text: &[u8]| text.iter().filter(|byte| **byte == b'\n').count();
        rows += lines(full.table(Table::Motivations));
        written += lines(&memory.tables[&Table::Motivations]);
    }
    assert!(rows > 50_000, "{rows} rows");
    assert!(written * 20 < rows, "{written} of {rows} rows are written");
}

/// All commands accept a compact log, which is the default, and a full one.
#[test]
fn commands_read_both_forms() {
    let lab = Lab::new();
    lab.mission("compact", "--in-process --limit 60").expect(1);
    lab.mission("full", "--in-process --limit 60 --log full")
        .expect(1);
    let [compact, full] = ["compact", "full"].map(|run| lab.log(run));
    assert_eq!(
        (compact.run.log, full.run.log),
        (LogLevel::Compact, LogLevel::Full)
    );
    assert_eq!(
        compact.rows::<MotivationRow>().unwrap(),
        full.rows::<MotivationRow>().unwrap()
    );
    let size = |run: &str| -> usize {
        let names = lab.names(run).into_iter();
        let tables = names.filter(|name| name.ends_with(".csv"));
        tables
            .map(|name| lab.bytes(&format!("{run}/{name}")).len())
            .sum()
    };
    let [small, large] = ["compact", "full"].map(size);
    assert!(4 * small < large, "{small} and {large} bytes");
    for (a, b) in [("compact", "full"), ("full", "compact")] {
        let identical = lab.run(["diff", a, b]).expect(0);
        assert!(
            identical.answer().starts_with("identical: 1200 ticks"),
            "{}",
            identical.stderr
        );
    }
    let same = lab.run(["diff", "full", "full"]).expect(2);
    same.shows("full and full are the same run; name two runs");
    for run in ["compact", "full"] {
        let identical = lab.run(["replay", run, "--out", "again"]).expect(0);
        assert!(
            identical.answer().starts_with("identical"),
            "{}",
            identical.stderr
        );
        lab.assert_same_bytes(run, "again");
        std::fs::remove_dir_all(lab.path("again")).unwrap();
        lab.run(["report", run, "--out", &format!("{run}-report")])
            .expect(0);
        lab.run(["export", run, "--parquet"]).expect(0);
    }
    // The rest of the page names the command and its time.
    let figures = |run: &str| -> Vec<String> {
        let page = lab.text(&format!("{run}-report/report.html"));
        let figures = page.split("<svg").skip(1);
        let figures = figures.map(|figure| figure.split("</svg>").next().unwrap().to_owned());
        figures.collect()
    };
    assert!(figures("full").len() > 10);
    assert!(figures("compact") == figures("full"));
}

/// Commands that need the tables of a summary run the mission again. This one takes some seconds of processor time.
#[test]
fn a_report_of_a_summary_says_that_it_runs_the_mission_again() {
    let lab = Lab::new();
    let run = "run foraging --in-process --log summary --limit 1200 --out run";
    lab.run(run).expect(1);
    let report = lab.run("report run").expect(0);
    let first = report.stderr.lines().next().unwrap();
    let announcement = "the log is a summary: running it again";
    assert!(first.starts_with(announcement), "{}", report.stderr);
}

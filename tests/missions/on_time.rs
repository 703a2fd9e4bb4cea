//! The default parameters: progress reports are on time, and the mission is not longer because of them.

use missions::Registry;
use missions::waste::data::WasteFigures;
use proto::tick::Outcome;
use run_log::{Document, Figures, LogLevel, RunFile};

use crate::in_process::run;
use crate::story::setup;

const NAME: &str = "waste-cleanup";
/// The limit of lateness: a quarter of the report period.
const LATE_MS: u64 = 30_000;

#[track_caller]
fn assert_on_time(figures: &Figures) {
    let figures = WasteFigures::from_figures(&figures.mission);
    assert!(figures.reports_made >= 2);
    assert!(figures.report_lateness_max_ms.unwrap() < LATE_MS);
}

#[test]
fn reports_are_on_time_with_a_hundred_seeds() {
    let mut total_s = 0.0;
    for seed in 1..=100 {
        let (outcome, recorder) = run(setup(NAME, seed), LogLevel::Off);
        assert_eq!(outcome, Outcome::Complete, "seed {seed}");
        let memory = recorder.into_sink();
        let file = RunFile::parse(
            memory.documents[&Document::Run].as_bytes(),
            &Registry::built_in().vocabulary(),
        )
        .unwrap();
        println!("seed {seed}");
        assert_on_time(&file.result);
        total_s += file.result.sim_time_ms.as_secs_f64();
    }
    assert!(total_s / 100.0 < 340.0, "{total_s} s for 100 missions");
}

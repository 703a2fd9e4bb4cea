//! The default parameters: progress reports are on time, and the mission is not longer because of them.

use alliance_tests::runs::{builtin, log_of, run, setup};
use missions::waste::data::WasteFigures;
use proto::tick::Outcome;
use run_log::LogLevel;

#[test]
fn reports_are_on_time_with_a_hundred_seeds() {
    const SEEDS: u64 = 100;
    let mut total_s = 0.0;
    for seed in 1..=SEEDS {
        let (outcome, recorder) = run(setup(builtin("waste-cleanup"), seed), LogLevel::Off);
        assert_eq!(outcome, Outcome::Complete, "seed {seed}");
        let result = log_of(recorder).run.result;
        let figures = WasteFigures::from_figures(&result.mission);
        assert!(figures.reports_made >= 2, "seed {seed}");
        // The limit is a quarter of the report period.
        let late_ms = figures.report_lateness_max_ms.unwrap();
        assert!(late_ms < 30_000, "seed {seed}: {late_ms} ms");
        total_s += result.sim_time_ms.as_secs_f64();
    }
    assert!(total_s / (SEEDS as f64) < 340.0, "{total_s} s");
}

//! The memory check before the first run.

use std::fs;
use std::num::NonZeroUsize;

use anyhow::bail;
use scenario::Setup;

use terminal::counted;

/// Bytes per robot and tick: log rows and the data derived from them. [`SET_TICK`] adds the bytes per behavior set.
const ROBOT_TICK: f64 = 300.0;
const SET_TICK: f64 = 130.0;

/// Bytes per received message. Each robot receives about one message per second from each teammate.
const HEARD: f64 = 150.0;

/// Bytes per row. All rows are in memory at the end.
const ROW: f64 = 4000.0;

/// Returns an upper bound of the bytes of a run that reaches its limit.
#[must_use]
pub fn of_a_run(setup: &Setup) -> f64 {
    let scenario = &setup.scenario;
    let ticks = scenario.limit_s * 1000.0 / scenario.step_ms as f64;
    let sets = scenario.robots.iter();
    let sets: usize = sets
        .map(|robot| setup.catalog.behaviors_of(robot).count())
        .sum();
    let robots = scenario.robots.len() as f64;
    ticks * (robots * ROBOT_TICK + sets as f64 * SET_TICK)
        + scenario.limit_s * robots * robots * HEARD
}

/// Checks that memory suffices for `jobs` concurrent runs of the largest size and for all rows.
pub fn check(of_a_run: f64, jobs: NonZeroUsize, runs: usize) -> anyhow::Result<()> {
    match available() {
        Some(there) => check_against(there, of_a_run, jobs, runs),
        None => Ok(()),
    }
}

fn check_against(there: f64, of_a_run: f64, jobs: NonZeroUsize, runs: usize) -> anyhow::Result<()> {
    let needed = of_a_run * jobs.get() as f64 + ROW * runs as f64;
    if needed > there {
        let gb = |bytes: f64| bytes / 1e9;
        bail!(
            "{} at a time may need {:.1} GB each and all rows {:.1} GB, but only {:.1} GB are available; use --jobs, or take a shorter limit_s, fewer robots or fewer runs",
            counted(jobs.get(), "run"),
            gb(of_a_run),
            gb(ROW * runs as f64),
            gb(there)
        );
    }
    Ok(())
}

/// Returns the available memory in bytes, or `None` if the operating system does not report it.
fn available() -> Option<f64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text
        .lines()
        .find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024.0)
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_setup;

    use super::*;

    #[test]
    fn concurrent_runs_and_all_rows_must_fit() {
        let mut setup = default_setup(1);
        setup.scenario.limit_s = 1200.0;
        // 24,000 ticks of 3 robots, blue with 5 sets and the others with 4, and 9 links for 1,200 s.
        let one = of_a_run(&setup);
        assert_eq!(
            one,
            24_000.0 * (3.0 * 300.0 + 13.0 * 130.0) + 1200.0 * 9.0 * 150.0
        );
        let jobs = NonZeroUsize::new(2).unwrap();
        let all = 2.0 * one + 4000.0 * 100.0;
        assert!(check_against(all, one, jobs, 100).is_ok());
        let error = check_against(all - 1.0, one, jobs, 100)
            .unwrap_err()
            .to_string();
        assert!(
            error.starts_with("2 runs at a time may need 0.1 GB each"),
            "{error}"
        );
    }
}

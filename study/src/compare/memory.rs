//! Whether there is room for the runs, before any of them begins.

use std::fs;
use std::num::NonZeroUsize;

use alliance_proto::scenario::Setup;
use anyhow::bail;

/// Bytes of a robot in a tick, and of each of its behavior sets: rows in the log that a run is measured by, and what is made of them.
/// Seen with 4 sets: 780.
const ROBOT_TICK: f64 = 300.0;
const SET_TICK: f64 = 130.0;

/// Bytes of a message that a robot hears, of which there is about one each second from each teammate.
const HEARD: f64 = 150.0;

/// Bytes of a row, which are all there at the end.
const ROW: f64 = 4000.0;

/// At most, for a run that goes on up to its limit.
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

/// # Errors
/// When so many runs side by side, of which the largest takes so many bytes, and the rows of all need more than there is.
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
            "{jobs} runs side by side may need {:.1} GB each and all rows {:.1} GB, and there are {:.1} GB; use --jobs, or take a shorter limit_s, fewer robots or fewer runs",
            gb(of_a_run),
            gb(ROW * runs as f64),
            gb(there)
        );
    }
    Ok(())
}

/// Bytes that the operating system can still give; `None` where it does not say.
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
    fn runs_side_by_side_and_all_rows() {
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
        let said = check_against(all - 1.0, one, jobs, 100)
            .unwrap_err()
            .to_string();
        assert!(
            said.starts_with("2 runs side by side may need 0.1 GB each"),
            "{said}"
        );
    }
}

//! Prints rates and ratios from the estimates of criterion.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::ROUND;

/// Prints, for each measured team, robot steps per second and core, and the ratios to the world alone and to a run
/// without a log.
pub fn print(teams: &[usize]) {
    println!(
        "\n{:>7} {:>22} {:>22} {:>22} {:>22} {:>10} {:>12} {:>9}",
        "robots",
        "world alone",
        "log off",
        "summary",
        "full",
        "off/world",
        "summary/off",
        "full/off"
    );
    for &robots in teams {
        let columns = ["world", "off", "summary", "full"];
        let read = |column: &&str| Times::read("robots", robots, column);
        let times: Vec<Option<Times>> = columns.iter().map(read).collect();
        let [world, off, summary, full] = times.as_slice() else {
            continue;
        };
        let cell = |times: &Option<Times>| {
            times
                .as_ref()
                .map_or("-".to_owned(), |times| times.rates(robots))
        };
        let ratio = |a: &Option<Times>, b: &Option<Times>| match (a, b) {
            (Some(a), Some(b)) => format!("{:.2}", a.median_ns / b.median_ns),
            _ => "-".to_owned(),
        };
        println!(
            "{robots:>7} {:>22} {:>22} {:>22} {:>22} {:>10} {:>12} {:>9}",
            cell(world),
            cell(off),
            cell(summary),
            cell(full),
            // Ratio of rates: the share of the world's rate that is left.
            ratio(world, off),
            ratio(summary, off),
            ratio(full, off),
        );
    }
    println!(
        "robot-steps per second and core, median [95 % interval]; off/world: share of the rate that is left; others: cost"
    );
}

/// Prints, for each item of a group, robot steps per second and core in each team size.
///
/// The cost is the time of a step in the largest team divided by that in the smallest.
pub fn print_each(group: &str, names: &[&str], teams: &[usize]) {
    let heads: String = teams.iter().map(|team| format!(" {team:>25}")).collect();
    println!("\n{:>16}{heads} {:>9}", group, "cost");
    for name in names {
        let times: Vec<_> = teams
            .iter()
            .map(|&team| Some((team, Times::read(group, team, name)?)))
            .collect();
        let cells: String = times
            .iter()
            .map(|measured| {
                let cell = measured.as_ref().map(|(team, times)| times.rates(*team));
                format!(" {:>25}", cell.unwrap_or_else(|| "-".to_owned()))
            })
            .collect();
        let per_step = |(team, times): &(usize, Times)| times.median_ns / *team as f64;
        let cost = match (times.first(), times.last()) {
            (Some(Some(least)), Some(Some(most))) => {
                format!("{:.1}", per_step(most) / per_step(least))
            }
            _ => "-".to_owned(),
        };
        println!("{name:>16}{cells} {cost:>9}");
    }
    println!(
        "robot-steps per second and core, by robots; cost: time of a step in the largest team / in the smallest"
    );
}

/// The time of a round with its 95 % interval.
struct Times {
    median_ns: f64,
    low_ns: f64,
    high_ns: f64,
}

impl Times {
    fn read(group: &str, robots: usize, column: &str) -> Option<Self> {
        let group = format!("{group}_{robots}");
        let file: PathBuf = [&target()?, Path::new("criterion"), Path::new(&group)]
            .iter()
            .collect();
        let file = file.join(column).join("new/estimates.json");
        let estimates: Value = serde_json::from_slice(&std::fs::read(file).ok()?).ok()?;
        let median = &estimates["median"];
        let interval = &median["confidence_interval"];
        Some(Self {
            median_ns: median["point_estimate"].as_f64()?,
            low_ns: interval["lower_bound"].as_f64()?,
            high_ns: interval["upper_bound"].as_f64()?,
        })
    }

    fn rates(&self, robots: usize) -> String {
        let steps = (robots as u64 * ROUND) as f64;
        let rate = |round_ns: f64| steps * 1e9 / round_ns / 1e3;
        format!(
            "{:.0}k [{:.0} .. {:.0}]",
            rate(self.median_ns),
            rate(self.high_ns),
            rate(self.low_ns)
        )
    }
}

/// Returns the target folder of cargo, from the path of this program in `release/deps`.
fn target() -> Option<PathBuf> {
    let exe = std::env::current_exe().ok()?;
    exe.ancestors().nth(3).map(Path::to_owned)
}

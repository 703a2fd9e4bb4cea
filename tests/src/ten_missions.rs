//! Default missions in a row with L-ALLIANCE (docs/allocators/l-alliance.md). The first one starts with wrong
//! estimates, and each mission continues with the learned times of the previous one.

use in_process::Team;
use missions::Registry;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog};
use scenario::{LearnedTimes, Profile, Scenario, Setup};

use crate::testkit::ROBOTS;

/// The duration of a unit of each task in s, as estimated by `alliance check`.
const UNITS_S: [(&str, f64); 4] = [
    ("find-locations", 25.0),
    ("move-spill(top)", 26.0),
    ("move-spill(bottom)", 26.0),
    ("report-progress", 20.0),
];

#[derive(Clone, Debug)]
pub struct Mission {
    /// The makespan in s.
    pub took_s: f64,
    pub learned: Profile,
}

/// Runs the default mission with additional scenario lines to its end.
///
/// # Panics
/// Panics if the mission cannot be run or is not completed.
#[must_use]
#[allow(clippy::unwrap_used)] // Documented above.
pub fn mission(lines: &str, seed: u64, profile: Profile) -> Mission {
    let known = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("ten-missions.toml", lines, &known).unwrap();
    let setup = Setup {
        profile,
        ..Setup::resolve(scenario, seed, None).unwrap().setup
    };
    let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
    let outcome = team
        .continue_for(u64::MAX, Outcome::TimeLimit, |_| {})
        .unwrap();
    assert_eq!(outcome, Outcome::Complete, "seed {seed}: {lines}");
    let learned = team.learned();
    let (run, _) = team.end(outcome).unwrap();
    Mission {
        took_s: run.result.sim_time_ms.as_secs_f64(),
        learned,
    }
}

/// Runs missions with the ten seeds from `first` on, in a row.
#[must_use]
pub fn ten(lines: &str, first: u64, begin: Profile) -> Vec<Mission> {
    let mut missions: Vec<Mission> = Vec::new();
    for seed in first..first + 10 {
        let profile = missions.last().map_or(&begin, |before| &before.learned);
        missions.push(mission(lines, seed, profile.clone()));
    }
    missions
}

/// Returns a profile in which all estimates are wrong by `factor`.
#[must_use]
pub fn wrong_by(factor: f64) -> Profile {
    let tasks = UNITS_S.map(|(task, unit_s)| {
        let known = LearnedTimes {
            trials: 7,
            latest_s: vec![unit_s * factor; 7],
        };
        let of = ROBOTS.map(|robot| (robot.to_owned(), known.clone()));
        (task.to_owned(), of.into())
    });
    let robots = ROBOTS.map(|robot| (robot.to_owned(), tasks.clone().into()));
    Profile {
        robots: robots.into(),
    }
}

/// Returns the factor by which robots are wrong about their own times, as geometric mean over robots and tasks.
/// `reference` contains the learned reference times.
///
/// The search is excluded, because its trials differ too much.
///
/// # Panics
/// Panics if a robot has no time of a task.
#[must_use]
pub fn error(profile: &Profile, reference: &Profile) -> f64 {
    let mean_s = |profile: &Profile, robot: &str, task: &str| {
        profile.robots[robot][task][robot].mean_and_deviation_s().0
    };
    let tasks = &UNITS_S[1..];
    let errors = ROBOTS.iter().flat_map(|robot| {
        tasks.iter().map(|(task, _)| {
            let ratio = mean_s(profile, robot, task) / mean_s(reference, robot, task);
            ratio.ln().abs()
        })
    });
    let count = (ROBOTS.len() * tasks.len()) as f64;
    (errors.sum::<f64>() / count).exp()
}

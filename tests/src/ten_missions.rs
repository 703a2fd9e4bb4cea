//! Default missions in a row, in which L-ALLIANCE begins with bad values and each goes on with what the one before has taught
//! (docs/allocators/l-alliance.md).

use alliance_proto::log::{LogLevel, Memory};
use alliance_proto::scenario::{KnownTimes, Profile, Scenario, Setup};
use alliance_proto::tick::Outcome;
use in_process::Team;
use missions::Registry;

const ROBOTS: [&str; 3] = ["blue", "gold", "green"];

/// A unit of each task's work, s, as `alliance check` estimates it.
const UNITS_S: [(&str, f64); 4] = [
    ("find-locations", 25.0),
    ("move-spill(top)", 26.0),
    ("move-spill(bottom)", 26.0),
    ("report-progress", 20.0),
];

/// A mission that is over.
#[derive(Clone, Debug)]
pub struct Mission {
    /// When it was complete, s.
    pub took_s: f64,
    /// What its robots know then.
    pub learned: Profile,
}

/// The default mission with these lines in its scenario file, to its end.
///
/// # Panics
/// When it cannot be run, or is not completed.
#[must_use]
#[allow(clippy::unwrap_used)] // As documented.
pub fn mission(lines: &str, seed: u64, profile: Profile) -> Mission {
    let known = Registry::built_in().vocabulary();
    let scenario = Scenario::parse("ten-missions.toml", lines, &known).unwrap();
    let setup = Setup {
        profile,
        ..Setup::resolve(scenario, seed, None).unwrap().setup
    };
    let mut team = Team::new(setup, LogLevel::Off, Memory::default()).unwrap();
    let outcome = team
        .go_on_for(u64::MAX, Outcome::TimeLimit, |_| {})
        .unwrap();
    assert_eq!(outcome, Outcome::Complete, "seed {seed}: {lines}");
    let learned = team.learned();
    let (run, _) = team.end(outcome).unwrap();
    Mission {
        took_s: run.result.sim_time_ms.as_secs_f64(),
        learned,
    }
}

/// Those of ten seeds from `first` on, one after the other.
#[must_use]
pub fn ten(lines: &str, first: u64, begin: Profile) -> Vec<Mission> {
    let mut done: Vec<Mission> = Vec::new();
    for seed in first..first + 10 {
        let profile = done.last().map_or(&begin, |before| &before.learned);
        done.push(mission(lines, seed, profile.clone()));
    }
    done
}

/// All believe of all that they need so many units for each.
#[must_use]
pub fn wrong_by(factor: f64) -> Profile {
    let tasks = UNITS_S.map(|(task, unit_s)| {
        let known = KnownTimes {
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

/// By which factor robots are wrong about what they themselves need, in the geometric mean over robots and tasks but the search, whose
/// trials differ too much among themselves; `truth` is what they would have learned.
///
/// # Panics
/// When one of them knows nothing of a task.
#[must_use]
pub fn error(profile: &Profile, truth: &Profile) -> f64 {
    let mean_s = |profile: &Profile, robot: &str, task: &str| {
        profile.robots[robot][task][robot].mean_and_deviation_s().0
    };
    let tasks = &UNITS_S[1..];
    let errors = ROBOTS.iter().flat_map(|robot| {
        tasks.iter().map(|(task, _)| {
            let ratio = mean_s(profile, robot, task) / mean_s(truth, robot, task);
            ratio.ln().abs()
        })
    });
    let count = (ROBOTS.len() * tasks.len()) as f64;
    (errors.sum::<f64>() / count).exp()
}

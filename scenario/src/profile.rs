//! Learned times that robots bring into a run and take from it. A profile is an input of a run, like its scenario.
//!
//! ```toml
//! [blue."push(left)"]                                 # the times that blue has learned for this task
//! blue = { trials = 12, latest_s = [21.3, 19.8] }     # by the robot that needed them
//! gold = { trials = 1, latest_s = [40.25] }
//! ```

use std::collections::BTreeMap;
use std::fmt::Write;

use serde::{Deserialize, Serialize};

use super::error::Problem;
use super::limits::{TIME, check_known};
use super::path::KeyPath;
use super::toml_file::TomlFile;
use super::{Catalog, Robot, Scenario, Vocabulary};

/// The times that the robots of a team have learned for each robot and task, at the start or the end of a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Profile {
    /// The learned times by the robot that learned them.
    pub robots: BTreeMap<String, LearnedTimesByTask>,
}

/// The learned times of one robot: by task, then by the robot that needed them.
pub type LearnedTimesByTask = BTreeMap<String, BTreeMap<String, LearnedTimes>>;

/// The stored trials of one robot on one task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedTimes {
    /// The number of trials so far.
    pub trials: u32,
    /// The durations of the latest trials, oldest first, s.
    pub latest_s: Vec<f64>,
}

impl LearnedTimes {
    /// The maximum number of stored trials.
    pub const MAX_TRIALS: usize = 100;

    /// Returns the mean of the latest durations and their standard deviation, s (n - 1; 0 for one trial).
    #[must_use]
    pub fn mean_and_deviation_s(&self) -> (f64, f64) {
        let count = self.latest_s.len() as f64;
        let mean = self.latest_s.iter().sum::<f64>() / count;
        let errors = self.latest_s.iter().map(|time_s| time_s - mean);
        let squares = errors.map(|error| error * error);
        let variance = squares.sum::<f64>() / (count - 1.0).max(1.0);
        (mean, variance.sqrt())
    }

    fn check(&self, at: &KeyPath) -> Result<(), Problem> {
        let latest_at = at.key("latest_s");
        let count = self.latest_s.len();
        if !(1..=Self::MAX_TRIALS).contains(&count) {
            let remedy = format!("give 1 to {}", Self::MAX_TRIALS);
            return Err(Problem::at(latest_at, format!("{count} times"), remedy));
        }
        for (index, time_s) in self.latest_s.iter().enumerate() {
            TIME.check(latest_at.index(index), *time_s)?;
        }
        if (self.trials as usize) < count {
            let what = format!("{} is less than the {count} of latest_s", self.trials);
            return Err(Problem::at(
                at.key("trials"),
                what,
                format!("it must be {count} or more"),
            ));
        }
        Ok(())
    }
}

impl Profile {
    /// Reads a profile for the robots of a scenario; `file_name` is for error messages.
    ///
    /// # Errors
    /// Returns the first mistake: invalid TOML, an unknown robot or task, a robot whose allocator does not learn, or a
    /// time out of range.
    pub fn parse(
        file_name: &str,
        text: &str,
        scenario: &Scenario,
        vocabulary: &Vocabulary,
    ) -> Result<Self, Problem> {
        let file = TomlFile::parse(file_name, text)?;
        let profile: Self = file.deserialize()?;
        let checked = profile.check(scenario, &Catalog::new(scenario), vocabulary);
        checked.map_err(|problem| file.locate(problem))?;
        Ok(profile)
    }

    /// Returns true if no robot has learned a time.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.robots.is_empty()
    }

    /// Rejects entries that do not fit the scenario's robots and tasks.
    pub(super) fn check(
        &self,
        scenario: &Scenario,
        catalog: &Catalog,
        vocabulary: &Vocabulary,
    ) -> Result<(), Problem> {
        for (name, tasks) in &self.robots {
            let at = KeyPath::default().key(name);
            let robot = scenario.find_robot(&at, name)?;
            let allocator = scenario.decider_of(robot);
            if !vocabulary.learns(allocator) {
                let what = format!("the allocator of {name} is {allocator}, which learns nothing");
                return Err(Problem::at(at, what, "leave the robot out"));
            }
            for (task, times) in tasks {
                let at = at.key(task);
                check_task(robot, task, catalog, &at)?;
                for (of, times) in times {
                    let at = at.key(of);
                    scenario.find_robot(&at, of)?;
                    times.check(&at)?;
                }
            }
        }
        Ok(())
    }

    /// Returns the text of the file, with mean and standard deviation as a comment after each list.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = "# Learned times, read and written by `alliance run --profile`. [ROBOT.TASK] is what ROBOT knows of TASK, with a line for each robot\n\
             # whose trials it has seen: how many there were, and how long the latest took, from the oldest on, s.\n"
            .to_owned();
        for (robot, tasks) in &self.robots {
            for (task, times) in tasks {
                let table = KeyPath::new([robot, task]);
                // Writing to a string cannot fail.
                let _ = writeln!(text, "\n[{table}]");
                for (of, times) in times {
                    let (mean_s, deviation_s) = times.mean_and_deviation_s();
                    let LearnedTimes { trials, latest_s } = times;
                    let key = KeyPath::new([of]);
                    let _ = writeln!(
                        text,
                        "{key} = {{ trials = {trials}, latest_s = {latest_s:?} }} # mean {mean_s:.1} s, deviation {deviation_s:.1} s"
                    );
                }
            }
        }
        text
    }
}

fn check_task(robot: &Robot, task: &str, catalog: &Catalog, at: &KeyPath) -> Result<(), Problem> {
    let Some(id) = catalog.find_task(task) else {
        let tasks = catalog.tasks.iter().map(|task| task.name.as_str());
        return check_known(at, "the scenario has no task", task, tasks);
    };
    let mut behaviors = catalog.behaviors_of(robot);
    if !behaviors.any(|behavior| catalog.sets[behavior.index()].task == id) {
        let what = format!("{} has no behavior for the task '{task}'", robot.name);
        return Err(Problem::at(at, what, "leave the task out"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{refusals, unlike_robots, vocabulary};
    use crate::{AllocatorSpec, Setup, SetupFile};

    const LEARNER: &str = "learner";

    /// Returns a team of blue, which has all skills and learns, and gold, which finds, reports and uses ALLIANCE.
    fn team() -> (Scenario, Vocabulary) {
        let mut scenario = unlike_robots().scenario;
        scenario.robots[0].allocator = Some(LEARNER.to_owned());
        let mut vocabulary = vocabulary();
        vocabulary.allocators.push(AllocatorSpec {
            name: LEARNER,
            learns_times: true,
            ..AllocatorSpec::alliance()
        });
        (scenario, vocabulary)
    }

    fn read(text: &str) -> Result<Profile, String> {
        let (scenario, vocabulary) = team();
        let read = Profile::parse("p.toml", text, &scenario, &vocabulary);
        read.map_err(|error| error.to_string())
    }

    #[test]
    fn a_file_that_was_written_is_read_back() {
        let known = |trials, latest_s: &[f64]| LearnedTimes {
            trials,
            latest_s: latest_s.to_vec(),
        };
        let top = [
            ("blue".to_owned(), known(12, &[0.1 + 0.2, 1e-3, 41.0 / 3.0])),
            ("gold".to_owned(), known(1, &[1e9])),
        ];
        let tasks = [
            ("move(top)".to_owned(), top.clone().into()),
            ("find".to_owned(), top.into()),
        ];
        let profile = Profile {
            robots: [("blue".to_owned(), tasks.into())].into(),
        };
        let text = profile.to_toml();
        assert_eq!(read(&text).unwrap(), profile, "{text}");
        let json = serde_json::to_string(&profile).unwrap();
        assert_eq!(serde_json::from_str::<Profile>(&json).unwrap(), profile);
    }

    /// Checks that the profile of a run.json is validated.
    #[test]
    fn a_setup_contains_the_profile() {
        let (scenario, vocabulary) = team();
        let mut setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let through_json = |setup: &Setup| {
            let file: SetupFile =
                serde_json::from_str(&serde_json::to_string(setup).unwrap()).unwrap();
            file.read(&vocabulary).map_err(|error| error.to_string())
        };
        assert!(!serde_json::to_string(&setup).unwrap().contains("profile"));
        let text = "blue.find.gold = { trials = 2, latest_s = [0.3] }";
        setup.profile = read(text).unwrap();
        assert_eq!(through_json(&setup).unwrap(), setup);
        let known = setup.profile.robots.remove("blue").unwrap();
        setup.profile.robots.insert("blu".to_owned(), known);
        assert_eq!(
            through_json(&setup).unwrap_err(),
            "profile.blu: the scenario has no robot 'blu'; did you mean 'blue'? (there are blue, gold)"
        );
    }

    #[test]
    fn hand_written_profiles_are_accepted() {
        let profile = read("blue.find.gold = { trials = 2, latest_s = [40] }").unwrap();
        let times = &profile.robots["blue"]["find"]["gold"];
        assert_eq!((times.trials, &times.latest_s[..]), (2, &[40.0][..]));
        assert!(read("").unwrap().is_empty());
    }

    #[test]
    fn mistakes_are_reported_with_their_line() {
        let texts = [
            "[blu.find]\nblue = { trials = 1, latest_s = [1.0] }",
            "[blue.find]\nred = { trials = 1, latest_s = [1.0] }",
            "[blue.fynd]\nblue = { trials = 1, latest_s = [1.0] }",
            "[gold.find]\ngold = { trials = 1, latest_s = [1.0] }",
            "[blue.find]\nblue = { trials = 2, latest_s = [3.0, -1.0] }",
            "[blue.find]\nblue = { trials = 2, latest_s = [nan] }",
            "\n[blue.find]\nblue = { trials = 1, latest_s = [3.0, 1.0] }",
            "[blue.find]\nblue = { trials = 1, latest_s = [] }",
            "[blue.find]\nblue = { trials = 1 }",
            "[blue.find]\nblue = { trials = -1, latest_s = [1.0] }",
            "[blue.find]\nblue = 7",
        ];
        insta::assert_snapshot!(refusals("p.toml", texts, read));
        let (mut scenario, vocabulary) = team();
        scenario.robots[1].allocator = Some(LEARNER.to_owned());
        let text = "[gold.'move(top)']\ngold = { trials = 1, latest_s = [1.0] }";
        let error = Profile::parse("p.toml", text, &scenario, &vocabulary).unwrap_err();
        assert_eq!(
            error.to_string(),
            "p.toml:1: gold.\"move(top)\": gold has no behavior for the task 'move(top)'; leave the task out"
        );
    }
}

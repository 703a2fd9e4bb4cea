//! Resolution of a scenario and a parameter file into every ALLIANCE value in force.
//!
//! Statements are applied from the weakest to the strongest (see [`AllianceSection`](super::AllianceSection)). Within a
//! layer, the plain value comes before the values for named teammates.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use super::alliance::{Alliance, BehaviorParams, ByTeammate, RobotParams};
use super::catalog::Catalog;
use super::error::{Problem, nearest};
use super::geometry::check_places;
use super::properties::{ParameterFile, SkippedKey};
use super::roster::Roster;
use super::statement::{Statement, THRESHOLD, statements};
use super::validate::validate;
use super::values::Values;
use super::{Profile, Scenario, Setup};

/// A complete setup, and the unused keys of the parameter file.
#[derive(Clone, Debug, PartialEq)]
pub struct Resolved {
    pub setup: Setup,
    /// The keys of the parameter file whose robot, teammate or set the scenario lacks, in the file's order.
    pub skipped: Vec<SkippedKey>,
}

impl Setup {
    /// Fills in every value that the scenario and the parameter file leave open. The profile is empty.
    ///
    /// # Errors
    /// Returns the first mistake in the scenario, or the first rule of ALLIANCE.md §1 that the values in force violate.
    pub fn resolve(
        mut scenario: Scenario,
        seed: u64,
        parameters: Option<&ParameterFile>,
    ) -> Result<Resolved, Problem> {
        scenario.apply_team_defaults();
        let catalog = Catalog::new(&scenario);
        let (alliance, skipped) = check(&scenario, &catalog, parameters)?;
        let setup = Self {
            seed,
            alliance,
            profile: Profile::default(),
            step_order: scenario.step_order(),
            catalog: Arc::new(catalog),
            roster: Arc::new(Roster::new(&scenario.robots)),
            scenario,
        };
        Ok(Resolved { setup, skipped })
    }

    /// Returns the total number of behavior sets of all robots.
    #[must_use]
    pub fn behavior_sets(&self) -> usize {
        behavior_sets(&self.scenario, &self.catalog)
    }
}

/// Replaces values by equal ones that another set has, if they are among the latest. A large team has few different ones.
fn share(values: &mut ByTeammate, latest: &mut VecDeque<ByTeammate>) {
    const KEPT: usize = 16;
    match latest.iter().find(|known| *known == values) {
        Some(known) => *values = Arc::clone(known),
        None => {
            latest.truncate(KEPT - 1);
            latest.push_front(Arc::clone(values));
        }
    }
}

/// Checks a whole scenario, and its values together with those of the parameter file.
pub(super) fn check(
    scenario: &Scenario,
    catalog: &Catalog,
    parameters: Option<&ParameterFile>,
) -> Result<(Alliance, Vec<SkippedKey>), Problem> {
    validate(scenario, catalog)?;
    check_places(scenario)?;

    let section = &scenario.alliance;
    let mut threshold = section.threshold;
    THRESHOLD.check(["alliance", "threshold"], threshold)?;
    let mut layers = statements(section);
    for statement in &layers {
        statement.check()?;
    }
    let from_file = layers.len();
    if let Some(file) = parameters {
        threshold = file.threshold().unwrap_or(threshold);
        layers.extend(file.statements());
    }

    let mut used = vec![false; layers.len()];
    let teammates = Toward::of(scenario, catalog, &layers);
    let mut robots = BTreeMap::new();
    let mut latest = VecDeque::new();
    for (rank, robot) in scenario.robots.iter().enumerate() {
        let mut sets = BTreeMap::new();
        for id in catalog.behaviors_of(robot) {
            let set = &catalog.sets[id.index()];
            let built_in = catalog
                .mission
                .default_alliance_params(scenario, robot, set);
            let mut values = Values::built_in(built_in, teammates.of_robot(&robot.name));
            for (number, statement) in layers.iter().enumerate() {
                let applies = |wanted: &Option<String>, name: &str| {
                    wanted.as_deref().is_none_or(|wanted| wanted == name)
                };
                if applies(&statement.robot, &robot.name) && applies(&statement.set, &set.name) {
                    used[number] |= values.apply(statement, number);
                }
            }
            values.check(&layers, &robot.name, &set.name)?;
            let task = catalog.task_name(set.task).to_owned();
            let mut params = values.into_params(task);
            share(&mut params.slow_impatience, &mut latest);
            share(&mut params.willing_to_affect_s, &mut latest);
            sets.insert(set.name.clone(), params);
        }
        // `validate` has checked that a scenario has at most `MAX_ROBOTS` robots.
        let rank = rank as u32;
        robots.insert(robot.name.clone(), RobotParams { rank, sets });
    }

    let mut skipped = Vec::new();
    let from_file = layers.iter().zip(used).skip(from_file);
    for (statement, _) in from_file.filter(|(_, used)| !used) {
        misspelt(statement, scenario, catalog)?;
        skipped.extend(SkippedKey::from_place(&statement.place));
    }
    skipped.sort_by_key(|key| key.line);
    let alliance = Alliance {
        threshold,
        step_ms: scenario.step_ms,
        switches: section.switches.applied_to(section.preset.switches()),
        robots: Arc::new(robots),
    };
    Ok((alliance, skipped))
}

/// Rejects a key of a parameter file that misspells a robot or a behavior set. Other unused keys are allowed, because a
/// file may serve several scenarios.
fn misspelt(statement: &Statement, scenario: &Scenario, catalog: &Catalog) -> Result<(), Problem> {
    let sets = || catalog.sets.iter().map(|set| set.name.as_str());
    let robots = || scenario.robots.iter().map(|robot| robot.name.as_str());
    let (set, robot, teammate) = (&statement.set, &statement.robot, &statement.teammate);
    let slips = [
        ("behavior set", set, nearly(set, sets())),
        ("robot", robot, nearly(robot, robots())),
        ("robot", teammate, nearly(teammate, robots())),
    ];
    for (what, name, near) in slips {
        if let (Some(name), Some(near)) = (name, near) {
            let what = format!("the scenario has no {what} '{name}'");
            let remedy = format!("did you mean '{near}'?");
            return Err(Problem::new(statement.place.clone(), what, remedy));
        }
    }
    Ok(())
}

/// Returns the most similar known name, unless the name itself is known.
fn nearly<'a>(
    name: &Option<String>,
    known: impl Iterator<Item = &'a str> + Clone,
) -> Option<&'a str> {
    let name = name.as_deref()?;
    let is_known = known.clone().any(|known| known == name);
    nearest(name, known).filter(|_| !is_known)
}

/// The teammates for which each robot has its own values. A small team lists all of them. In a large team the values
/// would grow with the square of its size. It lists only the teammates that a statement names, and
/// [`BehaviorParams::OTHERS`].
struct Toward<'a>(BTreeSet<&'a str>);

pub(super) fn behavior_sets(scenario: &Scenario, catalog: &Catalog) -> usize {
    let robots = scenario.robots.iter();
    robots
        .map(|robot| catalog.behaviors_of(robot).count())
        .sum()
}

/// Returns true if each robot has its own values for each teammate.
pub(super) fn lists_all_teammates(scenario: &Scenario, catalog: &Catalog) -> bool {
    let robots = &scenario.robots;
    robots.len() <= Toward::MOST_LISTED
        && robots.len() * behavior_sets(scenario, catalog) <= Toward::MOST_VALUES
}

impl<'a> Toward<'a> {
    /// The maximum number of robots that list each other. With a few sets each, they need about 1 MB of JSON.
    const MOST_LISTED: usize = 100;
    /// The maximum number of values that a team lists, for robots with many sets.
    const MOST_VALUES: usize = 100_000;

    fn of(scenario: &'a Scenario, catalog: &Catalog, statements: &'a [Statement]) -> Self {
        let names = || scenario.robots.iter().map(|robot| robot.name.as_str());
        if lists_all_teammates(scenario, catalog) {
            return Self(names().collect());
        }
        let known: BTreeSet<&str> = names().collect();
        let named = statements
            .iter()
            .filter_map(|statement| statement.teammate.as_deref());
        let named = named.filter(|name| known.contains(name));
        Self(named.chain([BehaviorParams::OTHERS]).collect())
    }

    fn of_robot(&self, robot: &str) -> impl Iterator<Item = &'a str> {
        self.0.iter().copied().filter(move |name| *name != robot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{default_scenario, default_setup};

    #[test]
    fn default_scenario_resolves() {
        let alliance = default_setup(1).alliance;
        assert_eq!(alliance.threshold, 100.0);
        let blue = &alliance.robots["blue"];
        assert_eq!(blue.sets["move(top)"].slow_impatience["gold"], 0.5);
    }

    /// Checks the listed teammates: up to 100 have their own values; beyond that, only named ones and an entry for the
    /// others.
    #[test]
    fn a_large_team_lists_only_named_teammates() {
        let mut scenario = Scenario {
            robots: (0..=Toward::MOST_LISTED)
                .map(|rank| crate::Robot {
                    name: format!("r{rank}"),
                    ..crate::Robot::default()
                })
                .collect(),
            ..default_scenario()
        };
        let toward = BTreeMap::from([("r7".to_owned(), 0.25)]);
        scenario.alliance.defaults.slow_impatience_toward = toward;
        let resolved = Setup::resolve(scenario.clone(), 1, None).unwrap().setup;
        let report = &resolved.alliance.robots["r0"].sets["report"];
        let listed: Vec<&String> = report.slow_impatience.keys().collect();
        assert_eq!(listed, [BehaviorParams::OTHERS, "r7"]);
        assert_eq!(report.slow_impatience_toward("r7"), 0.25);
        assert_eq!(report.slow_impatience_toward("r8"), 1.0);
        // A robot is not its own teammate.
        let named = &resolved.alliance.robots["r7"].sets["report"];
        assert_eq!(named.slow_impatience.len(), 1);

        scenario.robots.pop();
        let resolved = Setup::resolve(scenario, 1, None).unwrap().setup;
        let report = &resolved.alliance.robots["r0"].sets["report"];
        assert_eq!(report.slow_impatience.len(), Toward::MOST_LISTED - 1);
        assert!(!report.slow_impatience.contains_key(BehaviorParams::OTHERS));
    }
}

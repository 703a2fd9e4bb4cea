//! Warnings about valid parameters that contradict each other.

use std::collections::{BTreeMap, HashMap};

use scenario::{BehaviorParams, BehaviorSpec, Setup};
use serde::Serialize;

use super::forecast::Forecast;

/// A warning about a behavior set of one or more robots.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Warning {
    pub kind: WarningKind,
    #[serde(rename = "behavior_set")]
    pub set: String,
    pub robots: Vec<String>,
    /// The values and their consequence.
    pub text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum WarningKind {
    /// ψ is shorter than a unit of work.
    YieldsTooEarly,
    /// λ is shorter than a unit of work.
    GivesUpTooEarly,
    /// λ is shorter than the φ of teammates toward the robot.
    PatienceUnused,
    /// τ is shorter than two periods of 1/ρ.
    SilenceTooShort,
    /// The report period is too short for ψ and λ.
    ReportsLate,
}

/// Returns all warnings, by set in catalog order, then by rule.
#[must_use]
pub fn warnings(setup: &Setup, forecasts: &[Forecast]) -> Vec<Warning> {
    let catalog = &setup.catalog;
    let sets = catalog.sets.iter().enumerate();
    let places: HashMap<&str, usize> = sets
        .map(|(place, set)| (set.name.as_str(), place))
        .collect();
    let recurring = Recurring::new(setup);
    let mut found: BTreeMap<(usize, WarningKind, String), Vec<String>> = BTreeMap::new();
    for forecast in forecasts {
        let Some(&place) = places.get(forecast.set.as_str()) else {
            continue;
        };
        let mut texts = of_set(setup, forecast);
        let late = recurring.lateness(forecast, &catalog.sets[place]);
        texts.extend(late.map(|text| (WarningKind::ReportsLate, text)));
        for (kind, text) in texts {
            let robots = found.entry((place, kind, text)).or_default();
            robots.push(forecast.robot.clone());
        }
    }
    found
        .into_iter()
        .map(|((place, kind, text), robots)| Warning {
            kind,
            set: catalog.sets[place].name.clone(),
            robots,
            text,
        })
        .collect()
}

fn of_set(setup: &Setup, forecast: &Forecast) -> Vec<(WarningKind, String)> {
    let params = |robot: &str, set: &str| &setup.alliance.robots[robot].sets[set];
    let set = params(&forecast.robot, &forecast.set);
    let (psi_s, lambda_s) = (set.before_yielding_s, set.before_giving_up_s);
    let work_s = forecast.work_s;
    let mut found = Vec::new();
    let mut warn = |kind: WarningKind, text: String| found.push((kind, text));
    let early = |name: &str, time_s: f64, verb: &str| {
        let time_s = rounded(time_s);
        format!(
            "{name} = {time_s} s is shorter than a unit of work, about {work_s:.0} s: the robot {verb} before it completes anything"
        )
    };
    if psi_s < work_s {
        warn(WarningKind::YieldsTooEarly, early("psi", psi_s, "yields"));
    }
    if lambda_s < work_s {
        let text = early("lambda", lambda_s, "gives up");
        warn(WarningKind::GivesUpTooEarly, text);
    }

    let longest_s = |of: &dyn Fn(&BehaviorParams) -> f64| {
        let takeovers = forecast.takeovers.iter();
        let rivals = takeovers.map(|takeover| params(&takeover.teammate, &takeover.set));
        rivals.map(of).fold(0.0, f64::max)
    };
    let patience_s = longest_s(&|theirs| theirs.willing_to_affect_toward_s(&forecast.robot));
    if lambda_s < patience_s {
        let text = format!(
            "lambda = {} s is shorter than phi = {} s of teammates toward the robot: a failing robot gives up before they lose patience",
            rounded(lambda_s),
            rounded(patience_s)
        );
        warn(WarningKind::PatienceUnused, text);
    }
    let period_s = longest_s(&|theirs| heartbeat_period_s(setup, theirs));
    let tau_s = set.ceased_after_s;
    if tau_s < 2.0 * period_s {
        let missed = if tau_s <= period_s {
            "the robot considers every teammate lost between two heartbeats"
        } else {
            "the robot considers a teammate lost after one missing heartbeat"
        };
        let text = format!(
            "tau = {tau_s} s is less than two heartbeat periods of teammates, {period_s} s each: {missed}"
        );
        warn(WarningKind::SilenceTooShort, text);
    }
    found
}

/// Formats a time, s, rounded to ms. Derived values have many digits.
fn rounded(time_s: f64) -> String {
    if time_s < 1e7 {
        ((1000.0 * time_s).round() / 1000.0).to_string()
    } else {
        format!("{time_s:.0e}")
    }
}

/// Returns the time between two heartbeats, s: 1/ρ, rounded up to whole steps.
fn heartbeat_period_s(setup: &Setup, params: &BehaviorParams) -> f64 {
    let step_s = setup.alliance.step_ms as f64 / 1000.0;
    (1.0 / params.broadcast_rate_hz / step_s - 1e-9).ceil() * step_s
}

/// The check of recurring tasks against continuing ones.
struct Recurring<'s> {
    setup: &'s Setup,
    /// The behavior sets of continuing tasks. They are collected once: a search for each forecast would be quadratic in
    /// the number of tasks.
    continuing: Vec<&'s BehaviorSpec>,
    /// The number of robots that may execute continuing tasks at once.
    places: u64,
}

impl<'s> Recurring<'s> {
    fn new(setup: &'s Setup) -> Self {
        let (scenario, catalog) = (&setup.scenario, &setup.catalog);
        let mission = catalog.mission;
        let is_continuing = |set: &&BehaviorSpec| {
            let properties = mission.behavior_properties(scenario, set);
            properties.is_long_running
        };
        let continuing: Vec<_> = catalog.sets.iter().filter(is_continuing).collect();
        let places = continuing
            .iter()
            .map(|set| u64::from(catalog.tasks[set.task.index()].max_robots))
            .sum();
        Self {
            setup,
            continuing,
            places,
        }
    }

    /// Returns a text if a recurring task must be late: because it takes too long, or because all robots may be at
    /// continuing tasks when it becomes due.
    fn lateness(&self, forecast: &Forecast, behavior: &BehaviorSpec) -> Option<String> {
        let scenario = &self.setup.scenario;
        let mission = self.setup.catalog.mission;
        let period_s = mission
            .behavior_properties(scenario, behavior)
            .recurrence_s?;
        let takes_s = forecast.activates_s + forecast.work_s;
        if takes_s > period_s {
            return Some(format!(
                "the task takes about {takes_s:.0} s after it becomes due, more than its period of {period_s} s"
            ));
        }
        if self.places < scenario.robots.len() as u64 {
            return None;
        }
        let sets = &self.setup.alliance.robots[&forecast.robot].sets;
        let longest = |of: fn(&BehaviorParams) -> f64| {
            let continuing = self.continuing.iter();
            continuing
                .map(|set| of(&sets[&set.name]))
                .fold(0.0, f64::max)
        };
        let lambda_s = longest(|params| params.before_giving_up_s);
        let psi_s = longest(|params| params.before_yielding_s);
        (lambda_s > period_s).then(|| {
            format!(
                "all robots may be at other tasks when the task becomes due, every {period_s} s; this robot continues until psi = {} s if a teammate requests its task, otherwise until lambda = {} s",
                rounded(psi_s),
                rounded(lambda_s)
            )
        })
    }
}

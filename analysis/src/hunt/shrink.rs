//! The least case with the same kind of violation.
//!
//! [`ddmin`] removes faults, robots and tasks; then the values of the remaining faults become simpler. All steps repeat
//! until none of them changes the case. Each candidate is judged by an exact run. The seed becomes the least one too.

use std::collections::BTreeSet;
use std::sync::Arc;

use missions::Registry;
use scenario::Scenario;

use super::case::{Case, Conditions, Judge, Judgement};
use super::ddmin::ddmin;
use super::simpler::groups;
use super::violation::ViolationKind;

/// The number of candidates that are judged together. It does not depend on the number of concurrent runs. More
/// candidates keep more cores busy, but make needless runs if the first one succeeds.
const TOGETHER: usize = 4;

/// The seeds that replace a larger one.
const SEEDS: [u64; 3] = [1, 2, 3];

/// The result of shrinking.
#[derive(Clone, Debug, PartialEq)]
pub struct Shrunk {
    pub case: Case,
    pub judgement: Judgement,
    /// The number of judged candidates.
    pub runs: usize,
    /// True if the case cannot become simpler; false if the limit of runs came first.
    pub is_least: bool,
}

/// Shrinks a case that has a violation of this kind. Judges at most `most` candidates.
///
/// # Errors
/// Returns the errors of the judge.
pub fn shrink(
    case: &Case,
    judgement: &Judgement,
    kind: ViolationKind,
    conditions: &Conditions,
    most: usize,
    judge: &mut dyn Judge,
) -> anyhow::Result<Shrunk> {
    let mut shrinker = Shrinker {
        judge,
        conditions: conditions.only(kind),
        kind,
        most,
        runs: 0,
        is_limited: false,
        known: BTreeSet::new(),
        least: (case.clone(), judgement.clone()),
    };
    loop {
        let before = shrinker.least.0.clone();
        shrinker.remove_faults()?;
        shrinker.simplify_faults()?;
        // The worst PAR2 time of a smaller mission has another meaning.
        if kind != ViolationKind::WorstPar2 {
            shrinker.remove_robots()?;
            shrinker.remove_tasks()?;
        }
        shrinker.lower_seed()?;
        if shrinker.is_limited || shrinker.least.0 == before {
            break;
        }
    }
    let (case, judgement) = shrinker.least;
    Ok(Shrunk {
        case,
        judgement,
        runs: shrinker.runs,
        is_least: !shrinker.is_limited,
    })
}

struct Shrinker<'j> {
    judge: &'j mut dyn Judge,
    conditions: Conditions,
    kind: ViolationKind,
    most: usize,
    runs: usize,
    /// True once a candidate was not judged because of the limit.
    is_limited: bool,
    /// The candidates that passed, by digest.
    known: BTreeSet<u64>,
    least: (Case, Judgement),
}

impl Shrinker<'_> {
    /// Returns the place of the first candidate with the violation, and makes it the least case.
    fn first(&mut self, candidates: Vec<Case>) -> anyhow::Result<Option<usize>> {
        let numbered: Vec<(usize, Case)> = candidates.into_iter().enumerate().collect();
        let unknown: Vec<(usize, Case)> = numbered
            .into_iter()
            .filter(|(_, case)| !self.known.contains(&case.digest()))
            .collect();
        for chunk in unknown.chunks(TOGETHER) {
            let left = self.most.saturating_sub(self.runs);
            let together = &chunk[..chunk.len().min(left)];
            if together.is_empty() {
                self.is_limited = true;
                return Ok(None);
            }
            let cases: Vec<Case> = together.iter().map(|(_, case)| case.clone()).collect();
            let judgements = self.judge.judge(&cases, &self.conditions)?;
            self.runs += cases.len();
            for ((place, case), judgement) in together.iter().zip(judgements) {
                if judgement.kind() == Some(self.kind) {
                    let case = Case {
                        base_ms: judgement.base_ms,
                        ..case.clone()
                    };
                    self.least = (case, judgement);
                    return Ok(Some(*place));
                }
                self.known.insert(case.digest());
            }
            self.is_limited |= together.len() < chunk.len();
        }
        Ok(None)
    }

    fn remove_faults(&mut self) -> anyhow::Result<()> {
        let case = self.least.0.clone();
        ddmin(case.faults.clone(), |lists| {
            let with = |faults: &Vec<_>| Case {
                faults: faults.clone(),
                ..case.clone()
            };
            self.first(lists.iter().map(with).collect())
        })?;
        Ok(())
    }

    fn simplify_faults(&mut self) -> anyhow::Result<()> {
        for place in 0..self.least.0.faults.len() {
            let mut number = 0;
            loop {
                let case = self.least.0.clone();
                let Some(group) = groups(&case.faults[place], &case.scenario)
                    .into_iter()
                    .nth(number)
                else {
                    break;
                };
                let with = |order| {
                    let mut faults = case.faults.clone();
                    faults[place] = order;
                    Case {
                        faults,
                        ..case.clone()
                    }
                };
                let candidates = group.into_iter().map(with).collect();
                // After a success the same group is tried again, with the remaining variants.
                if self.first(candidates)?.is_none() {
                    number += 1;
                }
            }
        }
        Ok(())
    }

    fn remove_robots(&mut self) -> anyhow::Result<()> {
        let case = self.least.0.clone();
        ddmin(case.scenario.robots.clone(), |lists| {
            let with = |robots: &Vec<_>| {
                let mut scenario = (*case.scenario).clone();
                scenario.robots.clone_from(robots);
                changed(&case, scenario)
            };
            // A team without robots is not a scenario; its candidate keeps the place in the list.
            self.first_of(lists.iter().map(with).collect())
        })?;
        Ok(())
    }

    /// Removes entries of the lists in the mission's section, such as points, and lowers its counts.
    fn remove_tasks(&mut self) -> anyhow::Result<()> {
        let mission = self.least.0.scenario.mission().name();
        let lists = places(
            &section(&self.least.0.scenario, mission),
            &|value| matches!(value, toml::Value::Array(list) if list.len() > 1),
        );
        for at in lists {
            let case = self.least.0.clone();
            let before = section(&case.scenario, mission);
            let Some(toml::Value::Array(list)) = at.get(&before) else {
                continue;
            };
            ddmin(list.clone(), |lists| {
                let with = |list: &Vec<_>| {
                    let list = toml::Value::Array(list.clone());
                    with_section(&case, mission, at.with(&before, list))
                };
                self.first_of(lists.iter().map(with).collect())
            })?;
        }
        let counts = places(&section(&self.least.0.scenario, mission), &|value| {
            matches!(value, toml::Value::Integer(2..))
        });
        for at in counts {
            loop {
                let case = self.least.0.clone();
                let before = section(&case.scenario, mission);
                let Some(&toml::Value::Integer(count)) = at.get(&before) else {
                    break;
                };
                let mut fewer = vec![1, count / 2, count - 1];
                fewer.retain(|fewer| (1..count).contains(fewer));
                fewer.dedup();
                let with =
                    |fewer: i64| with_section(&case, mission, at.with(&before, fewer.into()));
                let candidates = fewer.into_iter().map(with).collect();
                if self.first_of(candidates)?.is_none() {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Returns the place of the first candidate with the violation. `None` stands for one that is not a scenario.
    fn first_of(&mut self, candidates: Vec<Option<Case>>) -> anyhow::Result<Option<usize>> {
        let numbered = candidates.into_iter().enumerate();
        let valid = numbered.filter_map(|(place, case)| Some((place, case?)));
        let (places, cases): (Vec<usize>, Vec<Case>) = valid.unzip();
        Ok(self.first(cases)?.map(|first| places[first]))
    }

    fn lower_seed(&mut self) -> anyhow::Result<()> {
        let case = self.least.0.clone();
        let lower = SEEDS.into_iter().filter(|seed| *seed < case.seed);
        let candidates = lower.map(|seed| Case {
            seed,
            base_ms: None,
            ..case.clone()
        });
        self.first(candidates.collect())?;
        Ok(())
    }
}

/// Returns the case with another scenario, if that is valid with the faults.
fn changed(case: &Case, scenario: Scenario) -> Option<Case> {
    let case = Case {
        scenario: Arc::new(scenario),
        base_ms: None,
        ..case.clone()
    };
    let table: toml::Table = toml::from_str(&case.to_toml().ok()?).ok()?;
    let vocabulary = Registry::current().vocabulary();
    let mut scenario = Scenario::from_table(&table, &vocabulary).ok()?;
    scenario.faults.timeline.clear();
    Some(Case {
        scenario: Arc::new(scenario),
        ..case
    })
}

/// Returns the mission's section as in a file.
fn section(scenario: &Scenario, mission: &str) -> toml::Value {
    let text = scenario.to_toml().unwrap_or_default();
    let mut table: toml::Table = toml::from_str(&text).unwrap_or_default();
    let empty = || toml::Value::Table(toml::Table::new());
    table.remove(mission).unwrap_or_else(empty)
}

/// Returns the case with another section of the mission, if that is valid with the faults.
fn with_section(case: &Case, mission: &str, section: toml::Value) -> Option<Case> {
    let mut table: toml::Table = toml::from_str(&case.scenario.to_toml().ok()?).ok()?;
    table.insert(mission.to_owned(), section);
    let vocabulary = Registry::current().vocabulary();
    changed(case, Scenario::from_table(&table, &vocabulary).ok()?)
}

/// The place of a value in the mission's section.
#[derive(Clone, Debug, Default, PartialEq)]
struct SectionPlace(Vec<Step>);

#[derive(Clone, Debug, PartialEq)]
enum Step {
    Key(String),
    Index(usize),
}

impl SectionPlace {
    fn get<'v>(&self, section: &'v toml::Value) -> Option<&'v toml::Value> {
        self.0.iter().try_fold(section, |value, step| match step {
            Step::Key(key) => value.get(key),
            Step::Index(index) => value.get(index),
        })
    }

    /// Returns the section with another value at the place.
    fn with(&self, section: &toml::Value, new: toml::Value) -> toml::Value {
        let mut section = section.clone();
        let found = self
            .0
            .iter()
            .try_fold(&mut section, |value, step| match step {
                Step::Key(key) => value.get_mut(key),
                Step::Index(index) => value.get_mut(index),
            });
        if let Some(value) = found {
            *value = new;
        }
        section
    }
}

/// Returns the places of all values that `is_wanted` accepts, outer ones first.
fn places(section: &toml::Value, is_wanted: &dyn Fn(&toml::Value) -> bool) -> Vec<SectionPlace> {
    fn collect(
        at: &SectionPlace,
        value: &toml::Value,
        is_wanted: &dyn Fn(&toml::Value) -> bool,
        found: &mut Vec<SectionPlace>,
    ) {
        if is_wanted(value) {
            found.push(at.clone());
        }
        let below = |step| SectionPlace([&at.0[..], &[step]].concat());
        match value {
            toml::Value::Table(table) => {
                for (key, value) in table {
                    collect(&below(Step::Key(key.clone())), value, is_wanted, found);
                }
            }
            toml::Value::Array(list) => {
                for (index, value) in list.iter().enumerate() {
                    collect(&below(Step::Index(index)), value, is_wanted, found);
                }
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    collect(&SectionPlace::default(), section, is_wanted, &mut found);
    found
}

#[cfg(test)]
mod tests {
    use missions::waste::data::default_scenario;
    use scenario::fault::{Fault, Order};
    use scenario::time::SimTime;

    use super::super::plan::HuntPlan;
    use super::super::violation::FoundViolation;
    use super::*;

    /// A judge that runs nothing: a case is broken if `breaks` returns true.
    struct Rule<F> {
        breaks: F,
        judged: usize,
    }

    impl<F: Fn(&Case) -> bool> Judge for Rule<F> {
        fn judge(&mut self, cases: &[Case], _: &Conditions) -> anyhow::Result<Vec<Judgement>> {
            self.judged += cases.len();
            let judgements = cases.iter().map(|case| Judgement {
                violation: (self.breaks)(case).then(broken),
                ..Judgement::default()
            });
            Ok(judgements.collect())
        }
    }

    fn broken() -> FoundViolation {
        FoundViolation {
            kind: ViolationKind::Abandoned,
            at_ms: SimTime::ZERO,
            description: "broken".to_owned(),
        }
    }

    fn plan() -> HuntPlan {
        HuntPlan::parse("plan.toml", "budget = { runs = 1 }\n", |_| {
            Ok(default_scenario())
        })
        .unwrap()
    }

    fn kill(robot: &str, at_s: f64) -> Order {
        Order {
            at_s: Some(at_s),
            ..Order::now(Fault::Kill(robot.to_owned()))
        }
    }

    fn case() -> Case {
        let mute = Order {
            at_s: Some(33.3),
            for_s: Some(12.5),
            ..Order::now(Fault::Mute("blue".to_owned()))
        };
        let faults = vec![
            kill("blue", 12.5),
            mute,
            kill("gold", 133.37),
            kill("green", 200.0),
        ];
        Case {
            faults,
            ..plan().fault_free(0, 9)
        }
    }

    fn shrunk(most: usize, breaks: impl Fn(&Case) -> bool) -> (Shrunk, usize) {
        let mut rule = Rule { breaks, judged: 0 };
        let judgement = Judgement {
            violation: Some(broken()),
            ..Judgement::default()
        };
        let kind = ViolationKind::Abandoned;
        let conditions = plan().conditions;
        let shrunk = shrink(&case(), &judgement, kind, &conditions, most, &mut rule).unwrap();
        (shrunk, rule.judged)
    }

    fn has_late_kill_of_gold(case: &Case) -> bool {
        let mut faults = case.faults.iter();
        faults.any(|order| {
            matches!(&order.fault, Fault::Kill(robot) if robot == "gold")
                && order.at_s >= Some(60.0)
        })
    }

    #[test]
    fn faults_values_robots_tasks_and_the_seed_become_less() {
        let (shrunk, judged) = shrunk(1000, has_late_kill_of_gold);
        let case = &shrunk.case;
        let expected = Order {
            for_s: Some(1.0),
            ..kill("gold", 100.0)
        };
        assert_eq!(case.faults, [expected]);
        let robots: Vec<&str> = case
            .scenario
            .robots
            .iter()
            .map(|robot| &*robot.name)
            .collect();
        assert_eq!((robots, case.seed), (vec!["gold"], 1));
        let section = section(&case.scenario, "waste");
        let spills = section["spills"].as_array().unwrap();
        assert_eq!(
            (spills.len(), spills[0]["items"].as_integer()),
            (1, Some(1))
        );
        assert!(shrunk.is_least);
        assert_eq!((shrunk.runs, judged), (judged, shrunk.runs));
        case.setup().unwrap();
    }

    #[test]
    fn a_violation_that_needs_two_faults_and_two_robots_keeps_them() {
        let breaks = |case: &Case| {
            let names: Vec<&str> = case
                .scenario
                .robots
                .iter()
                .map(|robot| &*robot.name)
                .collect();
            let is_muted = case
                .faults
                .iter()
                .any(|order| matches!(order.fault, Fault::Mute(_)));
            names.contains(&"green") && is_muted && has_late_kill_of_gold(case)
        };
        let (shrunk, _) = shrunk(1000, breaks);
        assert_eq!(shrunk.case.faults.len(), 2);
        // The muted robot is a target, so it stays as well.
        assert_eq!(shrunk.case.scenario.robots.len(), 3);
    }

    #[test]
    fn a_limit_of_runs_ends_the_work_with_a_broken_case() {
        let (_, all) = shrunk(1000, has_late_kill_of_gold);
        for most in 0..all {
            let (shrunk, judged) = shrunk(most, has_late_kill_of_gold);
            assert!(
                judged <= most && !shrunk.is_least,
                "{judged} of {most} runs"
            );
            assert!(has_late_kill_of_gold(&shrunk.case));
        }
    }

    #[test]
    fn shrinking_again_changes_nothing() {
        let (first, _) = shrunk(1000, has_late_kill_of_gold);
        let mut rule = Rule {
            breaks: has_late_kill_of_gold,
            judged: 0,
        };
        let (kind, conditions) = (ViolationKind::Abandoned, plan().conditions);
        let again = shrink(
            &first.case,
            &first.judgement,
            kind,
            &conditions,
            1000,
            &mut rule,
        )
        .unwrap();
        assert_eq!(again.case, first.case);
    }
}

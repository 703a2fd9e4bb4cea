//! The plan of the study: teams, spreads, rules and seeds.

use anyhow::Context;
use missions::Registry;
use scenario::limits::closed;
use scenario::{Scenario, TomlFile};
use serde::Deserialize;

use super::condition::{Condition, Rule, TrialFault};
use super::instance::Instance;

/// The key of a plan that makes it a plan of this study.
const KEY: &str = "strategies";

/// The largest numbers of robots and tasks. The optimum is found by a search over all assignments.
const MAX_ROBOTS: usize = 8;
const MAX_TASKS: usize = 12;

const MAX_SEEDS: usize = 10_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    seeds: usize,
    strategies: Section,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    sizes: Vec<Size>,
    spreads: Vec<f64>,
    with_faults: WithFaults,
    rules: Vec<Rule>,
}

/// The numbers of robots, of tasks, and of robots that can do each task.
type Size = (usize, usize, usize);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WithFaults {
    size: Size,
    spread: f64,
}

/// The conditions, rules and seeds of the study.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    pub conditions: Vec<Condition>,
    /// h: a robot takes up to 1 + h times as long as the fastest possible robot, and draws up to 1 + h W.
    pub spreads: Vec<f64>,
    pub rules: Vec<Rule>,
    /// The number of seeds; they start at 1.
    pub seeds: usize,
}

impl Design {
    /// Reads a plan. Returns `None` if it is a plan of another study.
    ///
    /// # Errors
    /// Returns the first mistake as one line.
    pub fn parse(file_name: &str, text: &str) -> anyhow::Result<Option<Self>> {
        if !text
            .parse::<toml::Table>()
            .is_ok_and(|table| table.contains_key(KEY))
        {
            return Ok(None);
        }
        let file = TomlFile::parse(file_name, text)?;
        let File { seeds, strategies } = file.deserialize()?;
        let Section {
            sizes,
            spreads,
            with_faults,
            rules,
        } = strategies;
        let wrong = |(robots, tasks, coverage): &Size| {
            !(1..=MAX_ROBOTS).contains(robots)
                || !(1..=MAX_TASKS).contains(tasks)
                || !(1..=*robots).contains(coverage)
        };
        if let Some(size) = sizes
            .iter()
            .chain([&with_faults.size])
            .find(|size| wrong(size))
        {
            let what = format!("the size {size:?} is out of range");
            let remedy = format!(
                "write [robots up to {MAX_ROBOTS}, tasks up to {MAX_TASKS}, robots that can do each task]"
            );
            return Err(file.error_at([KEY], what, remedy).into());
        }
        for spread in spreads.iter().chain([&with_faults.spread]) {
            let checked = closed(0.0, 10.0, "").check([KEY, "spreads"], *spread);
            checked.map_err(|problem| file.locate(problem))?;
        }
        if sizes.is_empty()
            || spreads.is_empty()
            || rules.is_empty()
            || !(1..=MAX_SEEDS).contains(&seeds)
        {
            let remedy = format!("write sizes, spreads, rules, and seeds from 1 to {MAX_SEEDS}");
            return Err(file
                .error_at([KEY], "the plan has no trials", remedy)
                .into());
        }
        let design = Self {
            conditions: conditions(&sizes, &spreads, &with_faults),
            spreads,
            rules,
            seeds,
        };
        let instance = Instance::draw(&design.conditions[0], 1);
        let vocabulary = Registry::current().vocabulary();
        for rule in &design.rules {
            let text = instance.scenario(rule, TrialFault::None);
            Scenario::parse("[allocators.l-alliance]", &text, &vocabulary)
                .with_context(|| format!("{file_name}: rule '{}'", rule.name))?;
        }
        Ok(Some(design))
    }

    #[must_use]
    pub fn runs(&self) -> usize {
        self.conditions.len() * self.rules.len() * self.seeds
    }
}

/// Returns every size with every spread, and two conditions with a fault.
fn conditions(sizes: &[Size], spreads: &[f64], with_faults: &WithFaults) -> Vec<Condition> {
    let condition = |(robots, tasks, coverage): Size, spread, fault| Condition {
        robots,
        tasks,
        coverage,
        spread,
        fault,
    };
    let sizes = sizes.iter();
    let without = sizes.flat_map(|size| {
        spreads
            .iter()
            .map(|spread| condition(*size, *spread, TrialFault::None))
    });
    let with = [TrialFault::Crash, TrialFault::Slow];
    let with = with.map(|fault| condition(with_faults.size, with_faults.spread, fault));
    without.chain(with).collect()
}

//! The plan of a parameter search, checked before the first run.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Context, bail};
use scenario::limits::{NumberRange, check_known, closed, whole};
use scenario::{Problem, name_remedy};

use crate::compare::metrics::Metric;
use crate::compare::primary;
use crate::sweep::design::{Change, FAULTS, MISSION, apply_change};
use crate::sweep::plan::space::{Parameter, changes, values};
use crate::sweep::plan::tuning::SearchSettings;
use crate::sweep::plan::{Plan, setup};

/// The metrics that a search can optimize in every mission. They need no log.
const METRICS: [Metric; 4] = [Metric::Par2, Metric::Done, Metric::Messages, Metric::Bytes];

#[derive(Clone, Debug)]
pub struct Task {
    /// The missions under faults. Their single seed is not used.
    pub plan: Plan,
    pub tuning: SearchSettings,
    pub metric: Metric,
    pub allocators: Vec<Allocator>,
    /// Every mission under every class of faults.
    pub conditions: Vec<Condition>,
}

#[derive(Clone, Debug)]
pub struct Allocator {
    pub name: String,
    /// The tuned parameters; never empty.
    pub parameters: Vec<Parameter>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    pub name: String,
    /// True if only the test uses the condition.
    pub is_unseen: bool,
    /// The limit of a run, s of simulated time.
    pub limit_s: f64,
    /// The metric that ranks the runs of the mission.
    pub primary: Metric,
}

impl Allocator {
    /// Returns the changes that select the allocator in a scenario, with these values or with its defaults.
    #[must_use]
    pub fn changes(&self, found: Option<&[f64]>) -> Vec<Change> {
        let mut all = vec![Change {
            path: vec!["allocator".to_owned()],
            value: toml::Value::String(self.name.clone()),
        }];
        if let Some(found) = found {
            all.extend(changes(&self.parameters, found));
        }
        all
    }
}

impl Task {
    /// Reads the settings of a search from a plan.
    pub fn of(plan: Plan) -> anyhow::Result<Self> {
        let Some(tuning) = plan.tuning.clone() else {
            bail!(
                "the plan has no search; write a table [tune], as in campaigns/tune-alliance.toml"
            );
        };
        if plan.design.seeds_per_condition() > 1 {
            let what = "[tune] states the seeds as training, selection and test";
            bail!(Problem::at(["seeds"], what, "remove seeds"));
        }
        if plan.design.columns().any(|column| column == "allocator") {
            let what = "[tune.parameters] states the allocators";
            bail!(Problem::at(["grid", "allocator"], what, "remove it"));
        }
        check_seeds(&tuning)?;
        let conditions = conditions(&plan, &tuning)?;
        let metric = metric(tuning.metric.as_deref(), &conditions)?;
        let mut task = Self {
            plan,
            metric,
            allocators: Vec::new(),
            conditions,
            tuning,
        };
        let names: Vec<String> = task.tuning.parameters.keys().cloned().collect();
        if names.is_empty() {
            let remedy = "write [tune.parameters.alliance]";
            bail!(Problem::at(
                ["tune", "parameters"],
                "there is no allocator to tune",
                remedy
            ));
        }
        let mut owners: BTreeMap<String, String> = BTreeMap::new();
        for name in names {
            let allocator = task.allocator(&name)?;
            for parameter in &allocator.parameters {
                if let Some(other) = owners.insert(parameter.key.clone(), name.clone()) {
                    let what = format!(
                        "'{}' is also tuned for {other}, but one scenario contains both",
                        parameter.key
                    );
                    let at = ["tune", "parameters", &name];
                    bail!(Problem::at(at, what, "tune it for one of them"));
                }
            }
            task.allocators.push(allocator);
        }
        Ok(task)
    }

    /// Returns the indices of the conditions that the search uses.
    pub fn seen(&self) -> impl Iterator<Item = usize> + Clone {
        (0..self.conditions.len()).filter(|place| !self.conditions[*place].is_unseen)
    }

    /// Reads the parameters of an allocator. Each parameter is validated at both ends of its range, with all others in the
    /// middle.
    fn allocator(&self, name: &str) -> anyhow::Result<Allocator> {
        let place = |key: &str| format!("tune.parameters.{name}: {key}");
        let mut allocator = Allocator {
            name: name.to_owned(),
            parameters: Vec::new(),
        };
        self.attempt(&allocator.changes(None))
            .with_context(|| format!("tune.parameters.{name}"))?;
        let ranges = self.tuning.ranges(name);
        let ranges = ranges.with_context(|| format!("tune.parameters.{name}"))?;
        for (key, range) in ranges {
            let parameter = Parameter::new(&key, &range, &allocator.parameters);
            let parameter = parameter.with_context(|| place(&key))?;
            allocator.parameters.push(parameter);
        }
        if allocator.parameters.is_empty() {
            let at = ["tune", "parameters", name];
            bail!(Problem::at(
                at,
                "there is no parameter",
                "write a key with its bounds"
            ));
        }
        let parameters = &allocator.parameters;
        let attempt = |point: &[f64]| {
            let values = values(parameters, point);
            self.attempt(&allocator.changes(Some(&values)))
        };
        let middle = vec![0.5; parameters.len()];
        attempt(&middle).with_context(|| format!("tune.parameters.{name}"))?;
        for (number, parameter) in parameters.iter().enumerate() {
            for end in [0.0, 1.0] {
                let mut point = middle.clone();
                point[number] = end;
                attempt(&point).with_context(|| place(&parameter.key))?;
            }
        }
        Ok(allocator)
    }

    /// Checks that every condition is valid with these changes.
    fn attempt(&self, changes: &[Change]) -> anyhow::Result<()> {
        for run in 0..self.conditions.len() {
            let mut scenario = self.plan.scenario(run).map_err(anyhow::Error::msg)?;
            for each in changes {
                apply_change(&mut scenario, each)?;
            }
            setup(&scenario, 1)?;
        }
        Ok(())
    }
}

/// Returns the stated metric, or the one that ranks the runs of all missions.
fn metric(stated: Option<&str>, conditions: &[Condition]) -> Result<Metric, Problem> {
    let primary: BTreeSet<&Metric> = conditions
        .iter()
        .map(|condition| &condition.primary)
        .collect();
    let known: BTreeSet<&Metric> = METRICS.iter().chain(primary.iter().copied()).collect();
    let names: Vec<String> = known.iter().map(|metric| metric.name()).collect();
    let Some(stated) = stated else {
        return match primary.first() {
            Some(only) if primary.len() == 1 => Ok((*only).clone()),
            _ => {
                let what = "the missions are ranked by different measures";
                let remedy = format!("state one of {}", names.join(", "));
                Err(Problem::at(["tune", "metric"], what, remedy))
            }
        };
    };
    let found = known.into_iter().find(|metric| metric.name() == stated);
    found.cloned().ok_or_else(|| {
        let what = format!("there is no metric '{stated}' to tune by");
        let remedy = name_remedy(stated, names.iter().map(String::as_str));
        Problem::at(["tune", "metric"], what, remedy)
    })
}

fn check_seeds(tuning: &SearchSettings) -> Result<(), Problem> {
    const COUNT: NumberRange = whole(1, 1_000_000, "");
    let sets = [
        ("training", &tuning.training.0),
        ("selection", &tuning.selection.0),
        ("test", &tuning.test.0),
    ];
    for (place, (name, seeds)) in sets.iter().enumerate() {
        if seeds.is_empty() {
            let what = format!("there are no {name} seeds");
            return Err(Problem::at(
                ["tune", name],
                what,
                "write { from = 1, to = 50 }",
            ));
        }
        for (other, before) in &sets[..place] {
            if let Some(seed) = seeds.iter().find(|seed| before.contains(seed)) {
                let what = format!("seed {seed} also belongs to {other}");
                let remedy = "the sets of seeds must be disjoint: take other seeds";
                return Err(Problem::at(["tune", name], what, remedy));
            }
        }
    }
    let counts = [
        ("budget", tuning.budget),
        ("seeds_per_candidate", tuning.seeds_per_candidate),
        ("finalists", tuning.finalists),
    ];
    for (name, count) in counts {
        COUNT.check(["tune", name], count as f64)?;
    }
    if tuning.seeds_per_candidate > tuning.training.0.len() {
        let (seeds, all) = (tuning.seeds_per_candidate, tuning.training.0.len());
        let what = format!("{seeds} are more than the {all} training seeds");
        return Err(Problem::at(
            ["tune", "seeds_per_candidate"],
            what,
            "take fewer",
        ));
    }
    closed(0.0, 1000.0, "").check(["tune", "bytes_weight"], tuning.bytes_weight)
}

fn conditions(plan: &Plan, tuning: &SearchSettings) -> anyhow::Result<Vec<Condition>> {
    let columns: Vec<&str> = plan.design.columns().collect();
    let classes = columns.iter().position(|column| *column == FAULTS);
    let mut known: Vec<String> = Vec::new();
    let mut all = Vec::new();
    for run in 0..plan.design.runs().unwrap_or_default() {
        let cells: Vec<String> = plan.design.cells(run).map(ToString::to_string).collect();
        let class = classes.map_or_else(String::new, |place| cells[place].clone());
        let named = columns.iter().zip(&cells).take(cells.len() - 1);
        let named = named.map(|(column, cell)| match *column {
            MISSION | FAULTS => cell.clone(),
            _ => format!("{column} {cell}"),
        });
        let name = named.collect::<Vec<_>>().join(", ");
        let scenario = plan.scenario(run).map_err(anyhow::Error::msg);
        let setup = scenario.and_then(|table| setup(&table, 1));
        let setup = setup.with_context(|| name.clone())?;
        all.push(Condition {
            limit_s: setup.scenario.limit_s,
            primary: primary::of_run(plan, run, &setup.scenario)?,
            is_unseen: tuning.unseen.contains(&class),
            name,
        });
        known.push(class);
    }
    known.sort();
    known.dedup();
    for class in &tuning.unseen {
        let known = known.iter().map(String::as_str);
        check_known(
            ["tune", "unseen"],
            "there is no class of faults",
            class,
            known,
        )?;
    }
    if all.iter().all(|condition| condition.is_unseen) {
        let what = "no class of faults is left for the search";
        bail!(Problem::at(["tune", "unseen"], what, "remove one"));
    }
    Ok(all)
}

//! The plan of a hunt, checked before the first run.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::Context;
use missions::Registry;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::limits::{NumberRange, TIME, above, check_known, whole};
use scenario::time::SimTime;
use scenario::{KeyPath, Problem, Scenario, TomlFile};
use serde::Deserialize;
use xxhash_rust::xxh3::xxh3_64;

use super::case::{Case, Conditions};
use super::violation::ViolationKind;
use crate::random_mission::faults::{FaultSampler, names};
use crate::sweep::plan::file::Source;
use crate::sweep::plan::seeds::Seeds;

/// The name that stands for all invariants.
const INVARIANTS: &str = "invariants";

/// The range of the number of runs of a search, and of a shrinker.
const RUNS: NumberRange = whole(1, 10_000_000, "");
/// The range of the number of faults of a schedule.
const FAULTS: NumberRange = whole(1, 100, "");
/// The range of the multiple of the fault-free makespan.
const FACTOR: NumberRange = above(1.0, 1000.0, "");

/// The number of draws that find out whether a plan allows any fault.
const TRIES: usize = 1000;

/// The methods of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    /// Independent schedules from the same distribution: the control.
    Uniform,
    /// Changed schedules, selected by severity and coverage.
    Guided,
}

impl Method {
    pub const ALL: [Self; 2] = [Self::Uniform, Self::Guided];

    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Guided => "guided",
        }
    }
}

/// The work of each search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Budget {
    Runs(usize),
    /// Wall-clock time, s. The batch that is under way completes.
    Seconds(f64),
}

/// The format of a plan file.
#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct HuntFile {
    question: Option<String>,
    scenario: Option<Source>,
    limit_s: Option<f64>,
    seeds: Option<Seeds>,
    allocators: Vec<String>,
    violations: Option<Vec<String>>,
    objective: Option<String>,
    abandoned_s: f64,
    duplicated_s: f64,
    idle_s: f64,
    slow_factor: f64,
    methods: Vec<String>,
    seed: u64,
    budget: Option<BudgetFile>,
    faults: FaultsFile,
    shrink: ShrinkFile,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct BudgetFile {
    runs: Option<f64>,
    seconds: Option<f64>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct FaultsFile {
    min: f64,
    max: f64,
    until_s: Option<f64>,
    only: Vec<String>,
    without: Vec<String>,
}

#[derive(Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ShrinkFile {
    runs: f64,
}

impl Default for HuntFile {
    fn default() -> Self {
        Self {
            question: None,
            scenario: None,
            limit_s: None,
            seeds: None,
            allocators: Vec::new(),
            violations: None,
            objective: None,
            abandoned_s: 300.0,
            duplicated_s: 30.0,
            idle_s: 60.0,
            slow_factor: 3.0,
            methods: Vec::new(),
            seed: 1,
            budget: None,
            faults: FaultsFile::default(),
            shrink: ShrinkFile::default(),
        }
    }
}

impl Default for FaultsFile {
    fn default() -> Self {
        Self {
            min: 1.0,
            max: 4.0,
            until_s: None,
            only: Vec::new(),
            without: Vec::new(),
        }
    }
}

impl Default for ShrinkFile {
    fn default() -> Self {
        Self { runs: 500.0 }
    }
}

/// The faults of a schedule.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultBounds {
    pub min: usize,
    pub max: usize,
    /// The time by which all timed faults have begun, s of simulated time.
    pub until_s: f64,
    /// The names of the faults.
    pub names: Vec<&'static str>,
}

/// A plan whose values are checked.
#[derive(Clone, Debug)]
pub struct HuntPlan {
    pub question: Option<String>,
    /// The scenario of each allocator without faults, by the allocator's name.
    pub scenarios: Vec<(String, Arc<Scenario>)>,
    pub seeds: Vec<u64>,
    pub conditions: Conditions,
    /// True if the search maximizes the PAR2 time instead of stopping at the first violation.
    pub maximizes_par2: bool,
    pub methods: Vec<Method>,
    pub seed: u64,
    pub budget: Budget,
    pub faults: FaultBounds,
    /// The largest number of runs for the shrinking of one case; 0 keeps it as it was found.
    pub shrink_runs: usize,
}

impl HuntPlan {
    /// Reads a plan. `load` loads a scenario by name or file; `file_name` is for error messages.
    ///
    /// # Errors
    /// Returns the first mistake as one line: position, problem and remedy.
    pub fn parse(
        file_name: &str,
        text: &str,
        load: impl Fn(&str) -> anyhow::Result<Scenario>,
    ) -> anyhow::Result<Self> {
        let file = TomlFile::parse(file_name, text)?;
        let contents: HuntFile = file.deserialize()?;
        let vocabulary = Registry::current().vocabulary();
        let place = |key: &str| format!("{file_name}:{}", file.line_of([key]));
        let mut scenario = match &contents.scenario {
            None => vocabulary.default_scenario()?,
            Some(Source::Named(name)) => load(name).with_context(|| place("scenario"))?,
            Some(Source::Inline) => file.scenario("scenario", &vocabulary)?,
        };
        if let Some(limit_s) = contents.limit_s {
            TIME.check(["limit_s"], limit_s)
                .map_err(|problem| file.locate(problem))?;
            scenario.limit_s = limit_s;
        }
        scenario.faults = Default::default();
        let scenarios = scenarios(&file, &contents.allocators, scenario)?;
        // All scenarios differ only in the allocator.
        let scenario = Arc::clone(&scenarios[0].1);
        let checked = || {
            Ok(Self {
                question: contents.question.clone(),
                seeds: seeds(contents.seeds.clone())?,
                conditions: conditions(&contents, &scenario)?,
                maximizes_par2: maximizes_par2(&contents)?,
                methods: methods(&contents.methods)?,
                seed: contents.seed,
                budget: budget(contents.budget)?,
                faults: faults(&contents.faults, &scenario)?,
                shrink_runs: shrink_runs(&contents.shrink)?,
                scenarios: scenarios.clone(),
            })
        };
        Ok(checked().map_err(|problem: Problem| file.locate(problem))?)
    }

    /// Returns a digest of everything that determines the runs, including the program version.
    #[must_use]
    pub fn digest(&self) -> String {
        let whole = format!("{}\n{self:?}", env!("CARGO_PKG_VERSION"));
        format!("{:016x}", xxh3_64(whole.as_bytes()))
    }

    /// Returns the case of an allocator without faults.
    #[must_use]
    pub fn fault_free(&self, allocator: usize, seed: u64) -> Case {
        Case {
            scenario: Arc::clone(&self.scenarios[allocator].1),
            seed,
            faults: Vec::new(),
            base_ms: None,
        }
    }
}

/// Returns the checked scenario of each allocator.
fn scenarios(
    file: &TomlFile<'_>,
    allocators: &[String],
    scenario: Scenario,
) -> anyhow::Result<Vec<(String, Arc<Scenario>)>> {
    let vocabulary = Registry::current().vocabulary();
    let mut found: BTreeMap<&str, usize> = BTreeMap::new();
    let mut all = Vec::new();
    for (index, name) in allocators.iter().enumerate() {
        let at = KeyPath::new(["allocators"]).index(index);
        let known = vocabulary.allocators.iter().map(|spec| spec.name);
        check_known(&at, "there is no allocator", name, known)
            .map_err(|problem| file.locate(problem))?;
        if found.insert(name, index).is_some() {
            return Err(file
                .error_at(&at, format!("'{name}' is named twice"), "remove one")
                .into());
        }
        let mut scenario = scenario.clone();
        scenario.set_allocator(name);
        all.push((name.clone(), scenario));
    }
    if all.is_empty() {
        all.push((scenario.allocator_list(), scenario));
    }
    let mut checked = Vec::new();
    for (name, scenario) in all {
        // The text form contains the values that a written scenario will contain.
        let table: toml::Table = toml::from_str(&scenario.to_toml()?)?;
        let scenario = Scenario::from_table(&table, &vocabulary)
            .with_context(|| format!("{}: {name}", file.name()))?;
        let case = Case {
            scenario: Arc::new(scenario),
            seed: 1,
            faults: Vec::new(),
            base_ms: None,
        };
        case.setup()
            .with_context(|| format!("{}: {name}", file.name()))?;
        checked.push((name, case.scenario));
    }
    Ok(checked)
}

fn seeds(stated: Option<Seeds>) -> Result<Vec<u64>, Problem> {
    // Ten seeds vary the sensor noise and the radio, and need ten runs without faults per allocator.
    let seeds = stated.map_or_else(|| (1..=10).collect(), |Seeds(seeds)| seeds);
    if seeds.is_empty() {
        return Err(Problem::at(
            ["seeds"],
            "there is no seed",
            "write a number of seeds, such as 10",
        ));
    }
    Ok(seeds.into_iter().map(i64::unsigned_abs).collect())
}

fn conditions(contents: &HuntFile, scenario: &Scenario) -> Result<Conditions, Problem> {
    let stated = match (&contents.violations, &contents.objective) {
        (Some(stated), _) => stated.clone(),
        (None, Some(_)) => Vec::new(),
        (None, None) => vec![INVARIANTS.to_owned()],
    };
    let known = ViolationKind::INVARIANTS
        .into_iter()
        .chain(ViolationKind::OTHERS);
    let mut violations = Vec::new();
    for (index, name) in stated.iter().enumerate() {
        if name == INVARIANTS {
            violations.extend(ViolationKind::INVARIANTS);
            continue;
        }
        let at = KeyPath::new(["violations"]).index(index);
        let names = [INVARIANTS]
            .into_iter()
            .chain(known.clone().map(ViolationKind::as_str));
        check_known(&at, "there is no invariant or other violation", name, names)?;
        violations.extend(known.clone().filter(|kind| kind.as_str() == name));
    }
    violations.sort_unstable();
    violations.dedup();
    if violations.is_empty() && contents.objective.is_none() {
        let remedy = "name one, such as \"invariants\", or write objective = \"par2\"";
        return Err(Problem::at(
            ["violations"],
            "there is nothing to search for",
            remedy,
        ));
    }
    let times = [
        (
            "abandoned_s",
            ViolationKind::Abandoned,
            contents.abandoned_s,
        ),
        (
            "duplicated_s",
            ViolationKind::Duplicated,
            contents.duplicated_s,
        ),
        ("idle_s", ViolationKind::Idle, contents.idle_s),
    ];
    for (key, kind, time_s) in times {
        TIME.check([key], time_s)?;
        if violations.contains(&kind) && time_s >= scenario.limit_s {
            let limit_s = scenario.limit_s;
            let what = format!("{time_s} s is not shorter than a run of at most {limit_s} s");
            let remedy = "write a shorter time, or a longer limit_s";
            return Err(Problem::at([key], what, remedy));
        }
    }
    FACTOR.check(["slow_factor"], contents.slow_factor)?;
    Ok(Conditions {
        violations,
        abandoned: SimTime::from_secs_f64(contents.abandoned_s),
        duplicated: SimTime::from_secs_f64(contents.duplicated_s),
        idle: SimTime::from_secs_f64(contents.idle_s),
        slow_factor: contents.slow_factor,
        par2_from: None,
    })
}

fn maximizes_par2(contents: &HuntFile) -> Result<bool, Problem> {
    let Some(objective) = &contents.objective else {
        return Ok(false);
    };
    check_known(["objective"], "there is no objective", objective, ["par2"])?;
    if contents.violations.is_some() {
        let what = "a search for the worst PAR2 time does not stop at violations";
        return Err(Problem::at(
            ["violations"],
            what,
            "remove violations, or objective",
        ));
    }
    Ok(true)
}

fn methods(stated: &[String]) -> Result<Vec<Method>, Problem> {
    for (index, name) in stated.iter().enumerate() {
        let at = KeyPath::new(["methods"]).index(index);
        check_known(
            &at,
            "there is no method",
            name,
            Method::ALL.map(Method::as_str),
        )?;
    }
    let is_stated =
        |method: &Method| stated.is_empty() || stated.iter().any(|name| name == method.as_str());
    Ok(Method::ALL.into_iter().filter(is_stated).collect())
}

fn budget(stated: Option<BudgetFile>) -> Result<Budget, Problem> {
    match stated {
        Some(BudgetFile {
            runs: Some(runs),
            seconds: None,
        }) => {
            RUNS.check(["budget", "runs"], runs)?;
            Ok(Budget::Runs(runs as usize))
        }
        Some(BudgetFile {
            runs: None,
            seconds: Some(seconds),
        }) => {
            TIME.check(["budget", "seconds"], seconds)?;
            Ok(Budget::Seconds(seconds))
        }
        Some(BudgetFile { runs: Some(_), .. }) => {
            let what = "a budget is either a number of runs or a time";
            Err(Problem::at(["budget"], what, "remove runs or seconds"))
        }
        Some(_) | None => {
            let what = "the plan has no budget";
            let remedy = "write budget = { runs = 400 }, or { seconds = 60 }";
            Err(Problem::at(["budget"], what, remedy))
        }
    }
}

fn faults(stated: &FaultsFile, scenario: &Scenario) -> Result<FaultBounds, Problem> {
    let known: Vec<&'static str> = names(scenario).collect();
    for (key, list) in [("only", &stated.only), ("without", &stated.without)] {
        for (index, name) in list.iter().enumerate() {
            let at = KeyPath::new(["faults", key]).index(index);
            check_known(&at, "there is no fault", name, known.iter().copied())?;
        }
    }
    FAULTS.check(["faults", "min"], stated.min)?;
    FAULTS.check(["faults", "max"], stated.max)?;
    if stated.max < stated.min {
        let what = format!("{} is less than min = {}", stated.max, stated.min);
        return Err(Problem::at(
            ["faults", "max"],
            what,
            "write a larger number",
        ));
    }
    // The second half of the longest run shows the effect of the faults of the first half.
    let until_s = stated.until_s.unwrap_or(scenario.limit_s / 2.0);
    TIME.check(["faults", "until_s"], until_s)?;
    if until_s < 1.0 || until_s > scenario.limit_s {
        let what = format!(
            "{until_s} s does not fit a run of at most {} s",
            scenario.limit_s
        );
        return Err(Problem::at(
            ["faults", "until_s"],
            what,
            "write at least 1 s and at most limit_s",
        ));
    }
    let is_stated = |name: &&'static str| {
        let is = |list: &[String]| list.iter().any(|other| other == name);
        (stated.only.is_empty() || is(&stated.only)) && !is(&stated.without)
    };
    let names: Vec<&'static str> = known.into_iter().filter(is_stated).collect();
    let sampler = FaultSampler::new(scenario, until_s, |name| names.contains(&name));
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    if !(0..TRIES).any(|_| sampler.attempt(&mut rng).is_some()) {
        let what = "the scenario can have none of these faults";
        return Err(Problem::at(
            ["faults"],
            what,
            "allow more faults in only, or remove without",
        ));
    }
    Ok(FaultBounds {
        min: stated.min as usize,
        max: stated.max as usize,
        until_s,
        names,
    })
}

fn shrink_runs(stated: &ShrinkFile) -> Result<usize, Problem> {
    if stated.runs == 0.0 {
        return Ok(0);
    }
    RUNS.check(["shrink", "runs"], stated.runs)?;
    Ok(stated.runs as usize)
}

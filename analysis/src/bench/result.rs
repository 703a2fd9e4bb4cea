//! The result of a suite: one row per run, and everything that a repetition needs.

use std::fmt;

use proto::program_build;
use proto::tick::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::suite::{RunSettings, SuitePlan};
use crate::compare::metrics::Metric;
use crate::sweep::run::{Row, RunResult};

/// The version of this program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The result of `alliance bench`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchResult {
    /// The name of the suite, such as `v1`.
    pub suite: String,
    /// The digest of the suite's missions, faults and seeds, 16 hexadecimal digits.
    pub suite_digest: String,
    /// The version of the program.
    pub version: String,
    /// The build of the program: a hash of its sources and dependencies, 16 hexadecimal digits.
    pub build: String,
    /// A digest of the controllers in Python with the modules beside them; `null` without controllers.
    pub controllers: Option<String>,
    /// The measured allocators and controllers.
    pub allocators: Vec<String>,
    /// All runs: by mission, class of faults, allocator and seed, in the order of the suite and of `allocators`.
    pub runs: Vec<BenchRun>,
    /// The digest of the other fields, 16 hexadecimal digits. It chooses the runs that a check repeats.
    pub digest: String,
}

/// A run of a suite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchRun {
    pub mission: String,
    /// The class of faults.
    pub faults: String,
    pub allocator: String,
    pub seed: u64,
    pub outcome: Outcome,
    /// The primary metric: `par2_s`, the simulated time or twice the limit if the mission is not complete, or the figure
    /// by which the mission ranks its runs.
    pub metric: String,
    /// The value of the metric; `null` if the run has none.
    pub value: Option<f64>,
    /// The number of broadcasts of all robots.
    pub messages: u64,
    /// The payload of these broadcasts.
    pub bytes: u64,
    /// The hash of the entire run, 16 hexadecimal digits.
    pub hash: String,
}

impl BenchResult {
    /// Makes the result of all runs, in order.
    ///
    /// # Errors
    /// Returns the reason of a failed run.
    pub fn new(
        plan: &SuitePlan,
        controllers: Option<String>,
        rows: &[Row],
    ) -> Result<Self, String> {
        let runs = rows.iter().map(|row| BenchRun::new(plan, row));
        let mut result = Self {
            suite: plan.suite.name.to_owned(),
            suite_digest: plan.digest.clone(),
            version: VERSION.to_owned(),
            build: program_build::get().to_owned(),
            controllers,
            allocators: plan.allocators.clone(),
            runs: runs.collect::<Result<_, String>>()?,
            digest: String::new(),
        };
        result.digest = result.content_digest();
        Ok(result)
    }

    /// Returns the digest of all fields except `digest`.
    #[must_use]
    pub fn content_digest(&self) -> String {
        let content = Self {
            digest: String::new(),
            ..self.clone()
        };
        // Numbers, texts and lists of them always have a form in JSON.
        let text = serde_json::to_vec(&content).unwrap_or_default();
        format!("{:016x}", xxh3_64(&text))
    }
}

impl BenchRun {
    /// Makes the row of a run.
    ///
    /// # Errors
    /// Returns the reason why the run has no figures.
    pub fn new(plan: &SuitePlan, row: &Row) -> Result<Self, String> {
        let figures = match &row.end {
            RunResult::Ended(figures) => figures,
            RunResult::Failed(failure) => return Err(failure.reason.clone()),
        };
        let objective = plan.objective(row.run);
        let value = match &objective.metric {
            Metric::Own(own) => figures.mission.get(&own.figure).number(),
            Metric::Done => figures.done.map(|count| count as f64),
            _ if figures.outcome == Outcome::Complete => Some(figures.sim_time_ms as f64 / 1000.0),
            _ => Some(2.0 * objective.limit_s),
        };
        let settings = plan.settings(row.run);
        Ok(Self {
            mission: settings.mission,
            faults: settings.faults,
            allocator: settings.allocator,
            seed: settings.seed,
            outcome: figures.outcome,
            metric: objective.metric.name(),
            value,
            messages: figures.messages_sent,
            bytes: figures.bytes_sent,
            hash: figures.hash.clone(),
        })
    }

    #[must_use]
    pub fn settings(&self) -> RunSettings {
        RunSettings {
            mission: self.mission.clone(),
            faults: self.faults.clone(),
            allocator: self.allocator.clone(),
            seed: self.seed,
        }
    }

    /// Returns the name of the first figure that differs, with the value here and in the other run.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Option<(&'static str, String, String)> {
        let figures = |run: &Self| {
            [
                ("outcome", run.outcome.as_str().to_owned()),
                ("metric", run.metric.clone()),
                (
                    "value",
                    run.value
                        .map_or("null".to_owned(), |value| value.to_string()),
                ),
                ("messages", run.messages.to_string()),
                ("bytes", run.bytes.to_string()),
                ("hash", run.hash.clone()),
            ]
        };
        let mut pairs = figures(self).into_iter().zip(figures(other));
        pairs.find_map(|((name, own), (_, other))| (own != other).then_some((name, own, other)))
    }
}

impl fmt::Display for RunSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            mission,
            faults,
            allocator,
            seed,
        } = self;
        write!(f, "{mission}, {faults}, {allocator}, seed {seed}")
    }
}

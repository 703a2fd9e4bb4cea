//! One run of a sweep and its row.

use missions::Registry;
use std::collections::BTreeMap;
use std::path::Path;

use proto::control::FaultStatus;
use proto::program_build;
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog, RobotFigures, RunFile, RunLog, RunOutcome};
use scenario::fault::Fault;
use scenario::mission::columns::{ColumnKind, Progress};
use scenario::mission::data::Objective;
use scenario::mission::{FigureValue, MissionFigures};
use serde::{Deserialize, Serialize};
use terminal::panics::catch;

use super::design::{Change, apply_change};
use super::measures::ComparisonMeasures;
use super::plan::{Plan, setup};
use crate::invariants::{Invariants, replayed};
use crate::sweep::comparison::OwnFigure;
use in_process::Team;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub run: usize,
    /// The build of the program that executed the run; empty in journals of older versions.
    #[serde(default)]
    pub build: String,
    pub end: RunResult,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunResult {
    /// The run ended and has figures.
    Ended(Figures),
    /// The run did not start, or did not reach its end.
    Failed(Failure),
}

/// The figures of a run, named as in run.json.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    pub outcome: Outcome,
    /// The hash of the entire run, 16 hexadecimal digits.
    pub hash: String,
    pub sim_time_ms: u64,
    /// The mission's figures by column name. A column of remaining work is replaced by the total.
    pub mission: MissionFigures,
    /// The amount of finished work; `None` in missions that count none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub done: Option<u64>,
    /// The amount of work that expired; `None` in missions in which nothing can expire.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expired: Option<u64>,
    /// The value by which the scenario ranks its runs; `None` if it ranks them by time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ranked_by: Option<RankedBy>,
    pub activations: u64,
    pub messages_sent: u64,
    /// The total payload of these broadcasts.
    pub bytes_sent: u64,
    /// The number of received messages, over all receivers.
    pub messages_received: u64,
    /// The number of lost messages, over all receivers.
    pub messages_lost: u64,
    /// Armed faults by kind.
    pub faults: BTreeMap<String, FaultCount>,
    /// Measures for comparisons; `None` in other sweeps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measures: Option<Box<ComparisonMeasures>>,
}

/// The value of a scenario's own measure ([`Objective`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RankedBy {
    pub metric: String,
    pub more_is_better: bool,
    pub value: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct FaultCount {
    pub armed: u64,
    pub hit: u64,
    /// The number of effects of all these faults.
    pub hits: u64,
}

/// The reason why a run has no figures, and its scenario.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    pub reason: String,
    pub scenario: String,
}

/// Executes a run. Returns `None` if `stops` returned true. A panic becomes the reason of a failed run.
pub fn execute_run(plan: &Plan, run: usize, stops: &dyn Fn() -> bool) -> Option<Row> {
    let end = execute_changed_run(plan, run, &[], plan.design.seed(run), stops)?;
    let build = program_build::get().to_owned();
    Some(Row { run, build, end })
}

/// Executes a run with changes of its scenario and with the given seed.
pub fn execute_changed_run(
    plan: &Plan,
    run: usize,
    changes: &[Change],
    seed: u64,
    stops: &dyn Fn() -> bool,
) -> Option<RunResult> {
    let scenario = plan.scenario_of_seed(run, seed).and_then(|mut scenario| {
        let mut changes = changes.iter();
        changes
            .try_for_each(|each| apply_change(&mut scenario, each))
            .map_err(|problem| problem.to_string())?;
        Ok(scenario)
    });
    let ended = scenario
        .as_ref()
        .map_err(|why| anyhow::Error::msg(why.clone()));
    let ended = ended.and_then(|scenario| {
        let ended = catch(|| simulate(plan, scenario, seed, stops));
        ended.unwrap_or_else(|panic| Err(anyhow::Error::msg(panic)))
    });
    match ended {
        Ok(None) => None,
        Ok(Some(figures)) => Some(RunResult::Ended(figures)),
        Err(error) => Some(RunResult::Failed(Failure {
            reason: format!("{error:#}").replace(['\n', '\r'], " "),
            scenario: scenario.map_or_else(|_| plan.base(), |table| table.to_string()),
        })),
    }
}

fn simulate(
    plan: &Plan,
    scenario: &toml::Table,
    seed: u64,
    stops: &dyn Fn() -> bool,
) -> anyhow::Result<Option<Figures>> {
    let setup = setup(scenario, seed)?;
    let objective = setup.scenario.mission().objective(&setup.scenario);
    let mut invariants = plan.check.then(|| Invariants::new(&setup));
    // The hash of a run does not depend on the log level. A compact log has the same values in fewer rows.
    let level = if plan.measures {
        LogLevel::Compact
    } else {
        LogLevel::Off
    };
    let mut team = Team::new(setup, level, MemoryLog::default())?;
    if plan.measures {
        team.count_traffic();
    }
    let outcome = loop {
        let outcome = team.tick()?;
        if let Some(invariants) = &mut invariants {
            invariants.check_simulation(team.simulation())?;
        }
        if let Some(outcome) = outcome {
            break outcome;
        }
        if stops() {
            return Ok(None);
        }
    };
    let traffic = team.traffic().cloned();
    let (run, recorder) = team.end(outcome)?;
    let mut figures = Figures::of(&run, outcome);
    figures.ranked_by = figures.ranked_by(objective);
    let memory = recorder.into_sink();
    if plan.check {
        let vocabulary = Registry::current().vocabulary();
        replayed::check(&RunLog::from_memory(&memory, &vocabulary)?)?;
    }
    if let Some(traffic) = traffic {
        let log = RunLog::from_tables(Path::new(""), run, memory.tables);
        figures.measures = Some(Box::new(ComparisonMeasures::from_log(&log, &traffic)?));
    }
    Ok(Some(figures))
}

impl Figures {
    fn of(run: &RunFile, outcome: Outcome) -> Self {
        debug_assert_eq!(run.outcome, RunOutcome::Ended(outcome));
        let result = &run.result;
        let sum = |of: fn(&RobotFigures) -> u64| result.robots.values().map(of).sum();
        let progress = Progress::from_row(&run.mission_row());
        Self {
            outcome,
            hash: run.hash.clone().unwrap_or_default(),
            sim_time_ms: result.sim_time_ms.0,
            mission: of_mission(run),
            done: progress.as_ref().map(|progress| progress.done),
            expired: progress.and_then(|progress| progress.expired),
            ranked_by: None,
            activations: sum(|robot| robot.activations.into()),
            messages_sent: sum(|robot| robot.messages_sent),
            bytes_sent: sum(|robot| robot.bytes_sent),
            messages_received: sum(|robot| robot.messages_received),
            messages_lost: sum(|robot| robot.messages_lost),
            faults: by_kind(&run.faults),
            measures: None,
        }
    }

    fn ranked_by(&self, objective: Objective) -> Option<RankedBy> {
        let (metric, more_is_better, value) = match (OwnFigure::new(objective), objective) {
            (Some(own), _) => {
                let value = self.mission.get(&own.figure).number();
                (own.name, own.more_is_better, value)
            }
            (None, Objective::Done) => {
                ("done".to_owned(), true, self.done.map(|count| count as f64))
            }
            (None, _) => return None,
        };
        Some(RankedBy {
            metric,
            more_is_better,
            value,
        })
    }

    /// Returns the greatest lateness of a recurring task, ms: the largest figure whose name ends with `lateness_max_ms`.
    #[must_use]
    pub fn lateness_ms(&self) -> Option<u64> {
        let figures = self.mission.iter();
        let late = figures.filter(|(name, _)| name.ends_with("lateness_max_ms"));
        late.filter(|(_, value)| *value != FigureValue::None)
            .map(|(_, value)| value.count())
            .max()
    }

    /// Returns the sum over all kinds of faults.
    #[must_use]
    pub fn all_faults(&self) -> FaultCount {
        let mut all = FaultCount::default();
        for of_kind in self.faults.values() {
            all.add(of_kind);
        }
        all
    }
}

impl FaultCount {
    pub fn add(&mut self, other: &Self) {
        self.armed += other.armed;
        self.hit += other.hit;
        self.hits += other.hits;
    }
}

fn of_mission(run: &RunFile) -> MissionFigures {
    let reported = &run.result.mission;
    let row = run.mission_row();
    let total = Progress::from_row(&row).map(|progress| progress.total());
    let mut figures = MissionFigures::default();
    for (name, value) in reported.iter() {
        let name = name.replace('.', "_");
        let column = row.iter().find(|column| column.name == name);
        match column.map(|column| column.kind) {
            Some(ColumnKind::Left) => {}
            Some(ColumnKind::Done) => {
                figures.add(&name, value);
                figures.add(&total_of(&name), total);
            }
            _ => figures.add(&name, value),
        }
    }
    figures
}

/// Returns the name of the total that belongs to a count, such as `items_total` for `items_delivered`.
fn total_of(done: &str) -> String {
    let things = done.rsplit_once('_').map(|(things, _)| things);
    things.map_or_else(|| "total".to_owned(), |things| format!("{things}_total"))
}

fn by_kind(faults: &[FaultStatus]) -> BTreeMap<String, FaultCount> {
    let mut counts: BTreeMap<String, FaultCount> = BTreeMap::new();
    for fault in faults {
        let count = counts.entry(kind(&fault.order.fault)).or_default();
        count.add(&FaultCount {
            armed: 1,
            hit: u64::from(fault.hits > 0),
            hits: fault.hits,
        });
    }
    counts
}

/// Returns the fault's name; for sensors and actuators followed by the mode of failure.
fn kind(fault: &Fault) -> String {
    match fault.mode() {
        Some(mode) => format!("{} {mode}", fault.name()),
        None => fault.name().to_owned(),
    }
}

#[cfg(test)]
mod tests {

    use missions::waste::data::default_scenario;

    use super::*;

    fn plan(text: &str) -> Plan {
        Plan::parse("plan.toml", text, |_| Ok(default_scenario())).unwrap()
    }

    #[test]
    fn a_panic_becomes_the_reason_of_the_failed_run() {
        let plan = plan("");
        let row = execute_run(&plan, 0, &|| panic!("out of {}", "luck")).unwrap();
        let RunResult::Failed(failure) = row.end else {
            panic!("{row:?}")
        };
        assert_eq!(failure.reason, "panicked: out of luck");
        let scenario: toml::Table = toml::from_str(&failure.scenario).unwrap();
        assert_eq!(Ok(scenario), plan.scenario(0));
    }

    #[test]
    fn a_stopped_run_leaves_no_row() {
        assert_eq!(execute_run(&plan(""), 0, &|| true), None);
    }

    #[test]
    fn figures_equal_those_of_the_run() {
        let plan = plan("limit_s = 30.0\nseeds = [7]\n");
        let row = execute_run(&plan, 0, &|| false).unwrap();
        let RunResult::Ended(figures) = row.end else {
            panic!("{row:?}")
        };
        let setup = setup(&plan.scenario(0).unwrap(), 7).unwrap();
        let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
        let (outcome, recorder) = team.run().unwrap();
        assert_eq!(
            (figures.outcome, outcome),
            (Outcome::TimeLimit, Outcome::TimeLimit)
        );
        assert_eq!(figures.hash, recorder.hash());
        assert_eq!(figures.sim_time_ms, 30_000);
        let of_mission: Vec<_> = figures.mission.iter().collect();
        let expected = [
            ("items_delivered", FigureValue::Count(0)),
            ("items_total", FigureValue::Count(24)),
            ("reports_made", FigureValue::Count(0)),
            ("report_lateness_mean_ms", FigureValue::None),
            ("report_lateness_max_ms", FigureValue::None),
        ];
        assert_eq!(of_mission, expected);
        assert_eq!(figures.lateness_ms(), None);
        assert!(figures.messages_sent > 0 && figures.bytes_sent > figures.messages_sent);
    }
}

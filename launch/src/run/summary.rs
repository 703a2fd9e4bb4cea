//! The result of a finished run, as a table or as JSON.

use std::path::Path;

use analysis::interrupted::INTERRUPTED_STATUS;
use analysis::report::takeovers::takeovers_in;
use analysis::shell::shell_quoted;
use analysis::table;
use comfy_table::Table;
use proto::control::{FaultStatus, Phase};
use proto::tick::Outcome;
use run_log::{LogLevel, RunFile, RunOutcome};
use scenario::mission::FigureValue;
use scenario::mission::columns::{ColumnValue, Progress, display_name, format_value};
use scenario::time::SimTime;
use serde_json::json;
use terminal::{counted, stderr_line};

use super::plan::RunPlan;

/// The largest number of robots in the table.
const ROBOTS: usize = 100;
/// The maximum number of takeovers in the result.
const TAKEOVERS: usize = 20;

pub fn show(plan: &RunPlan, run: &RunFile) -> anyhow::Result<()> {
    let host: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(plan.folder.join("host.json"))?)?;
    if run.unscripted {
        stderr_line!(
            "note: this run contains a stall, a loss or bodies of another world, which no fault explains (`unscripted` in run.json)"
        );
    }
    for (robot, build) in &run.agent_builds {
        stderr_line!(
            "note: the agent of {robot} is of build {build}, the world of {}; a replay can differ",
            run.build
        );
    }
    if plan.json {
        let result = json!({
            "run": plan.run,
            "folder": plan.folder,
            "seed": run.setup.seed,
            "hash": run.hash,
            "outcome": run.outcome,
            "branch": run.branch,
            "unscripted": run.unscripted,
            "result": run.result,
            "faults": run.faults,
            "host": host,
        });
        terminal::print(format_args!("{result:#}\n"))?;
        return Ok(());
    }
    stderr_line!("{}", robots(plan, run).trim_fmt());
    if let Some(others @ 1..) = run.result.robots.len().checked_sub(ROBOTS) {
        let others = counted(others, "more robot");
        stderr_line!("and {others}; run.json has all figures");
    }
    let result = &run.result;
    let real_s = host["running_s"].as_f64().unwrap_or_default();
    let ticks_per_s = host["ticks_per_s"].as_f64().unwrap_or_default();
    let line = format!("{}: {}", outcome(run), mission(run));
    stderr_line!("{}", table::paragraph(&line));
    stderr_line!(
        "{} simulated in {real_s:.1} s: {} ticks, {ticks_per_s:.0} per second",
        result.sim_time_ms,
        result.ticks,
    );
    let takeovers = takeovers_in(&plan.folder, run);
    for takeover in takeovers.iter().take(TAKEOVERS) {
        stderr_line!("{takeover}");
    }
    if let Some(others @ 1..) = takeovers.len().checked_sub(TAKEOVERS) {
        let others = counted(others, "more takeover");
        stderr_line!("and {others}; `alliance report` lists all");
    }
    if let Some(line) = faults(&run.faults, run.result.sim_time_ms) {
        stderr_line!("{line}");
    }
    stderr_line!("folder  {}", plan.folder.display());
    stderr_line!("seed    {}", run.setup.seed);
    stderr_line!("hash    {}", run.hash.as_deref().unwrap_or("none"));
    if let Some(line) = reduced_log(plan.log, run.setup.behavior_sets()) {
        stderr_line!("{line}");
    }
    if let Some(origin) = &run.branch {
        let (run, t_ms) = (&origin.run, origin.t_ms);
        stderr_line!("branch  of {run} at {t_ms}, hash {}", origin.hash);
    }
    if !plan.open {
        let folder = shell_quoted(&plan.folder);
        if let Some(origin) = &run.branch {
            let parent = shell_quoted(Path::new(&origin.run));
            stderr_line!("next    alliance diff {parent} {folder}");
            if run.log.has_every_tick() {
                stderr_line!("        alliance report {parent} {folder}");
            }
            return Ok(());
        }
        stderr_line!("next    alliance watch {folder}");
        if run.log.has_every_tick() {
            stderr_line!("        alliance report {folder}");
        }
    }
    Ok(())
}

/// Returns the exit status of `alliance run` for the outcome of the run.
#[must_use]
pub fn exit_status(outcome: RunOutcome) -> u8 {
    match outcome {
        RunOutcome::Ended(Outcome::Complete) => 0,
        RunOutcome::Ended(Outcome::Interrupted) => INTERRUPTED_STATUS,
        RunOutcome::Ended(_) | RunOutcome::Running => 1,
    }
}

/// Returns the reason for a log without every tick although the user did not choose its level.
fn reduced_log(chosen: Option<LogLevel>, behavior_sets: usize) -> Option<String> {
    let level = LogLevel::default_for(behavior_sets);
    (chosen.is_none() && !level.has_every_tick()).then(|| {
        format!(
            "log     {}, because the team has {behavior_sets} behavior sets; --log compact keeps each tick",
            level.as_str()
        )
    })
}

fn outcome(run: &RunFile) -> &'static str {
    match run.outcome {
        RunOutcome::Ended(outcome) => outcome.as_str(),
        RunOutcome::Running => "not ended",
    }
}

/// Returns the progress of the mission and its other figures as text.
fn mission(run: &RunFile) -> String {
    let figures = &run.result.mission;
    let columns = run.setup.catalog.mission.vocabulary().columns.iter();
    let row: Vec<ColumnValue> = columns
        .filter_map(|column| Some(column.with_value(figures.column(column.name)?)))
        .collect();
    let progress = Progress::from_row(&row);
    let is_in_row = |name: &str| {
        row.iter()
            .any(|column| column.name == name.replace('.', "_"))
    };
    let others = figures
        .iter()
        .filter(|(name, value)| {
            *value != FigureValue::None && (progress.is_none() || !is_in_row(name))
        })
        .map(|(name, value)| format_value(name, value));
    let parts: Vec<String> = progress
        .iter()
        .map(Progress::to_string)
        .chain(others)
        .collect();
    parts.join(", ")
}

/// Returns a line with the number of effective faults, the ids of ineffective ones, and the number of faults due after
/// the end of the run.
fn faults(faults: &[FaultStatus], end: SimTime) -> Option<String> {
    if faults.is_empty() {
        return None;
    }
    let (due, others): (Vec<_>, Vec<_>) = faults
        .iter()
        .partition(|fault| fault.hits > 0 || fault.applied_ms.is_some());
    let idle = due.iter().filter(|fault| fault.hits == 0);
    let idle: Vec<String> = idle
        .map(|fault| match &fault.failed {
            None => fault.id.clone(),
            Some(why) => format!("{} ({why})", fault.id),
        })
        .collect();
    let hit = due.len() - idle.len();
    let mut line = format!("faults  {hit} of {} took effect", faults.len());
    if !idle.is_empty() {
        line += &format!("; without effect: {}", idle.join(", "));
    }
    // A fault that was due after the end is no mistake in the scenario, so it is only counted.
    let armed = others
        .into_iter()
        .filter(|fault| fault.phase == Phase::Armed);
    let (later, waiting): (Vec<&FaultStatus>, Vec<&FaultStatus>) =
        armed.partition(|fault| fault.order.at().is_some_and(|at| at >= end));
    if !waiting.is_empty() {
        let waiting = waiting.iter().map(|fault| fault.id.as_str());
        let waiting: Vec<&str> = waiting.collect();
        line += &format!("; still waiting at the end: {}", waiting.join(", "));
    }
    if !later.is_empty() {
        line += &format!("; not due before the end: {}", later.len());
    }
    Some(line)
}

fn robots(plan: &RunPlan, run: &RunFile) -> Table {
    // By rank; `result.robots` is ordered by name.
    let robots = plan.setup.scenario.robots.iter();
    let robots: Vec<_> = robots
        .filter_map(|robot| Some((robot.name.clone(), run.result.robots.get(&robot.name)?)))
        .take(ROBOTS)
        .collect();
    // All robots have the same mission figures.
    let mission_names = robots.first().map(|(_, first)| first.mission.iter());
    let mission_names: Vec<&str> = mission_names
        .into_iter()
        .flatten()
        .map(|(name, _)| name)
        .collect();
    let heads = ["robot", "incarnations", "activations"].map(ToOwned::to_owned);
    let heads = heads.into_iter();
    let heads = heads.chain(
        mission_names
            .iter()
            .map(|name| display_name(name).replace(' ', "\n")),
    );
    let heads = heads.chain(["messages\nsent", "received", "lost"].map(ToOwned::to_owned));
    let mut table = table::new(heads);
    for (name, figures) in robots {
        let counts = [
            figures.incarnations.to_string(),
            figures.activations.to_string(),
        ];
        let values = mission_names.iter();
        let values = values.map(|name| table::figure(figures.mission.get(name)));
        let messages = [
            figures.messages_sent,
            figures.messages_received,
            figures.messages_lost,
        ];
        let messages = messages.map(|count| count.to_string());
        table.add_row(
            [name]
                .into_iter()
                .chain(counts)
                .chain(values)
                .chain(messages),
        );
    }
    table::align_right(&mut table, 1..);
    // The general figures that matter least: messages received, incarnations, activations.
    let received = table.column_count() - 2;
    table::hide_instead_of_wrap(&mut table, &[received, 1, 2]);
    table
}

#[cfg(test)]
mod tests {
    use scenario::fault::{Fault, Order};

    use super::*;

    fn fault(id: &str, applied: bool, hits: u64) -> FaultStatus {
        FaultStatus {
            id: id.to_owned(),
            order: Order::now(Fault::Kill("gold".to_owned())),
            phase: if applied { Phase::Over } else { Phase::Armed },
            applied_ms: applied.then_some(SimTime(1000)),
            healed_ms: None,
            failed: None,
            hits,
        }
    }

    #[test]
    fn a_log_level_that_the_user_chose_needs_no_reason() {
        assert_eq!(reduced_log(Some(LogLevel::Summary), 2_001), None);
        assert_eq!(reduced_log(None, 2_000), None);
        assert_eq!(
            reduced_log(None, 2_001).as_deref(),
            Some(
                "log     summary, because the team has 2001 behavior sets; --log compact keeps each tick"
            )
        );
    }

    #[test]
    fn faults_due_after_the_end_are_counted_and_not_listed() {
        let mut all = [
            fault("a", true, 1),
            fault("b", true, 0),
            fault("c", true, 0),
            fault("random-5", false, 0),
            fault("random-6", false, 0),
            fault("waits", false, 0),
            fault("cleared", false, 0),
        ];
        all[2].failed = Some("no process".to_owned());
        all[3].order.at_s = Some(60.0);
        all[4].order.at_s = Some(70.0);
        all[5].order.when = Some("gold picks".parse().unwrap());
        all[6].phase = Phase::Over;
        let faults = |all: &[FaultStatus]| faults(all, SimTime(60_000));
        assert_eq!(faults(&[]), None);
        assert_eq!(
            faults(&all[..1]).as_deref(),
            Some("faults  1 of 1 took effect")
        );
        assert_eq!(
            faults(&all).as_deref(),
            Some(
                "faults  1 of 7 took effect; without effect: b, c (no process); still waiting at the end: waits; \
                 not due before the end: 2"
            )
        );
    }
}

//! What a finished run shows: a table for people, JSON for programs.

use alliance_proto::control::FaultStatus;
use alliance_proto::log::{LogLevel, RunFile, RunOutcome};
use alliance_proto::mission::Value;
use alliance_proto::mission::columns::{ColumnValue, Progress, label, told};
use alliance_proto::{tell, terminal};
use comfy_table::{CellAlignment, Table};
use serde_json::json;
use study::table;

use super::plan::Plan;

/// Shows it.
pub fn show(plan: &Plan, run: &RunFile) -> anyhow::Result<()> {
    let host: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(plan.folder.join("host.json"))?)?;
    if run.unscripted {
        tell!(
            "note: a stall or a loss that the scenario did not ask for is part of this run (`unscripted` in run.json)"
        );
    }
    if plan.json {
        let result = json!({
            "run": plan.run,
            "folder": plan.folder,
            "seed": run.setup.seed,
            "hash": run.hash,
            "outcome": run.outcome,
            "unscripted": run.unscripted,
            "result": run.result,
            "faults": run.faults,
            "host": host,
        });
        terminal::print(format_args!("{result:#}\n"))?;
        return Ok(());
    }
    tell!("{}", robots(plan, run).trim_fmt());
    let result = &run.result;
    let real_s = host["running_s"].as_f64().unwrap_or_default();
    let ticks_per_s = host["ticks_per_s"].as_f64().unwrap_or_default();
    tell!("{}: {}", outcome(run), mission(run));
    tell!(
        "{} simulated in {real_s:.1} s: {} ticks, {ticks_per_s:.0} per second",
        result.sim_time_ms,
        result.ticks,
    );
    if let Some(line) = faults(&run.faults) {
        tell!("{line}");
    }
    tell!("folder  {}", plan.folder.display());
    tell!("seed    {}", run.setup.seed);
    tell!("hash    {}", run.hash.as_deref().unwrap_or("none"));
    let sets = run.setup.behavior_sets();
    if run.log != LogLevel::Full && LogLevel::of_a_team(sets) == run.log {
        tell!(
            "log     {}, for there are {sets} behavior sets; for a report --log full",
            run.log.as_str()
        );
    }
    if !plan.open {
        let folder = plan.folder.display();
        tell!("next    alliance view {folder}");
        if run.log == LogLevel::Full {
            tell!("        alliance report {folder}");
        }
    }
    Ok(())
}

fn outcome(run: &RunFile) -> &'static str {
    match run.outcome {
        RunOutcome::Ended(outcome) => outcome.as_str(),
        RunOutcome::Running => "not ended",
    }
}

/// How far the mission has come, and what else it tells of the run.
fn mission(run: &RunFile) -> String {
    let figures = &run.result.mission;
    let columns = run.setup.catalog.mission.terms().columns.iter();
    let row: Vec<ColumnValue> = columns
        .filter_map(|column| Some(column.with(figures.column(column.name)?)))
        .collect();
    let progress = Progress::of(&row);
    let is_in_row = |name: &str| row.iter().any(|it| it.name == name.replace('.', "_"));
    let others = figures
        .iter()
        .filter(|(name, value)| *value != Value::None && (progress.is_none() || !is_in_row(name)))
        .map(|(name, value)| told(name, value));
    let parts: Vec<String> = progress
        .iter()
        .map(Progress::to_string)
        .chain(others)
        .collect();
    parts.join(", ")
}

/// How many faults have hit, which never did, for those have tested nothing, and how many the run was too short for.
fn faults(faults: &[FaultStatus]) -> Option<String> {
    if faults.is_empty() {
        return None;
    }
    // What was due after the end has tested nothing either, but is nobody's mistake.
    let (due, later): (Vec<_>, Vec<_>) = faults
        .iter()
        .partition(|fault| fault.hits > 0 || fault.applied_ms.is_some());
    let idle = due.iter().filter(|fault| fault.hits == 0);
    let idle: Vec<&str> = idle.map(|fault| fault.id.as_str()).collect();
    let hit = due.len() - idle.len();
    let mut line = match hit {
        hit if hit == faults.len() => format!("faults  all {hit} have hit"),
        hit => format!("faults  {hit} of {} have hit", faults.len()),
    };
    if !idle.is_empty() {
        line += &format!("; never: {}", idle.join(", "));
    }
    if !later.is_empty() {
        line += &format!("; not due before the end: {}", later.len());
    }
    Some(line)
}

fn robots(plan: &Plan, run: &RunFile) -> Table {
    // By rank, as everywhere; `result.robots` is by name.
    let robots = plan.setup.scenario.robots.iter();
    let robots: Vec<_> = robots
        .filter_map(|robot| Some((robot.name.clone(), run.result.robots.get(&robot.name)?)))
        .collect();
    // The mission's own figures are the same for all.
    let own = robots.first().map(|(_, first)| first.mission.iter());
    let own: Vec<&str> = own.into_iter().flatten().map(|(name, _)| name).collect();
    let heads = ["robot", "lives", "activations"].map(ToOwned::to_owned);
    let heads = heads.into_iter();
    let heads = heads.chain(own.iter().map(|name| label(name).replace(' ', "\n")));
    let heads = heads.chain(["messages\nsent", "heard", "lost"].map(ToOwned::to_owned));
    let mut table = table::new(heads);
    for (name, figures) in robots {
        let counts = [figures.lives.to_string(), figures.activations.to_string()];
        let own = own.iter().map(|own| match figures.mission.get(own) {
            Value::Count(count) => count.to_string(),
            Value::Real(number) => format!("{number:.2}"),
            Value::None => "–".to_owned(),
        });
        let messages = [
            figures.messages_sent,
            figures.messages_heard,
            figures.messages_lost,
        ];
        let messages = messages.map(|count| count.to_string());
        table.add_row([name].into_iter().chain(counts).chain(own).chain(messages));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

#[cfg(test)]
mod tests {
    use alliance_proto::control::Phase;
    use alliance_proto::fault::{Fault, Order};
    use alliance_proto::time::SimTime;

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
    fn what_was_due_after_the_end_is_counted_and_not_listed() {
        let all = [
            fault("a", true, 1),
            fault("b", true, 0),
            fault("random-5", false, 0),
            fault("random-6", false, 0),
        ];
        assert_eq!(faults(&[]), None);
        assert_eq!(faults(&all[..1]).as_deref(), Some("faults  all 1 have hit"));
        assert_eq!(
            faults(&all).as_deref(),
            Some("faults  1 of 4 have hit; never: b; not due before the end: 2")
        );
    }
}

//! What a finished run shows: a table for people, JSON for programs.

use alliance_proto::control::FaultStatus;
use alliance_proto::log::{LogLevel, RunFile, RunOutcome};
use alliance_proto::time::SimTime;
use alliance_proto::{tell, terminal};
use comfy_table::{CellAlignment, Table};
use missions::waste::data::{WasteFigures, WasteRobotFigures};
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
    tell!("{}", robots(plan, run));
    let result = &run.result;
    let waste = WasteFigures::of(&result.mission);
    let real_s = host["running_s"].as_f64().unwrap_or_default();
    let ticks_per_s = host["ticks_per_s"].as_f64().unwrap_or_default();
    let late = waste.report_lateness_max_ms.map_or_else(String::new, |ms| {
        format!(", the latest {} late", SimTime(ms))
    });
    tell!(
        "{}: {} of {} items delivered, {} progress reports{late}",
        outcome(run),
        waste.items.delivered,
        waste.items.total(),
        waste.reports_made,
    );
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
    let mut table = table::new([
        "robot",
        "lives",
        "activations",
        "items\ndelivered",
        "reports",
        "messages\nsent",
        "heard",
        "lost",
    ]);
    // By rank, as everywhere; `result.robots` is by name.
    for robot in &plan.setup.scenario.robots {
        if let Some(figures) = run.result.robots.get(&robot.name) {
            let waste = WasteRobotFigures::of(&figures.mission);
            table.add_row([
                robot.name.clone(),
                figures.lives.to_string(),
                figures.activations.to_string(),
                waste.items_delivered.to_string(),
                waste.reports_made.to_string(),
                figures.messages_sent.to_string(),
                figures.messages_heard.to_string(),
                figures.messages_lost.to_string(),
            ]);
        }
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

//! What a finished run shows: a table for people, JSON for programs.

use alliance_proto::control::FaultStatus;
use alliance_proto::log::{RunFile, RunOutcome};
use alliance_proto::mission::waste::{WasteFigures, WasteRobotFigures};
use alliance_proto::time::SimTime;
use alliance_proto::{tell, terminal};
use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use serde_json::json;

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
    Ok(())
}

fn outcome(run: &RunFile) -> &'static str {
    match run.outcome {
        RunOutcome::Ended(outcome) => outcome.as_str(),
        RunOutcome::Running => "not ended",
    }
}

/// How many faults have hit, and which never did: those have tested nothing.
fn faults(faults: &[FaultStatus]) -> Option<String> {
    let idle: Vec<&str> = faults
        .iter()
        .filter(|fault| fault.hits == 0)
        .map(|fault| fault.id.as_str())
        .collect();
    let hit = faults.len() - idle.len();
    match (faults, idle.as_slice()) {
        ([], _) => None,
        (_, []) => Some(format!("faults  all {hit} have hit")),
        (all, idle) => Some(format!(
            "faults  {hit} of {} have hit; never: {}",
            all.len(),
            idle.join(", ")
        )),
    }
}

fn robots(plan: &Plan, run: &RunFile) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED).set_header([
        "robot",
        "lives",
        "activations",
        "items delivered",
        "reports",
        "messages sent",
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

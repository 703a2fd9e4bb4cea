//! A check for people and for programs.

use std::fmt::Write;

use alliance_proto::scenario::Setup;
use comfy_table::{CellAlignment, Table};
use serde_json::{Value, json};

use super::Check;
use super::forecast::{Forecast, Takeover};
use crate::table;

/// The tables, what they say, and the warnings.
pub fn text(setup: &Setup, check: &Check) -> String {
    let mut text = String::new();
    for (robots, table) in tables(&check.forecasts) {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{}\n{}", robots.join(", "), table.trim_fmt());
    }
    text += "times in s; silent, failing, working: taking over from such a teammate, counted from its first word\n";
    for warning in &check.warnings {
        let _ = writeln!(
            text,
            "warning: {} of {}: {}",
            warning.set,
            warning.robots.join(", "),
            warning.text
        );
    }
    if check.warnings.is_empty() {
        let _ = writeln!(text, "{}: no warnings", setup.scenario.name);
    }
    text
}

/// A table for each group of robots, with one row for all robots that have the same figures.
fn tables(forecasts: &[Forecast]) -> Vec<(Vec<&str>, Table)> {
    let mut rows: Vec<(Vec<&str>, [String; 8])> = Vec::new();
    for forecast in forecasts {
        let figures = figures(forecast);
        let same = rows.iter_mut().find(|(_, known)| *known == figures);
        match same {
            Some((robots, _)) => robots.push(&forecast.robot),
            None => rows.push((vec![&forecast.robot], figures)),
        }
    }
    let mut tables: Vec<(Vec<&str>, Table)> = Vec::new();
    for (robots, figures) in rows {
        let of_group = tables.iter().position(|(group, _)| *group == robots);
        let of_group = of_group.unwrap_or_else(|| {
            tables.push((robots, empty_table()));
            tables.len() - 1
        });
        tables[of_group].1.add_row(figures);
    }
    for (_, table) in &mut tables {
        // As many columns as 80 characters have room for.
        for column in table.column_iter_mut() {
            column.set_padding((0, 1));
        }
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table::keep_whole(table, &[0]);
    }
    tables
}

fn empty_table() -> Table {
    table::new([
        "behavior set",
        "active\nafter",
        "silent",
        "failing",
        "working",
        "yields",
        "gives\nup",
        "unit of\nwork",
    ])
}

fn figures(forecast: &Forecast) -> [String; 8] {
    let over = |time: fn(&Takeover) -> f64| range(forecast.takeovers.iter().map(time));
    [
        forecast.set.clone(),
        seconds(forecast.activates_s),
        over(|it| it.silent_s),
        over(|it| it.failing_s),
        over(|it| it.working_s.unwrap_or(f64::INFINITY)),
        seconds(forecast.yields_s),
        seconds(forecast.gives_up_s),
        format!("≈ {:.0}", forecast.work_s),
    ]
}

/// The least and the most of times toward several teammates.
fn range(times: impl Iterator<Item = f64> + Clone) -> String {
    let least = times.clone().fold(f64::INFINITY, f64::min);
    match times.reduce(f64::max) {
        None => "-".to_owned(),
        Some(most) if most == least => seconds(most),
        Some(most) => format!("{} to {}", seconds(least), seconds(most)),
    }
}

fn seconds(time: f64) -> String {
    if time.is_finite() {
        format!("{time:.1}")
    } else {
        "never".to_owned()
    }
}

/// The same for programs; a `working_s` of null means never.
pub fn json(setup: &Setup, check: &Check) -> Value {
    let takeover = |it: &Takeover| {
        json!({
            "teammate": it.teammate,
            "behavior_set": it.set,
            "silent_s": it.silent_s,
            "failing_s": it.failing_s,
            "working_s": it.working_s,
        })
    };
    let sets: Vec<Value> = check
        .forecasts
        .iter()
        .map(|it| {
            json!({
                "robot": it.robot,
                "behavior_set": it.set,
                "task": it.task,
                "activates_s": it.activates_s,
                "yields_s": it.yields_s,
                "gives_up_s": it.gives_up_s,
                "unit_of_work_s": it.work_s,
                "takeovers": it.takeovers.iter().map(takeover).collect::<Vec<_>>(),
            })
        })
        .collect();
    let warnings: Vec<Value> = check
        .warnings
        .iter()
        .map(|it| {
            json!({
                "kind": it.kind.as_str(),
                "behavior_set": it.set,
                "robots": it.robots,
                "text": it.text,
            })
        })
        .collect();
    json!({
        "scenario": setup.scenario.name,
        "sets": sets,
        "warnings": warnings,
    })
}

//! A check for people and for programs.

use std::fmt::Write;

use alliance_proto::scenario::Setup;
use comfy_table::presets::UTF8_FULL_CONDENSED;
use comfy_table::{CellAlignment, Table};
use serde_json::{Value, json};

use super::Check;
use super::forecast::{Forecast, Takeover};

/// The table, what it says, and the warnings.
pub fn text(setup: &Setup, check: &Check) -> String {
    let mut text = format!(
        "{}\ntimes in s; silent, failing, working: taking over from such a teammate, counted from its first word\n",
        table(&check.forecasts)
    );
    for warning in &check.warnings {
        // Writing to a String cannot fail.
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

/// One row for all robots that have the same figures.
fn table(forecasts: &[Forecast]) -> Table {
    let mut rows: Vec<(Vec<&str>, [String; 8])> = Vec::new();
    for forecast in forecasts {
        let figures = figures(forecast);
        let same = rows.iter_mut().find(|(_, known)| *known == figures);
        match same {
            Some((robots, _)) => robots.push(&forecast.robot),
            None => rows.push((vec![&forecast.robot], figures)),
        }
    }
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED).set_header([
        "robots",
        "behavior set",
        "activates",
        "silent",
        "failing",
        "working",
        "yields",
        "gives up",
        "unit of work",
    ]);
    for (robots, figures) in rows {
        table.add_row([robots.join(", ")].into_iter().chain(figures));
    }
    for column in table.column_iter_mut().skip(2) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
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
        format!("about {:.0}", forecast.work_s),
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

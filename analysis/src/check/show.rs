//! Output of a check as text and as JSON.

use std::collections::HashMap;
use std::fmt::Write;

use comfy_table::Table;
use scenario::Setup;
use serde_json::{Value, json};

use super::Check;
use super::forecast::{Forecast, Takeover};
use crate::compare::metrics::Metric;
use crate::table;

pub fn text(setup: &Setup, check: &Check) -> String {
    let mut text = String::new();
    for (robots, table) in tables(&check.forecasts) {
        let _ = writeln!(text, "{}\n{}", robots.join(", "), table.trim_fmt());
    }
    text += "times in s; silent, failing, working: takeover from such a teammate, counted from its first message\n";
    let _ = writeln!(text, "{}", check.class);
    let _ = writeln!(
        text,
        "primary metric {}, {} is better",
        check.primary.name(),
        better(&check.primary)
    );
    for warning in &check.warnings {
        let _ = writeln!(
            text,
            "warning: {} of {}: {}",
            warning.set,
            warning.robots.join(", "),
            warning.text
        );
    }
    for contradiction in &check.contradictions {
        let _ = writeln!(text, "warning: {contradiction}");
    }
    if check.warnings.is_empty() && check.contradictions.is_empty() {
        let _ = writeln!(text, "{}: no warnings", setup.scenario.name);
    }
    text
}

/// Returns the direction in which values of a metric are better.
fn better(metric: &Metric) -> &'static str {
    if metric.more_is_better() {
        "more"
    } else {
        "less"
    }
}

/// Creates a table for each group of robots. Robots with equal figures share a row.
fn tables(forecasts: &[Forecast]) -> Vec<(Vec<&str>, Table)> {
    let mut rows: Vec<(Vec<&str>, [String; 8])> = Vec::new();
    let mut known: HashMap<[String; 8], usize> = HashMap::new();
    for forecast in forecasts {
        let figures = figures(forecast);
        match known.get(&figures) {
            Some(place) => rows[*place].0.push(&forecast.robot),
            None => {
                known.insert(figures.clone(), rows.len());
                rows.push((vec![&forecast.robot], figures));
            }
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
        // The narrow padding makes all columns fit 80 characters.
        for column in table.column_iter_mut() {
            column.set_padding((0, 1));
        }
        table::align_right(table, 1..8);
        table::no_wrap(table, &[0]);
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
        over(|takeover| takeover.silent_s),
        over(|takeover| takeover.failing_s),
        over(|takeover| takeover.working_s.unwrap_or(f64::INFINITY)),
        seconds(forecast.yields_s),
        seconds(forecast.gives_up_s),
        format!("≈ {:.0}", forecast.work_s),
    ]
}

/// Formats the minimum and maximum of times toward several teammates.
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

/// Returns the result as JSON. A `working_s` of null means never.
pub fn json(setup: &Setup, check: &Check) -> Value {
    let warnings = check.warnings.iter().map(|warning| json!(warning));
    let contradictions = check.contradictions.iter().map(
        |text| json!({ "kind": "scenario", "behavior_set": null, "robots": [], "text": text }),
    );
    let class = check.class.0.iter();
    let class = class.map(|part| json!({ "name": part.name, "reason": part.reason }));
    json!({
        "scenario": setup.scenario.name,
        "class": class.collect::<Vec<_>>(),
        "primary_metric": {
            "name": check.primary.name(),
            "better": better(&check.primary),
            "meaning": check.primary.meaning(),
        },
        "sets": check.forecasts,
        "warnings": warnings.chain(contradictions).collect::<Vec<_>>(),
    })
}

//! Output of a check as text and as JSON.

use std::collections::HashMap;
use std::fmt::Write;
use std::hash::Hash;

use comfy_table::Table;
use scenario::Setup;
use serde_json::{Value, json};
use terminal::counted;

use super::Check;
use super::forecast::{Forecast, Takeover};
use crate::compare::metrics::Metric;
use crate::table;

/// The columns: the name of a behavior set and its figures.
const HEADER: [&str; 8] = [
    "behavior set",
    "active\nafter",
    "silent",
    "failing",
    "working",
    "yields",
    "gives\nup",
    "unit of\nwork",
];
const COLUMNS: usize = HEADER.len();

pub fn text(setup: &Setup, check: &Check) -> String {
    let mut text = String::new();
    for ((robots, rows), others) in groups(&check.forecasts) {
        let _ = writeln!(text, "{}\n{}", robots.join(", "), table_of(rows).trim_fmt());
        if others > 0 {
            let others = counted(others, "more group");
            let _ = writeln!(text, "and {others} of robots with the same times");
        }
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

/// A row of a table: the name of a behavior set, then its figures.
type Cells = [String; COLUMNS];

/// The robots with the same behavior sets and figures, and the rows of their table.
type Group<'f> = (Vec<&'f str>, Vec<Cells>);

/// Returns groups of robots, each with the number of further groups that differ from it only in names.
fn groups(forecasts: &[Forecast]) -> Vec<(Group<'_>, usize)> {
    let rows = grouped(forecasts.iter().map(|f| (cells(f), f.robot.as_str())));
    let groups = grouped(rows.into_iter().map(|(cells, robots)| (robots, cells)));
    let by_figures = groups.into_iter().map(|(robots, rows)| {
        let figures = rows.iter().map(|[_, figures @ ..]| figures.clone());
        let figures: Vec<[String; COLUMNS - 1]> = figures.collect();
        ((robots.len(), figures), (robots, rows))
    });
    let first = grouped(by_figures).into_iter().filter_map(|(_, alike)| {
        let others = alike.len() - 1;
        Some((alike.into_iter().next()?, others))
    });
    first.collect()
}

/// Collects the values of each key. Keys and values stay in the order of their first occurrence.
fn grouped<K: Clone + Eq + Hash, V>(pairs: impl Iterator<Item = (K, V)>) -> Vec<(K, Vec<V>)> {
    let mut groups: Vec<(K, Vec<V>)> = Vec::new();
    let mut known: HashMap<K, usize> = HashMap::new();
    for (key, value) in pairs {
        let place = *known.entry(key).or_insert_with_key(|key| {
            groups.push((key.clone(), Vec::new()));
            groups.len() - 1
        });
        groups[place].1.push(value);
    }
    groups
}

/// Creates the table of a group.
fn table_of(rows: Vec<Cells>) -> Table {
    let mut table = table::new(HEADER);
    table.add_rows(rows);
    // The narrow padding makes all columns fit 80 characters.
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
    }
    table::align_right(&mut table, 1..COLUMNS);
    table::no_wrap(&mut table, &[0]);
    table
}

fn cells(forecast: &Forecast) -> Cells {
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

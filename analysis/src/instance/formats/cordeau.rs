//! Cordeau's format of vehicle routing with depots and time windows (Cordeau, Laporte and Mercier, Journal of the
//! Operational Research Society 52, 2001): numbers alone.
//!
//! The first row has the type, the vehicles per depot, the customers and the depots. A row per depot has the longest
//! duration and the capacity. Rows of customers have number, x, y, service time, demand, frequency, the visits and their
//! days, and, with time windows, the earliest and the latest beginning.

use scenario::Problem;

use super::super::source::{Depot, Loaded, Source};
use super::vehicles::{Customer, load, numbers, whole};

/// The types with one period: a depot, several depots, and both with time windows.
const TYPES: [u64; 4] = [0, 2, 4, 6];
/// The types in which the depots follow the customers. Otherwise the depot precedes them.
const SEVERAL_DEPOTS: [u64; 2] = [2, 6];

/// Returns true if the text begins with four whole numbers, followed by a row of two.
pub(super) fn is_cordeau(text: &str) -> bool {
    let mut rows = text.lines().map(str::split_whitespace);
    let mut is_row = |count| {
        rows.next().is_some_and(|mut row| {
            row.clone().count() == count && row.all(|word| word.parse::<u64>().is_ok())
        })
    };
    is_row(4) && is_row(2)
}

/// Reads a file in Cordeau's format.
///
/// # Errors
/// Returns the first line that does not fit, or the type if it has several periods.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    let content = (1..).zip(source.text.lines());
    let mut rows = content.filter(|(_, line)| !line.trim().is_empty());
    let last = source.text.lines().count().max(1);
    let mut next = |what: &str, least: usize| -> Result<(usize, Vec<f64>), Problem> {
        let (line, text) = rows.next().ok_or_else(|| {
            source.error(last, format!("{what} is missing"), "write one row for each")
        })?;
        let row = numbers(source, line, text)?;
        if row.len() < least {
            let problem = format!("{what} has {} numbers, not {least}", row.len());
            return Err(source.error(line, problem, "write all of them"));
        }
        Ok((line, row))
    };
    let (line, head) = next("the first row", 4)?;
    let kind = whole(source, line, head[0])?;
    if !TYPES.contains(&kind) {
        let what = format!("problems of type {kind} have several periods or unlike vehicles");
        return Err(source.error(line, what, "use type 0, 2, 4 or 6"));
    }
    let vehicles = whole(source, line, head[1])? as usize;
    let count = whole(source, line, head[2])? as usize;
    // Problems with one depot state 1 or the number of days.
    let depots = whole(source, line, head[3])?.max(1) as usize;
    let mut capacities = Vec::new();
    for _ in 0..depots {
        let (_, limits) = next("the row of a depot", 2)?;
        // 0 means no limit.
        capacities.push(Some(limits[1]).filter(|capacity| *capacity > 0.0));
    }
    let is_last = SEVERAL_DEPOTS.contains(&kind);
    let places = if is_last { depots } else { 1 };
    let depot_rows = if is_last { count..count + places } else { 0..1 };
    let (mut customers, mut found) = (Vec::new(), Vec::new());
    for index in 0..count.saturating_add(places) {
        let (line, row) = next("the row of a customer or depot", 5)?;
        // Number of days, then the days, then the window.
        let days = row.get(6).map_or(0, |days| *days as usize);
        let window = match row.get(days.saturating_add(7)..) {
            Some([ready, due, ..]) => Some([*ready, *due]),
            _ => None,
        };
        if depot_rows.contains(&index) {
            found.push(Depot {
                x: row[1],
                y: row[2],
                vehicles: Some(vehicles),
                capacity: capacities[found.len()],
                closes_s: window.map(|[_, due]| due),
            });
        } else {
            customers.push(Customer {
                number: whole(source, line, row[0])?,
                line,
                x: row[1],
                y: row[2],
                demand: Some(row[4]),
                window,
                service: row[3],
                ..Customer::default()
            });
        }
    }
    let mut loaded = load(source.stem(), &customers, found);
    if let Some((line, _)) = rows.next() {
        return Err(source.error(
            line,
            "there are more rows than the first row states",
            "correct the first row",
        ));
    }
    loaded
        .dropped
        .push("longest duration of a route: robots have none".to_owned());
    Ok(loaded)
}

//! Solomon's format of vehicle routing with time windows (Operations Research 35(2), 1987), which Gehring and Homberger
//! use, too: a table VEHICLE with number and capacity, and a table CUSTOMER whose first row is the depot.

use scenario::Problem;

use super::super::source::{Depot, Loaded, Source};
use super::vehicles::{Customer, load, numbers, whole};

/// The columns of the table CUSTOMER: number, x, y, demand, ready time, due date, service time.
const COLUMNS: usize = 7;

/// Returns true if the text has the table VEHICLE.
pub(super) fn is_solomon(text: &str) -> bool {
    text.lines().any(|line| line.trim() == "VEHICLE")
}

/// Reads a file in Solomon's format.
///
/// # Errors
/// Returns the first line that does not fit.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    let content = (1..).zip(source.text.lines().map(str::trim));
    let mut content = content.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let name = content.next().map_or("", |(_, line)| line);
    let last = source.text.lines().count().max(1);
    let missing = |what: &str| source.error(last, format!("{what} is missing"), "add it");
    // A table has its name, a row of column names, and its rows.
    let mut first_row = |table: &str| {
        content.find(|(_, line)| *line == table)?;
        content.next()?;
        content.next()
    };
    let (line, fleet) = first_row("VEHICLE").ok_or_else(|| missing("the row of VEHICLE"))?;
    let [vehicles, capacity] = row(source, line, fleet)?;
    let vehicles = Some(whole(source, line, vehicles)? as usize);
    let (line, depot) = first_row("CUSTOMER").ok_or_else(|| missing("the row of the depot"))?;
    let [number, x, y, _, _, due, _] = row::<COLUMNS>(source, line, depot)?;
    if number != 0.0 {
        let what = format!("the first row of CUSTOMER has the number {number}");
        return Err(source.error(line, what, "begin with the depot, which has the number 0"));
    }
    let depot = Depot {
        x,
        y,
        vehicles,
        capacity: Some(capacity),
        closes_s: Some(due),
    };
    let mut customers = Vec::new();
    for (line, text) in content {
        let [number, x, y, demand, ready, due, service] = row::<COLUMNS>(source, line, text)?;
        customers.push(Customer {
            number: whole(source, line, number)?,
            line,
            x,
            y,
            demand: Some(demand),
            window: Some([ready, due]),
            service,
            ..Customer::default()
        });
    }
    Ok(load(name, &customers, vec![depot]))
}

/// Returns the numbers of a row of `N` columns.
fn row<const N: usize>(source: Source<'_>, line: usize, text: &str) -> Result<[f64; N], Problem> {
    let numbers = numbers(source, line, text)?;
    <[f64; N]>::try_from(numbers).map_err(|numbers| {
        let what = format!("the row has {} numbers, not {N}", numbers.len());
        source.error(line, what, "write all columns of the table")
    })
}

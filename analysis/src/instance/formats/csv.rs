//! A table of tasks and robots with a header row that names columns as the keys of JSON files.
//!
//! A row is a task, unless its column `type` contains `robot`. Cells with several values separate them by blanks:
//! `arm=1 camera=2`, `c1 c2`, `4.5 6`. An empty cell is an absent value.

use std::collections::BTreeMap;
use std::str::FromStr;

use csv::{ReaderBuilder, StringRecord};
use scenario::Problem;
use scenario::limits::check_known;

use super::super::model::{Robot, Task};
use super::super::source::{Loaded, Source};

const TASK: &[&str] = &[
    "id",
    "x_m",
    "y_m",
    "work_s",
    "arrival_s",
    "opens_s",
    "deadline_s",
    "kind",
    "workers",
    "needs",
    "value",
    "priority",
    "after",
    "deliver_to",
    "demand",
];
const ROBOT: &[&str] = &["id", "x_m", "y_m", "speed_m_s", "skills", "capacity"];
const TYPE: &str = "type";

/// Reads a table. The separator is a comma, a semicolon or a tab, whichever the header row contains first.
///
/// # Errors
/// Returns the first line with a missing or unknown column, or an unsuitable cell.
pub(super) fn read(source: Source<'_>) -> Result<Loaded, Problem> {
    let header = source.text.lines().next().unwrap_or_default();
    let separator = header
        .find([',', ';', '\t'])
        .map_or(b',', |at| header.as_bytes()[at]);
    let mut reader = ReaderBuilder::new()
        .delimiter(separator)
        .trim(csv::Trim::All)
        .from_reader(source.text.as_bytes());
    let refused = |error: csv::Error| {
        let line = error.position().map_or(1, |at| at.line() as usize);
        let what = match error.kind() {
            csv::ErrorKind::UnequalLengths {
                expected_len, len, ..
            } => format!("the row has {len} cells, and the header row has {expected_len}"),
            _ => error.to_string(),
        };
        source.error(line, what, "write one cell per column")
    };
    let header = reader.headers().map_err(refused)?.clone();
    check_header(source, &header)?;
    let mut loaded = Loaded::default();
    for record in reader.records() {
        let record = record.map_err(refused)?;
        let row = Row {
            source,
            header: &header,
            line: record.position().map_or(1, |at| at.line() as usize),
            record: &record,
        };
        match row.cell(TYPE) {
            None | Some("task") => {
                loaded.instance.tasks.push(row.task()?);
                loaded.task_lines.push(row.line);
            }
            Some("robot") => {
                loaded.instance.robots.push(row.robot()?);
                loaded.robot_lines.push(row.line);
            }
            Some(other) => {
                let what = format!("type: '{other}' is neither task nor robot");
                return Err(row.error(what, "write one of them, or leave the cell empty"));
            }
        }
    }
    Ok(loaded)
}

fn check_header(source: Source<'_>, header: &StringRecord) -> Result<(), Problem> {
    let known = || [TYPE].iter().chain(TASK).chain(&ROBOT[3..]).copied();
    for (index, column) in header.iter().enumerate() {
        check_known((), "there is no column", column, known())
            .map_err(|problem| source.error(1, problem.to_string(), ""))?;
        if header.iter().take(index).any(|before| before == column) {
            let what = format!("the column {column} occurs twice");
            return Err(source.error(1, what, "keep one of them"));
        }
    }
    for needed in ["id", "x_m", "y_m", "work_s"] {
        if !header.iter().any(|column| column == needed) {
            let what = format!("the column {needed} is missing");
            return Err(source.error(1, what, "name it in the header row"));
        }
    }
    Ok(())
}

/// A row with its header and its line.
struct Row<'a> {
    source: Source<'a>,
    header: &'a StringRecord,
    record: &'a StringRecord,
    line: usize,
}

impl Row<'_> {
    fn error(&self, what: String, remedy: &str) -> Problem {
        self.source.error(self.line, what, remedy)
    }

    /// Returns the cell of a column unless it is empty.
    fn cell(&self, column: &str) -> Option<&str> {
        let index = self.header.iter().position(|name| name == column)?;
        self.record.get(index).filter(|cell| !cell.is_empty())
    }

    fn value<T: FromStr>(&self, column: &str, means: &str) -> Result<Option<T>, Problem> {
        let Some(cell) = self.cell(column) else {
            return Ok(None);
        };
        cell.parse().map(Some).map_err(|_| {
            let what = format!("{column}: '{cell}' is not {means}");
            self.error(what, "correct the cell or leave it empty")
        })
    }

    fn number(&self, column: &str) -> Result<Option<f64>, Problem> {
        self.value(column, "a number")
    }

    fn required<T>(&self, column: &str, value: Option<T>) -> Result<T, Problem> {
        value.ok_or_else(|| self.error(format!("{column}: the cell is empty"), "give a value"))
    }

    /// Returns the pairs of a cell such as `arm=1 camera=2`; a name alone has the value 1.
    fn pairs<T: FromStr>(
        &self,
        column: &str,
        means: &str,
        one: fn() -> T,
    ) -> Result<BTreeMap<String, T>, Problem> {
        let words = self.cell(column).unwrap_or_default().split_whitespace();
        let pairs = words.map(|word| {
            let Some((name, value)) = word.split_once('=') else {
                return Ok((word.to_owned(), one()));
            };
            let value = value.parse().map_err(|_| {
                let what = format!("{column}: '{value}' is not {means}");
                self.error(what, "write pairs such as arm=1 camera=2")
            })?;
            Ok((name.to_owned(), value))
        });
        pairs.collect()
    }

    fn only_for(&self, type_name: &str, columns: &[&str]) -> Result<(), Problem> {
        let mut stated = self.header.iter().filter(|name| self.cell(name).is_some());
        let wrong = stated.find(|name| *name != TYPE && !columns.contains(name));
        wrong.map_or(Ok(()), |wrong| {
            let what = format!("{wrong}: a {type_name} has no such value");
            Err(self.error(what, "leave the cell empty"))
        })
    }

    fn task(&self) -> Result<Task, Problem> {
        self.only_for("task", TASK)?;
        let whole = "a whole number";
        let place = self.cell("deliver_to").map(|cell| {
            let numbers: Vec<f64> = cell
                .split_whitespace()
                .filter_map(|word| word.parse().ok())
                .collect();
            <[f64; 2]>::try_from(numbers).map_err(|_| {
                let what = format!("deliver_to: '{cell}' is not a place");
                self.error(what, "write x and y in metres, such as 4.5 6")
            })
        });
        let after = self.cell("after").unwrap_or_default().split_whitespace();
        Ok(Task {
            id: self.required("id", self.cell("id"))?.to_owned(),
            x_m: self.required("x_m", self.number("x_m")?)?,
            y_m: self.required("y_m", self.number("y_m")?)?,
            work_s: self.required("work_s", self.number("work_s")?)?,
            arrival_s: self.number("arrival_s")?.unwrap_or(0.0),
            opens_s: self.number("opens_s")?,
            deadline_s: self.number("deadline_s")?,
            kind: self.cell("kind").map(str::to_owned),
            workers: self.value("workers", whole)?,
            needs: self.pairs("needs", whole, || 1)?,
            value: self.number("value")?,
            priority: self.value("priority", whole)?,
            after: after.map(str::to_owned).collect(),
            deliver_to: place.transpose()?,
            demand: self.number("demand")?,
        })
    }

    fn robot(&self) -> Result<Robot, Problem> {
        self.only_for("robot", ROBOT)?;
        let skills = self.pairs("skills", "a number", || 1.0)?;
        Ok(Robot {
            id: self.required("id", self.cell("id"))?.to_owned(),
            x_m: self.number("x_m")?,
            y_m: self.number("y_m")?,
            speed_m_s: self.number("speed_m_s")?,
            skills: self.cell("skills").map(|_| skills),
            capacity: self.number("capacity")?,
        })
    }
}

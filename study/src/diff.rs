//! Where two runs differ first: tick, robot, section and, where the log has it, field.

use std::fmt;
use std::path::PathBuf;
use std::process::ExitCode;

use alliance_proto::ids::Tick;
use alliance_proto::log::{
    LogLevel, RUN_SECTION, ReadError, RunLog, Section, Table, TickRow, WORLD,
};
use alliance_proto::time::SimTime;
use alliance_proto::{tell, terminal};
use clap::Args;
use csv::StringRecord;
use serde::Serialize;

/// Name the first difference between two runs.
#[derive(Args, Clone, Debug)]
pub struct DiffCommand {
    /// Folder of a run
    a: PathBuf,
    /// Folder of another run
    b: PathBuf,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

impl DiffCommand {
    /// Exit status 0 when the runs are identical, 1 when they differ, 2 when a folder holds no run.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let compared = RunLog::open(&self.a)
            .and_then(|a| Ok((a, RunLog::open(&self.b)?)))
            .and_then(|(a, b)| compare(&a, &b));
        match compared {
            Ok(comparison) => comparison.show(self.json),
            Err(error) => {
                tell!("alliance diff: {error}");
                ExitCode::from(2)
            }
        }
    }
}

/// What comparing two runs gave.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "result")]
pub enum Comparison {
    /// Every tick is the same.
    Identical {
        /// Number of ticks.
        ticks: u64,
        /// Hash of the run, 16 hexadecimal digits.
        hash: String,
    },
    /// They differ.
    Differs(Difference),
}

/// The first difference of two runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// First tick that differs; `None` where the logs do not tell.
    pub tick: Option<Tick>,
    /// Its simulated time.
    pub t_ms: Option<SimTime>,
    /// Whose part of the tick, or "world".
    pub robot: String,
    /// Which part.
    pub section: String,
    /// The field, where the log has it, as TABLE: COLUMN.
    pub field: Option<String>,
    /// What the first run says there.
    pub a: String,
    /// What the second run says there.
    pub b: String,
}

impl Comparison {
    /// Tells people on stderr, or programs on stdout; the exit status.
    #[must_use]
    pub fn show(&self, json: bool) -> ExitCode {
        let status = match self {
            Self::Identical { .. } => ExitCode::SUCCESS,
            Self::Differs(_) => ExitCode::from(1),
        };
        if json {
            // Plain data with string keys, so nothing is left to fail.
            let text = serde_json::to_string(self).unwrap_or_default();
            return terminal::answer("alliance", format_args!("{text}\n"), status);
        }
        tell!("{self}");
        status
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identical { ticks, hash } => write!(f, "identical: {ticks} ticks, hash {hash}"),
            Self::Differs(first) => {
                f.write_str("differs")?;
                if let (Some(tick), Some(t_ms)) = (first.tick, first.t_ms) {
                    write!(f, " first in tick {tick} ({t_ms})")?;
                }
                write!(f, ": {} {}", first.robot, first.section)?;
                if let Some(field) = &first.field {
                    write!(f, ", {field}")?;
                }
                write!(f, ": '{}' and '{}'", first.a, first.b)
            }
        }
    }
}

/// Compares two runs tick by tick, as far as their logs tell.
///
/// # Errors
/// When a table cannot be read.
pub fn compare(a: &RunLog, b: &RunLog) -> Result<Comparison, ReadError> {
    let (rows_a, rows_b) = (ticks(a)?, ticks(b)?);
    let mut pairs = rows_a.iter().zip(&rows_b);
    if let Some((row_a, row_b)) = pairs.find(|(row_a, row_b)| row_a != row_b) {
        return Ok(Comparison::Differs(name(a, b, row_a, row_b)));
    }
    let outcome = |log: &RunLog| format!("{:?}", log.run.outcome);
    let last = |rows: &[TickRow]| rows.last().map_or(0, |row| row.tick + 1);
    let ends = |field: &str, a: String, b: String| {
        Ok(Comparison::Differs(Difference {
            tick: None,
            t_ms: None,
            robot: WORLD.to_owned(),
            section: "end".to_owned(),
            field: Some(field.to_owned()),
            a,
            b,
        }))
    };
    if rows_a.len() != rows_b.len() {
        let ticks = |rows: &[TickRow]| last(rows).to_string();
        return ends("ticks", ticks(&rows_a), ticks(&rows_b));
    }
    let hash = |log: &RunLog| match (&log.run.hash, &log.last) {
        (Some(hash), _) => hash.clone(),
        (None, Some(seal)) => format!("{:016x}", seal.hash),
        (None, None) => "none".to_owned(),
    };
    // What is left to differ is what the logs do not tell tick by tick; one that was cut off has no outcome.
    if a.run.hash.is_some() && b.run.hash.is_some() {
        if hash(a) != hash(b) {
            return ends("hash", hash(a), hash(b));
        }
        if a.run.outcome != b.run.outcome {
            return ends("outcome", outcome(a), outcome(b));
        }
    }
    let ticks = if rows_a.is_empty() {
        a.run.result.ticks
    } else {
        last(&rows_a)
    };
    Ok(Comparison::Identical {
        ticks,
        hash: hash(a),
    })
}

/// The hashes of a log: of each section where it is full, else of the run so far. Those of tables follow from them.
fn ticks(log: &RunLog) -> Result<Vec<TickRow>, ReadError> {
    if log.run.log == LogLevel::Off {
        return Ok(Vec::new());
    }
    let mut rows: Vec<TickRow> = log.rows()?;
    rows.retain(|row| {
        !Table::ALL
            .iter()
            .any(|table| table.file_name() == row.section)
    });
    Ok(rows)
}

/// Puts a name to the first pair of rows that differ.
fn name(a: &RunLog, b: &RunLog, row_a: &TickRow, row_b: &TickRow) -> Difference {
    // Where a section is missing on one side, the rows are out of step: the section that comes first is the one.
    let same_place =
        (row_a.tick, &row_a.robot, &row_a.section) == (row_b.tick, &row_b.robot, &row_b.section);
    let b_first =
        row_b.tick < row_a.tick || (row_b.tick == row_a.tick && row_a.section == RUN_SECTION);
    let row = if !same_place && b_first { row_b } else { row_a };
    let field = tables_of(&row.section)
        .iter()
        .find_map(|table| first_field(*table, a, b, row));
    let said = |row: &TickRow| {
        if same_place {
            format!("{:016x}", row.hash)
        } else {
            format!("{} {}", row.robot, row.section)
        }
    };
    let (field, a, b) = match field {
        Some((field, a, b)) => (Some(field), a, b),
        None => (None, said(row_a), said(row_b)),
    };
    Difference {
        tick: Some(row.tick),
        t_ms: Some(row.t_ms),
        robot: row.robot.clone(),
        section: row.section.clone(),
        field,
        a,
        b,
    }
}

/// The tables in which a section can be seen.
fn tables_of(section: &str) -> &'static [Table] {
    let is = |wanted: Section| wanted.as_str() == section;
    if is(Section::Inputs) || is(Section::Events) {
        &[Table::Events]
    } else if is(Section::Messages) {
        &[Table::Messages]
    } else if is(Section::Motivations) {
        &[Table::Motivations, Table::Events]
    } else if is(Section::State) {
        &[Table::Poses, Table::Mission]
    } else {
        &[]
    }
}

/// The first field of a table that differs in the rows of that tick and robot: its name, and what each says.
fn first_field(
    table: Table,
    a: &RunLog,
    b: &RunLog,
    place: &TickRow,
) -> Option<(String, String, String)> {
    let header = a.table(table).split(|&byte| byte == b'\n').next();
    let header = String::from_utf8_lossy(header.unwrap_or_default());
    let columns: Vec<&str> = header.split(',').collect();
    let whose = columns
        .iter()
        .position(|column| matches!(*column, "robot" | "receiver"));
    let time = place.t_ms.0.to_string();
    let rows = |log: &RunLog| -> Vec<StringRecord> {
        csv::Reader::from_reader(log.table(table))
            .into_records()
            .filter_map(Result::ok)
            .filter(|row| {
                let of_robot = place.robot == WORLD
                    || whose.is_none_or(|column| row.get(column) == Some(place.robot.as_str()));
                row.get(0) == Some(time.as_str()) && of_robot
            })
            .collect()
    };
    let (rows_a, rows_b) = (rows(a), rows(b));
    for index in 0..rows_a.len().max(rows_b.len()) {
        let (row_a, row_b) = (rows_a.get(index), rows_b.get(index));
        for (column, name) in columns.iter().enumerate() {
            let say = |row: Option<&StringRecord>| {
                row.and_then(|row| row.get(column))
                    .unwrap_or("no row")
                    .to_owned()
            };
            if say(row_a) != say(row_b) {
                let of = row_a
                    .or(row_b)
                    .filter(|_| column > 2)
                    .and_then(|row| row.get(2))
                    .map_or_else(String::new, |of| format!(" of {of}"));
                let field = format!("{}: {name}{of}", table.file_name());
                return Some((field, say(row_a), say(row_b)));
            }
        }
    }
    None
}

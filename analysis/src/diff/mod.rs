//! Comparison of two runs: the first difference, by tick, robot, section and, if logged, field.

mod causes;
mod difference;
mod sections;
mod tables;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::bail;
use clap::Args;
use run_log::{LogLevel, RUN_SECTION, ReadError, RunLog, Table, TickRow};
use serde_json::Value;
use terminal::stderr_line;

pub use difference::{Comparison, Difference};

use crate::{LATEST, exit_status, open};
use causes::{
    ValueDifference, input_difference, program_difference, setup_difference, values_that_differ,
};
use sections::sections_of;
use tables::{
    damage_difference, difference_of_tick, row_difference, table_difference, torn_difference,
};

/// Find the first difference between two runs
#[derive(Args, Clone, Debug)]
pub struct DiffCommand {
    /// Folder of a run
    a: PathBuf,
    /// Folder of another run
    #[arg(default_value = LATEST)]
    b: PathBuf,
    /// Print the result as JSON on stdout
    #[arg(long)]
    json: bool,
}

impl DiffCommand {
    /// Compares the two runs. Returns exit status 0 if they are identical, 1 if they differ, and 2 if a folder contains
    /// no run.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let compared = self.compare().map(|found| found.show(self.json));
        exit_status("diff", compared, 2)
    }

    fn compare(&self) -> anyhow::Result<Comparison> {
        let (a, b) = (open(&self.a)?, open(&self.b)?);
        if fs::canonicalize(&self.a).ok() == fs::canonicalize(&self.b).ok() {
            bail!(
                "{} and {} are the same run; name two runs",
                self.a.display(),
                self.b.display()
            );
        }
        if let Some(programs) = program_difference(&a.run, &b.run) {
            stderr_line!("{programs}");
        }
        Ok(compare(&a, &b)?)
    }
}

/// Compares a log with the log of its replay: every tick, every byte of every table, and every value of run.json except
/// the facts in `NOT_REPRODUCED`.
///
/// # Errors
/// Returns an error when a table cannot be read.
pub fn compare_files(logged: &RunLog, again: &RunLog) -> Result<Comparison, ReadError> {
    compare_parts(logged, again, again)
}

/// Compares a log like [`compare_files`], its run.json with that of `run`.
pub(crate) fn compare_parts(
    logged: &RunLog,
    again: &RunLog,
    run: &RunLog,
) -> Result<Comparison, ReadError> {
    if let Some(damaged) = damage_difference(logged, again) {
        return Ok(Comparison::Differs(damaged));
    }
    let comparison = compare(logged, again)?;
    if let Comparison::Differs(_) = comparison {
        return Ok(comparison);
    }
    if let Some(table) = logged.torn {
        return Ok(Comparison::Differs(torn_difference(logged, table)));
    }
    if let Some(table) = logged.excess.first() {
        let found = if logged.run.log.keeps(*table) {
            "rows without a seal in ticks.csv".to_owned()
        } else {
            format!(
                "a file that the log level '{}' excludes",
                logged.run.log.as_str()
            )
        };
        let difference = Difference::at_end(table.file_name(), None, found, "none".to_owned());
        return Ok(Comparison::Differs(difference));
    }
    let (mut a, mut b) = (logged.run_json(), run.run_json());
    for facts in NOT_REPRODUCED {
        for run in [&mut a, &mut b] {
            if let Value::Object(run) = run {
                run.remove(facts);
            }
        }
    }
    let mut found = Vec::new();
    values_that_differ("", &a, &b, &mut found);
    Ok(match found.into_iter().next() {
        None => comparison,
        Some(ValueDifference { path, a, b }) => Comparison::Differs(Difference {
            cause: setup_difference(logged, again),
            ..Difference::at_end("run.json", Some(path), a, b)
        }),
    })
}

/// The keys of run.json that a replay does not reproduce: the programs that took part.
const NOT_REPRODUCED: [&str; 3] = ["build", "agent_builds", "controllers"];

/// Compares two runs tick by tick and table by table, as far as their logs allow.
///
/// # Errors
/// Returns an error when a table cannot be read.
pub fn compare(a: &RunLog, b: &RunLog) -> Result<Comparison, ReadError> {
    let (mut rows_a, mut rows_b) = (ticks(a)?, ticks(b)?);
    if a.run.log != b.run.log {
        keep_common(&mut rows_a, &mut rows_b);
    }
    let mut pairs = rows_a.iter().zip(&rows_b);
    if let Some((row_a, row_b)) = pairs.find(|(row_a, row_b)| row_a != row_b) {
        let mut found = if is_compact(row_a, a) && is_compact(row_b, b) {
            difference_in_tick(a, b, (row_a, row_b))?
        } else {
            row_difference(a, b, (row_a, row_b), (&rows_a, &rows_b))?
        };
        found.cause = match setup_difference(a, b) {
            None => input_difference(a, b, found.tick)?,
            found => found,
        };
        return Ok(Comparison::Differs(found));
    }
    let outcome = |log: &RunLog| format!("{:?}", log.run.outcome);
    let last = |rows: &[TickRow]| rows.last().map_or(0, |row| row.tick + 1);
    let given = setup_difference(a, b);
    let ends = |field: &str, a: String, b: String| {
        Ok(Comparison::Differs(Difference {
            cause: given.clone(),
            ..Difference::at_end("end", Some(field.to_owned()), a, b)
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
    let is_over = |log: &RunLog| log.run.hash.is_some();
    if a.run.log != b.run.log && !(is_over(a) && is_over(b)) {
        // The common hashes do not show where a killed run ends.
        let ticks = |log: &RunLog| log.last.map_or(log.run.result.ticks, |seal| seal.tick + 1);
        if ticks(a) != ticks(b) {
            return ends("ticks", ticks(a).to_string(), ticks(b).to_string());
        }
    }
    // The tick log does not show the remaining differences. An interrupted run has no outcome.
    if is_over(a) && is_over(b) {
        if hash(a) != hash(b) {
            return ends("hash", hash(a), hash(b));
        }
        if a.run.outcome != b.run.outcome {
            return ends("outcome", outcome(a), outcome(b));
        }
    }
    if a.run.log == b.run.log
        && let Some(found) = table_difference(a, b)?
    {
        return Ok(Comparison::Differs(Difference {
            cause: given,
            ..found
        }));
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

/// Keeps the hashes of the run in the ticks that both logs have, for logs of different levels.
fn keep_common(rows_a: &mut Vec<TickRow>, rows_b: &mut Vec<TickRow>) {
    let ticks_of = |rows: &[TickRow]| rows.iter().map(|row| row.tick).collect::<BTreeSet<_>>();
    let (ticks_a, ticks_b) = (ticks_of(rows_a), ticks_of(rows_b));
    for rows in [rows_a, rows_b] {
        rows.retain(|row| {
            let is_common = ticks_a.contains(&row.tick) && ticks_b.contains(&row.tick);
            row.section == RUN_SECTION && is_common
        });
    }
}

/// Returns whether the row stands for all sections of its tick.
fn is_compact(row: &TickRow, log: &RunLog) -> bool {
    row.section == RUN_SECTION && log.run.log.has_every_tick()
}

/// Locates a difference within a tick by the hashes of its sections, which a repetition of the runs computes. A run that
/// cannot be repeated is compared by the rows of its tables.
fn difference_in_tick(
    a: &RunLog,
    b: &RunLog,
    (row_a, row_b): (&TickRow, &TickRow),
) -> Result<Difference, ReadError> {
    if let (Some(rows_a), Some(rows_b)) = (sections_of(a, row_a), sections_of(b, row_b)) {
        let mut pairs = rows_a.iter().zip(&rows_b);
        if let Some(pair) = pairs.find(|(row_a, row_b)| row_a != row_b) {
            return row_difference(a, b, pair, (&rows_a, &rows_b));
        }
    }
    difference_of_tick(a, b, (row_a, row_b))
}

/// Returns the hash rows of a log: one per section in a full log, otherwise one per tick for the run so far. The seals
/// of tables are left out: they name no cause. [`table_difference`] compares them last.
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

//! Comparison of two runs: the first difference, by tick, robot, section and, if logged, field.

use missions::Registry;
use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use csv::StringRecord;
use run_log::{
    Input, InputLine, LogLevel, ReadError, RunFile, RunLog, RunOutcome, Section, Table, TickRow,
    WORLD_ROBOT,
};
use scenario::ids::Tick;
use scenario::time::SimTime;
use serde::Serialize;
use serde_json::Value;
use terminal::{in_one_line, stderr_line};

/// Find the first difference between two runs
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
    /// Compares the two runs. Returns exit status 0 if they are identical, 1 if they differ, and 2 if a folder contains
    /// no run.
    #[must_use]
    pub fn run(&self) -> ExitCode {
        let compared = RunLog::open(&self.a, &Registry::current().vocabulary())
            .and_then(|a| Ok((a, RunLog::open(&self.b, &Registry::current().vocabulary())?)))
            .and_then(|(a, b)| compare(&a, &b));
        match compared {
            Ok(comparison) => comparison.show(self.json),
            Err(error) => {
                stderr_line!("alliance diff: {error}");
                ExitCode::from(2)
            }
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "result")]
pub enum Comparison {
    /// The two logs agree in every tick.
    Identical {
        ticks: u64,
        /// Hash of the run, 16 hexadecimal digits.
        hash: String,
    },
    Differs(Difference),
}

/// The first difference between two runs.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The cause in words, such as another seed; `None` if setup and inputs are equal.
    pub cause: Option<String>,
    /// The first tick that differs; `None` if the logs do not show it.
    pub tick: Option<Tick>,
    pub t_ms: Option<SimTime>,
    /// The robot whose part of the tick differs, or "world".
    pub robot: String,
    /// The section of the tick, as in ticks.csv.
    pub section: String,
    /// The field as TABLE: COLUMN, if the log contains it.
    pub field: Option<String>,
    /// The value in the first run.
    pub a: String,
    /// The value in the second run.
    pub b: String,
}

impl Difference {
    /// Creates a difference that belongs to no tick.
    fn at_end(section: &str, field: Option<String>, a: String, b: String) -> Self {
        Self {
            robot: WORLD_ROBOT.to_owned(),
            section: section.to_owned(),
            field,
            a,
            b,
            ..Self::default()
        }
    }
}

impl Comparison {
    /// Writes the result to stderr as text, or to stdout as JSON, and returns the exit status.
    #[must_use]
    pub fn show(&self, json: bool) -> ExitCode {
        let status = match self {
            Self::Identical { .. } => ExitCode::SUCCESS,
            Self::Differs(_) => ExitCode::from(1),
        };
        if json {
            // Plain data with string keys: serialization cannot fail.
            let text = serde_json::to_string(self).unwrap_or_default();
            return terminal::print_result("alliance", format_args!("{text}\n"), status);
        }
        stderr_line!("{self}");
        status
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identical { ticks, hash } => write!(f, "identical: {ticks} ticks, hash {hash}"),
            Self::Differs(first) => {
                // The texts of a log from elsewhere can contain line feeds.
                let [robot, section, a, b] = [&first.robot, &first.section, &first.a, &first.b]
                    .map(|text| in_one_line(text));
                if let Some(cause) = &first.cause {
                    writeln!(f, "{}", in_one_line(cause))?;
                }
                f.write_str("differs")?;
                if let (Some(tick), Some(t_ms)) = (first.tick, first.t_ms) {
                    write!(f, " first in tick {tick} ({t_ms})")?;
                }
                write!(f, ": {robot} {section}")?;
                if let Some(field) = &first.field {
                    write!(f, ", {}", in_one_line(field))?;
                }
                write!(f, ": '{a}' and '{b}'")
            }
        }
    }
}

/// Compares a log with the log of its replay: every tick, every byte of every table, and every value of run.json except
/// the facts in `NOT_REPRODUCED`.
///
/// # Errors
/// Returns an error when a table cannot be read.
pub fn compare_files(logged: &RunLog, again: &RunLog) -> Result<Comparison, ReadError> {
    let comparison = compare(logged, again)?;
    if let Comparison::Differs(_) = comparison {
        return Ok(comparison);
    }
    let is_over = logged.run.outcome != RunOutcome::Running;
    let excess = logged
        .excess
        .iter()
        .find(|table| is_over || !logged.run.log.keeps(**table));
    if let Some(table) = excess {
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
    let (mut a, mut b) = (logged.run_json(), again.run_json());
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
const NOT_REPRODUCED: [&str; 3] = ["build", "agent_builds", "minds"];

/// Compares two runs tick by tick and table by table, as far as their logs allow.
///
/// # Errors
/// Returns an error when a table cannot be read.
pub fn compare(a: &RunLog, b: &RunLog) -> Result<Comparison, ReadError> {
    let (rows_a, rows_b) = (ticks(a)?, ticks(b)?);
    let mut pairs = rows_a.iter().zip(&rows_b);
    if let Some((row_a, row_b)) = pairs.find(|(row_a, row_b)| row_a != row_b) {
        let mut found = name(a, b, (row_a, row_b), (&rows_a, &rows_b));
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
    // The tick log does not show the remaining differences. An interrupted run has no outcome.
    if a.run.hash.is_some() && b.run.hash.is_some() {
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

/// Returns the first line that differs in the tables, with ticks.csv and its seals last.
fn table_difference(a: &RunLog, b: &RunLog) -> Result<Option<Difference>, ReadError> {
    for table in Table::ALL {
        let (bytes_a, bytes_b) = (a.table(table), b.table(table));
        if bytes_a == bytes_b {
            continue;
        }
        if table == Table::External {
            // Another version of the compression gives other bytes for the same answers.
            let answers =
                |log: &RunLog| Ok::<_, ReadError>(format!("{:?}", log.external_answers()?));
            if answers(a)? != answers(b)? {
                let [a, b] = [bytes_a, bytes_b].map(|bytes| format!("{} bytes", bytes.len()));
                return Ok(Some(Difference::at_end(table.file_name(), None, a, b)));
            }
        } else if let Some(found) = line_difference(table, bytes_a, bytes_b) {
            let tick = found.t_ms.map(|t_ms| t_ms.0 / a.run.setup.scenario.step_ms);
            return Ok(Some(Difference { tick, ..found }));
        }
    }
    Ok(None)
}

fn line_difference(table: Table, a: &[u8], b: &[u8]) -> Option<Difference> {
    // The seal of foreign.bin depends on the compression.
    let external = format!(",{},", Table::External.file_name());
    let lines = |bytes: &[u8]| -> Vec<String> {
        let lines = String::from_utf8_lossy(bytes);
        let lines = lines.lines().map(ToOwned::to_owned);
        let counts = |line: &String| table != Table::Ticks || !line.contains(&external);
        lines.filter(counts).collect()
    };
    let (lines_a, lines_b) = (lines(a), lines(b));
    let number = (0..lines_a.len().max(lines_b.len()))
        .find(|number| lines_a.get(*number) != lines_b.get(*number))?;
    let cells = |line: Option<&String>| -> Vec<String> {
        let Some(line) = line else { return Vec::new() };
        if table == Table::Inputs {
            return vec![line.clone()];
        }
        let mut reader = csv::ReaderBuilder::new();
        let reader = reader.has_headers(false).from_reader(line.as_bytes());
        let row = reader.into_records().next().and_then(Result::ok);
        row.map_or_else(
            || vec![line.clone()],
            |row| row.iter().map(ToOwned::to_owned).collect(),
        )
    };
    let columns = cells(lines_a.first().filter(|_| table != Table::Inputs));
    let (row_a, row_b) = (cells(lines_a.get(number)), cells(lines_b.get(number)));
    let cell = |row: &[String], column: usize| row.get(column).cloned();
    let column = (0..row_a.len().max(row_b.len()))
        .find(|column| cell(&row_a, *column) != cell(&row_b, *column))
        .unwrap_or_default();
    let row = if row_a.is_empty() { &row_b } else { &row_a };
    let of = |name: &str| {
        let column = columns.iter().position(|column| column == name)?;
        row.get(column)
    };
    let robot = of("robot").or(of("receiver")).or(of("sender"));
    let name = columns.get(column).map_or("", String::as_str);
    let shown = |row: &[String]| cell(row, column).unwrap_or_else(|| "no row".to_owned());
    Some(Difference {
        t_ms: of("t_ms").and_then(|t_ms| t_ms.parse().ok()).map(SimTime),
        robot: robot
            .filter(|robot| !robot.is_empty())
            .map_or(WORLD_ROBOT, String::as_str)
            .to_owned(),
        ..Difference::at_end(
            table.file_name(),
            Some(
                format!("{name} in line {}", number + 1)
                    .trim_start()
                    .to_owned(),
            ),
            shown(&row_a),
            shown(&row_b),
        )
    })
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

/// Returns the first difference in seed, scenario or version, in words.
fn setup_difference(a: &RunLog, b: &RunLog) -> Option<String> {
    let (run_a, run_b) = (&a.run, &b.run);
    if run_a.setup.seed != run_b.setup.seed {
        let (a, b) = (run_a.setup.seed, run_b.setup.seed);
        return Some(format!("seed: {a} in A, {b} in B"));
    }
    let mut found = Vec::new();
    // Plain data with string keys: serialization cannot fail. Parameters come last because they follow from the
    // scenario.
    let value = |run: &RunFile| serde_json::to_value(&run.setup).unwrap_or_default();
    let (one, other) = (value(run_a), value(run_b));
    values_that_differ("", &one["scenario"], &other["scenario"], &mut found);
    if found.is_empty() {
        values_that_differ("alliance", &one["alliance"], &other["alliance"], &mut found);
    }
    if let Some(ValueDifference { path, a, b }) = found.first() {
        let first = format!("{path}: {a} in A, {b} in B");
        let more = match found.len() {
            1 => String::new(),
            2 => " (and 1 more value)".to_owned(),
            all => format!(" (and {} more values)", all - 1),
        };
        return Some(format!("scenario: {first}{more}"));
    }
    let (one, other) = (&run_a.version, &run_b.version);
    (one != other).then(|| format!("version: {one} in A, {other} in B"))
}

/// Two values at the same place, in words.
struct ValueDifference {
    path: String,
    a: String,
    b: String,
}

/// Appends each pair of values that differ, with its path.
fn values_that_differ(path: &str, a: &Value, b: &Value, found: &mut Vec<ValueDifference>) {
    let below = |key: &dyn fmt::Display| {
        let dot = if path.is_empty() { "" } else { "." };
        format!("{path}{dot}{key}")
    };
    match (a, b) {
        (Value::Object(one), Value::Object(other)) => {
            let keys: BTreeSet<&String> = one.keys().chain(other.keys()).collect();
            for key in keys {
                values_that_differ(&below(key), &a[key], &b[key], found);
            }
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => {
            for (index, (one, other)) in one.iter().zip(other).enumerate() {
                values_that_differ(&below(&index), one, other, found);
            }
        }
        _ if a == b => {}
        _ => {
            let describe = |value: &Value| match value {
                Value::Null => "not set".to_owned(),
                Value::Array(list) if list.len() == 1 => "1 entry".to_owned(),
                Value::Array(list) => format!("{} entries", list.len()),
                Value::Object(_) => "set".to_owned(),
                plain => plain.to_string(),
            };
            found.push(ValueDifference {
                path: path.to_owned(),
                a: describe(a),
                b: describe(b),
            });
        }
    }
}

/// Describes the inputs in `tick` that only one of the runs has; `None` if there are none.
fn input_difference(
    a: &RunLog,
    b: &RunLog,
    tick: Option<Tick>,
) -> Result<Option<String>, ReadError> {
    let (inputs_a, inputs_b) = (a.inputs()?, b.inputs()?);
    let of_tick = |inputs: &[InputLine]| -> Vec<Input> {
        let inputs = inputs.iter().filter(|line| Some(line.tick) == tick);
        inputs.map(|line| line.input.clone()).collect()
    };
    let (only_a, only_b) = (of_tick(&inputs_a), of_tick(&inputs_b));
    let t_ms = SimTime(tick.unwrap_or(0) * a.run.setup.scenario.step_ms);
    let describe = |inputs: &[Input], others: &[Input], name: &str| {
        let here = inputs.iter().filter(|input| !others.contains(input));
        here.map(|input| format!("{} at {} s in {name}", in_words(input), t_ms.as_secs_f64()))
            .collect::<Vec<_>>()
    };
    let mut differences = describe(&only_a, &only_b, "A");
    differences.extend(describe(&only_b, &only_a, "B"));
    Ok((!differences.is_empty()).then(|| format!("inputs: {}", differences.join("; "))))
}

fn in_words(input: &Input) -> String {
    match input {
        Input::Join { robot, .. } => format!("{robot} joined"),
        Input::Gone { robot, .. } => format!("{robot} died"),
        Input::StallBegin { robot, .. } => format!("{robot} stopped responding"),
        Input::StallEnd { robot, .. } => format!("{robot} responded again"),
        Input::Lost {
            receiver, sender, ..
        } => format!("{receiver} lost a message of {sender}"),
        Input::Order { order, .. } => format!("'{}' was ordered", order.fault),
        Input::Clear { ids, .. } => format!("{} cleared", ids.join(", ")),
        Input::Failed { robot, .. } => format!("an order to the process of {robot} failed"),
    }
}

/// Locates the first pair of rows that differ. `rows` contains all rows of both logs.
fn name(
    a: &RunLog,
    b: &RunLog,
    (row_a, row_b): (&TickRow, &TickRow),
    rows: (&[TickRow], &[TickRow]),
) -> Difference {
    fn place(row: &TickRow) -> (Tick, &str, &str) {
        (row.tick, &row.robot, &row.section)
    }
    let same_place = place(row_a) == place(row_b);
    // If a section is missing in one log, the rows are out of step. The missing section is then the difference.
    let is_missing = |rows: &[TickRow], row: &TickRow| {
        let from = rows.partition_point(|other| other.tick < row.tick);
        let mut same_tick = rows[from..]
            .iter()
            .take_while(|other| other.tick == row.tick);
        !same_tick.any(|other| place(other) == place(row))
    };
    let only_b = row_b.tick < row_a.tick || (row_b.tick == row_a.tick && is_missing(rows.0, row_b));
    let row = if !same_place && only_b { row_b } else { row_a };
    let field = tables_of(&row.section)
        .iter()
        .find_map(|table| first_field(*table, a, b, row));
    let describe = |row: &TickRow| {
        if same_place {
            format!("{:016x}", row.hash)
        } else {
            format!("{} {}", row.robot, row.section)
        }
    };
    let (field, a, b) = match field {
        Some((field, a, b)) => (Some(field), a, b),
        None => (None, describe(row_a), describe(row_b)),
    };
    Difference {
        cause: None,
        tick: Some(row.tick),
        t_ms: Some(row.t_ms),
        robot: row.robot.clone(),
        section: row.section.clone(),
        field,
        a,
        b,
    }
}

/// Returns the tables that contain the data of a section.
fn tables_of(section: &str) -> &'static [Table] {
    let is = |wanted: Section| wanted.as_str() == section;
    if is(Section::Inputs) || is(Section::Events) {
        &[Table::Events]
    } else if is(Section::Messages) {
        &[Table::Messages]
    } else if is(Section::Motivations) {
        &[Table::Motivations, Table::Events]
    } else if is(Section::State) {
        &[Table::Poses, Table::Mission, Table::Targets]
    } else {
        &[]
    }
}

/// Returns the first differing field of a table in the rows of that tick and robot: its name and both values.
fn first_field(
    table: Table,
    a: &RunLog,
    b: &RunLog,
    place: &TickRow,
) -> Option<(String, String, String)> {
    let header = a.table(table).split(|&byte| byte == b'\n').next();
    let header = String::from_utf8_lossy(header.unwrap_or_default());
    let columns: Vec<&str> = header.split(',').collect();
    let robot_column = columns
        .iter()
        .position(|column| matches!(*column, "robot" | "receiver"));
    let time = place.t_ms.0.to_string();
    let rows = |log: &RunLog| -> Vec<StringRecord> {
        csv::Reader::from_reader(log.table(table))
            .into_records()
            .filter_map(Result::ok)
            .filter(|row| {
                let of_robot = place.robot == WORLD_ROBOT
                    || robot_column
                        .is_none_or(|column| row.get(column) == Some(place.robot.as_str()));
                row.get(0) == Some(time.as_str()) && of_robot
            })
            .collect()
    };
    let (rows_a, rows_b) = (rows(a), rows(b));
    for index in 0..rows_a.len().max(rows_b.len()) {
        let (row_a, row_b) = (rows_a.get(index), rows_b.get(index));
        for (column, name) in columns.iter().enumerate() {
            let cell = |row: Option<&StringRecord>| {
                row.and_then(|row| row.get(column))
                    .unwrap_or("no row")
                    .to_owned()
            };
            if cell(row_a) != cell(row_b) {
                let subject = row_a
                    .or(row_b)
                    .filter(|_| column > 2)
                    .and_then(|row| row.get(2))
                    .map_or_else(String::new, |subject| format!(" of {subject}"));
                let field = format!("{}: {name}{subject}", table.file_name());
                return Some((field, cell(row_a), cell(row_b)));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use missions::waste::data::{WasteSection, default_scenario};
    use run_log::MemoryLog;
    use scenario::fault::{Fault, Order};
    use scenario::{Scenario, Setup};

    use super::*;
    use in_process::Team;

    /// Returns the log of a short run in memory.
    fn memory() -> MemoryLog {
        let scenario = Scenario {
            limit_s: 60.0,
            ..default_scenario()
        };
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let team = Team::new(setup, LogLevel::Full, MemoryLog::default()).unwrap();
        team.run().unwrap().1.into_sink()
    }

    fn open(memory: &MemoryLog) -> RunLog {
        RunLog::from_memory(memory, &Registry::built_in().vocabulary()).unwrap()
    }

    fn lines(memory: &MemoryLog, table: Table) -> Vec<String> {
        let text = str::from_utf8(&memory.tables[&table]).unwrap();
        text.lines().map(ToOwned::to_owned).collect()
    }

    fn set_lines(memory: &mut MemoryLog, table: Table, lines: &[String]) {
        memory
            .tables
            .insert(table, (lines.join("\n") + "\n").into_bytes());
    }

    /// Makes the seals of a table anew.
    fn reseal(memory: &mut MemoryLog, table: Table) {
        let rows = lines(memory, table);
        let time = |row: &str| row.split(',').next().unwrap().parse::<u64>();
        let mut sealed = lines(memory, Table::Ticks);
        for row in &mut sealed {
            let Some((place, _)) = row.rsplit_once(',') else {
                continue;
            };
            if place.ends_with(table.file_name()) {
                let now = time(row).unwrap();
                let whole = rows
                    .iter()
                    .filter(|row| time(row).map_or(true, |at| at <= now));
                let whole: String = whole.map(|row| format!("{row}\n")).collect();
                let hash = xxhash_rust::xxh3::xxh3_64(whole.as_bytes());
                *row = format!("{place},{hash:016x}");
            }
        }
        set_lines(memory, Table::Ticks, &sealed);
    }

    #[test]
    fn a_changed_row_differs_with_remade_and_with_removed_seals() {
        let memory = memory();
        let again = open(&memory);
        let identical = compare_files(&open(&memory), &again).unwrap();
        assert!(
            matches!(identical, Comparison::Identical { .. }),
            "{identical}"
        );
        for table in [
            Table::Poses,
            Table::Events,
            Table::Mission,
            Table::Motivations,
        ] {
            let mut untouched = memory.clone();
            reseal(&mut untouched, table);
            assert!(untouched == memory, "{table:?}: the test makes other seals");

            let mut altered = memory.clone();
            let mut rows = lines(&altered, table);
            let row = rows.len() / 2;
            let (start, _) = rows[row].rsplit_once(',').unwrap();
            rows[row] = format!("{start},7");
            set_lines(&mut altered, table, &rows);
            reseal(&mut altered, table);
            let log = open(&altered);
            assert_eq!((log.torn, &*log.excess), (None, &[][..]), "{table:?}");
            let text = compare_files(&log, &again).unwrap().to_string();
            let place = format!(" {}, ", table.file_name());
            assert!(
                text.starts_with("differs first in tick") && text.contains(&place),
                "{text}"
            );
            assert!(
                text.contains(&format!(" in line {}: '7' and ", row + 1)),
                "{text}"
            );

            let mut sealed = lines(&altered, Table::Ticks);
            sealed.retain(|row| !row.contains(table.file_name()));
            set_lines(&mut altered, Table::Ticks, &sealed);
            let log = open(&altered);
            assert_eq!(log.excess, [table]);
            let text = compare_files(&log, &again).unwrap().to_string();
            assert!(
                text.starts_with("differs") && text.contains(table.file_name()),
                "{text}"
            );
        }
        let mut longer = memory.clone();
        longer
            .tables
            .get_mut(&Table::Inputs)
            .unwrap()
            .extend(b"{}\n");
        assert_eq!(
            compare_files(&open(&longer), &again).unwrap().to_string(),
            "differs: world inputs.jsonl: 'rows without a seal in ticks.csv' and 'none'"
        );
    }

    #[test]
    fn every_value_of_run_json_is_compared() {
        let memory = memory();
        let again = open(&memory);
        let text = &memory.documents[&run_log::Document::Run];
        let run: Value = serde_json::from_str(text).unwrap();
        let values = [
            ("/version", "9.9.9".into()),
            ("/unscripted", true.into()),
            ("/outcome", "complete".into()),
            ("/hash", "0000000000000000".into()),
            ("/result/items/delivered", 24.into()),
            ("/result/robots/gold/messages_sent", 0.into()),
            ("/result/sim_time_ms", 0.into()),
            ("/added", 1.into()),
            ("/result/added", 1.into()),
        ];
        for (pointer, value) in values {
            let mut altered = run.clone();
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            altered.pointer_mut(parent).unwrap()[key] = value;
            let mut memory = memory.clone();
            memory
                .documents
                .insert(run_log::Document::Run, altered.to_string());
            let text = compare_files(&open(&memory), &again).unwrap().to_string();
            let (_, line) = text.split_once("differs: ").unwrap_or_default();
            assert!(line.contains(key), "{pointer}: {text}");
        }
    }

    /// Runs the scenario for a short time, optionally with an operator's order.
    fn run(seed: u64, change: impl FnOnce(&mut Scenario), order: Option<InputLine>) -> RunLog {
        // Long enough for random draws to have an effect.
        let mut scenario = Scenario {
            limit_s: 80.0,
            ..default_scenario()
        };
        change(&mut scenario);
        let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
        let log = |team: Team<MemoryLog>| {
            let (_, recorder) = team.run().unwrap();
            RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap()
        };
        let calm = log(Team::new(setup.clone(), LogLevel::Full, MemoryLog::default()).unwrap());
        let Some(order) = order else { return calm };
        let mut inputs = calm.inputs().unwrap();
        inputs.push(order);
        log(Team::with_inputs(setup, inputs, LogLevel::Full, MemoryLog::default()).unwrap())
    }

    #[track_caller]
    fn check(a: &RunLog, b: &RunLog, cause: &str, second: &str) {
        let text = compare(a, b).unwrap().to_string();
        let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
        assert_eq!(first, cause, "{text}");
        assert!(rest.starts_with(second), "{text}");
    }

    #[test]
    fn seeds_and_scenarios_come_first() {
        let first = run(1, |_| {}, None);
        check(
            &first,
            &run(2, |_| {}, None),
            "seed: 1 in A, 2 in B",
            "differs first in tick",
        );
        let other = run(
            1,
            |scenario| WasteSection::of_mut(scenario).report_period_s = 60.0,
            None,
        );
        check(
            &first,
            &other,
            "scenario: waste.report_period_s: 120.0 in A, 60.0 in B",
            "differs first in tick",
        );
    }

    #[test]
    fn an_input_of_one_run_is_reported_in_either_order() {
        let order = InputLine {
            tick: 100,
            input: Input::Order {
                order: Order {
                    id: Some("f1".to_owned()),
                    ..Order::now(Fault::Mute("gold".to_owned()))
                },
                moment: None,
            },
        };
        let (calm, broken) = (run(1, |_| {}, None), run(1, |_| {}, Some(order)));
        let place = "differs first in tick 100 (5.000 s): world inputs";
        check(
            &calm,
            &broken,
            "inputs: 'mute gold' was ordered at 5 s in B",
            place,
        );
        check(
            &broken,
            &calm,
            "inputs: 'mute gold' was ordered at 5 s in A",
            place,
        );
    }
}

//! The first difference between the tables of two logs.

use csv::StringRecord;
use run_log::{ReadError, RunLog, Section, Table, TickRow, WORLD_ROBOT};
use scenario::ids::Tick;
use scenario::time::SimTime;

use super::difference::Difference;

/// Returns the first line that differs in the tables, with ticks.csv and its seals last.
pub fn table_difference(a: &RunLog, b: &RunLog) -> Result<Option<Difference>, ReadError> {
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
        } else if let Some(found) = line_difference(a, table, bytes_a, bytes_b) {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// Returns the first line of a damaged log of an ended run that its replay does not have: in the table that disagrees
/// with its seals, or in the seals.
pub fn damage_difference(logged: &RunLog, again: &RunLog) -> Option<Difference> {
    logged.damage()?;
    if logged.torn == Some(Table::Inputs) {
        // A replay without these inputs is another run.
        return Some(torn_difference(logged, Table::Inputs));
    }
    let damaged = logged.torn.or_else(|| logged.excess.first().copied());
    let tables = damaged.into_iter().chain([Table::Ticks]);
    let mut tables =
        tables.filter(|table| *table != Table::External && logged.run.log.keeps(*table));
    tables.find_map(|table| {
        line_difference(
            logged,
            table,
            &logged.whole_table(table),
            again.table(table),
        )
    })
}

/// Returns the difference of a table that ends before its seals.
pub fn torn_difference(logged: &RunLog, table: Table) -> Difference {
    let whole = logged.last.map_or(0, |seal| seal.tick + 1);
    let found = format!("rows that agree with their seals for {whole} ticks only");
    Difference::at_end(table.file_name(), None, found, "more".to_owned())
}

/// Returns the first line of a table that differs, with its time in the log `of`.
fn line_difference(of: &RunLog, table: Table, a: &[u8], b: &[u8]) -> Option<Difference> {
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
    let cell_of = |name: &str| {
        let column = columns.iter().position(|column| column == name)?;
        row.get(column)
    };
    let robot = cell_of("robot")
        .or(cell_of("receiver"))
        .or(cell_of("sender"));
    let name = columns.get(column).map_or("", String::as_str);
    let shown = |row: &[String]| cell(row, column).unwrap_or_else(|| "no row".to_owned());
    let t_ms = cell_of("t_ms").and_then(|t_ms| t_ms.parse().ok());
    Some(Difference {
        tick: t_ms.map(|t_ms: u64| t_ms / of.run.setup.scenario.step_ms),
        t_ms: t_ms.map(SimTime),
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

/// Locates a difference within a tick whose sections have no hashes: the first row of a table that differs.
pub fn difference_of_tick(
    a: &RunLog,
    b: &RunLog,
    (row_a, row_b): (&TickRow, &TickRow),
) -> Result<Difference, ReadError> {
    // The order of the sections in a tick. State changes follow from motivations.
    let sections = [
        Section::Messages,
        Section::Motivations,
        Section::Events,
        Section::State,
    ];
    for section in sections {
        for table in tables_of(section.as_str()) {
            if let Some(found) = first_field(*table, a, b, row_a)? {
                return Ok(Difference {
                    tick: Some(row_a.tick),
                    t_ms: Some(row_a.t_ms),
                    robot: found.robot,
                    ..Difference::at_end(section.as_str(), Some(found.field), found.a, found.b)
                });
            }
        }
    }
    let [hash_a, hash_b] = [row_a, row_b].map(|row| format!("{:016x}", row.hash));
    Ok(Difference {
        tick: Some(row_a.tick),
        t_ms: Some(row_a.t_ms),
        ..Difference::at_end(&row_a.section, None, hash_a, hash_b)
    })
}

/// Locates the first pair of rows that differ. `rows` contains all rows of both logs.
pub fn row_difference(
    a: &RunLog,
    b: &RunLog,
    (row_a, row_b): (&TickRow, &TickRow),
    rows: (&[TickRow], &[TickRow]),
) -> Result<Difference, ReadError> {
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
    let fields = tables_of(&row.section).iter();
    let mut fields = fields.map(|table| first_field(*table, a, b, row));
    let field = fields.find_map(Result::transpose).transpose()?;
    let describe = |row: &TickRow| {
        if same_place {
            format!("{:016x}", row.hash)
        } else {
            format!("{} {}", row.robot, row.section)
        }
    };
    let (field, a, b) = match field {
        Some(found) => (Some(found.field), found.a, found.b),
        None => (None, describe(row_a), describe(row_b)),
    };
    Ok(Difference {
        cause: None,
        tick: Some(row.tick),
        t_ms: Some(row.t_ms),
        robot: row.robot.clone(),
        section: row.section.clone(),
        field,
        a,
        b,
    })
}

/// Returns the tables that contain the data of a section.
fn tables_of(section: &str) -> &'static [Table] {
    let is = |wanted: Section| wanted.as_str() == section;
    if is(Section::Inputs) || is(Section::Events) {
        &[Table::Events]
    } else if is(Section::Messages) {
        &[Table::Messages]
    } else if is(Section::Motivations) {
        &[Table::Motivations, Table::Allocation, Table::Events]
    } else if is(Section::State) {
        &[Table::Poses, Table::Mission, Table::Targets]
    } else {
        &[]
    }
}

/// A field that differs, with its robot and both values.
struct FieldDifference {
    robot: String,
    field: String,
    a: String,
    b: String,
}

/// Returns the first differing field of a table in the rows of that tick and robot.
fn first_field(
    table: Table,
    a: &RunLog,
    b: &RunLog,
    place: &TickRow,
) -> Result<Option<FieldDifference>, ReadError> {
    let at = Some(place.t_ms);
    let (table_a, table_b) = (a.full_table(table, at)?, b.full_table(table, at)?);
    // An optional table without rows has no header line.
    let header = [&table_a, &table_b]
        .into_iter()
        .find(|table| !table.is_empty());
    let header = header.and_then(|table| table.split(|&byte| byte == b'\n').next());
    let header = String::from_utf8_lossy(header.unwrap_or_default());
    let columns: Vec<&str> = header.split(',').collect();
    let robot_column = columns
        .iter()
        .position(|column| matches!(*column, "robot" | "receiver"));
    let time = place.t_ms.0.to_string();
    let rows = |table: &[u8]| -> Vec<StringRecord> {
        csv::Reader::from_reader(table)
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
    let (rows_a, rows_b) = (rows(&table_a), rows(&table_b));
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
                let robot = row_a.or(row_b).zip(robot_column);
                let robot = robot.and_then(|(row, column)| row.get(column));
                return Ok(Some(FieldDifference {
                    robot: robot
                        .filter(|robot| !robot.is_empty())
                        .unwrap_or(WORLD_ROBOT)
                        .to_owned(),
                    field: format!("{}: {name}{subject}", table.file_name()),
                    a: cell(row_a),
                    b: cell(row_b),
                }));
            }
        }
    }
    Ok(None)
}

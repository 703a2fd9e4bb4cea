//! The tables of a log as Parquet: a file each, with the columns of DESIGN §8 under their names.
//!
//! Numbers keep their values to the bit: times and counts are 64-bit integers, positions single and motivations double
//! floats. Flags are booleans, numbers that a row lacks are null, and texts that it lacks are empty, as in the CSV.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{BufWriter, ErrorKind};
use std::path::Path;
use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type,
};
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{Type, TypePtr};
use anyhow::{Context, bail};
use world_server::recorder::{
    EventRow, MessageRow, MissionRow, MotivationRow, PoseRow, RunLog, Table, TableRow, TickRow,
};

use super::facts;
use super::new_file::NewFile;

/// Rows that are held in memory at once.
const GROUP_ROWS: usize = 1 << 16;

/// Writes one table of a log into its file.
type WriteTable = fn(&RunLog, &mut NewFile) -> anyhow::Result<()>;

/// Writes the tables that the log's level keeps into a folder; says which it does not keep. Files that an older export has
/// left of those are removed: beside the new ones they would pass for tables of this run.
///
/// # Errors
/// When the log has no tables, holds what is no row, or a file cannot be written. Then all older files are still there.
pub fn write(log: &RunLog, folder: &Path) -> anyhow::Result<Vec<&'static str>> {
    let tables: [(Table, WriteTable); 6] = [
        (MotivationRow::TABLE, write_table::<MotivationRow>),
        (MessageRow::TABLE, write_table::<MessageRow>),
        (EventRow::TABLE, write_table::<EventRow>),
        (PoseRow::TABLE, write_table::<PoseRow>),
        (MissionRow::TABLE, write_table::<MissionRow>),
        (TickRow::TABLE, write_table::<TickRow>),
    ];
    let (kept, left_out): (Vec<_>, Vec<_>) = tables
        .into_iter()
        .partition(|(table, _)| log.run.log.keeps(*table));
    if kept.is_empty() {
        bail!(
            "the run was logged with --log {}, which keeps no tables: run it again with --log full",
            log.run.log.as_str()
        );
    }
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = |table: Table| folder.join(format!("{}.parquet", name(table)));
    let mut files = Vec::new();
    for (table, write) in kept {
        let path = path(table);
        let mut file = NewFile::create(&path)?;
        write(log, &mut file).with_context(|| path.display().to_string())?;
        files.push(file);
    }
    for file in files {
        file.put_in_place()?;
    }
    for (table, _) in &left_out {
        let path = path(*table);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                return Err(error).with_context(|| format!("cannot remove {}", path.display()));
            }
            _ => {}
        }
    }
    Ok(left_out.iter().map(|(table, _)| name(*table)).collect())
}

/// Without the ending of the CSV file.
fn name(table: Table) -> &'static str {
    table.file_name().trim_end_matches(".csv")
}

/// A column: its name, and where a row has it.
struct Column<R>(&'static str, Values<R>);

/// What a column holds.
enum Values<R> {
    Integer(fn(&R) -> u64),
    /// Null where a row has none.
    Optional(fn(&R) -> Option<u64>),
    Single(fn(&R) -> f32),
    OptionalSingle(fn(&R) -> Option<f32>),
    Double(fn(&R) -> f64),
    Flag(fn(&R) -> bool),
    Text(for<'r> fn(&'r R) -> Cow<'r, str>),
}

use Values::{Double, Flag, Integer, Optional, OptionalSingle, Single, Text};

/// A row with all its columns, in the order of the CSV.
trait Columns: TableRow + 'static {
    const COLUMNS: &'static [Column<Self>];
}

impl Columns for MotivationRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("task", Text(|row| (&row.task).into())),
        Column("motivation", Double(|row| row.motivation)),
        Column("impatience", Double(|row| row.impatience)),
        Column("sensory_feedback", Flag(|row| row.sensory_feedback)),
        Column("activity_suppression", Flag(|row| row.activity_suppression)),
        Column("impatience_reset", Flag(|row| row.impatience_reset)),
        Column("acquiescence", Flag(|row| row.acquiescence)),
        Column("state", Text(|row| (&row.state).into())),
    ];
}

impl Columns for MessageRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("receiver", Text(|row| (&row.receiver).into())),
        Column("sender", Text(|row| (&row.sender).into())),
        Column("incarnation", Integer(|row| row.incarnation.into())),
        Column("seq", Optional(|row| row.seq)),
        Column("kind", Text(|row| (&row.kind).into())),
        Column("state", Text(|row| (&row.state).into())),
        Column("since_ms", Optional(|row| row.since_ms.map(|time| time.0))),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("task", Text(|row| (&row.task).into())),
        Column("progress", Optional(|row| row.progress.map(u64::from))),
        Column("sent_ms", Integer(|row| row.sent_ms.0)),
        Column("fate", Text(|row| (&row.fate).into())),
    ];
}

impl Columns for EventRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("kind", Text(|row| (&row.kind).into())),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("subject", Text(|row| (&row.subject).into())),
        Column("reason", Text(|row| (&row.reason).into())),
        Column("detail", Text(|row| (&row.detail).into())),
    ];
}

impl Columns for PoseRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("x_m", Single(|row| row.x_m)),
        Column("y_m", Single(|row| row.y_m)),
        Column("heading_rad", Single(|row| row.heading_rad)),
        Column("speed_m_s", Single(|row| row.speed_m_s)),
        Column("carrying", Flag(|row| row.carrying)),
        Column("behavior_set", Text(|row| (&row.behavior_set).into())),
        Column("energy", OptionalSingle(|row| row.energy)),
    ];
}

impl Columns for MissionRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("items_in_spills", Integer(|row| row.items_in_spills.into())),
        Column("items_carried", Integer(|row| row.items_carried.into())),
        Column("items_on_floor", Integer(|row| row.items_on_floor.into())),
        Column("items_delivered", Integer(|row| row.items_delivered.into())),
        Column(
            "last_report_ms",
            Optional(|row| row.last_report_ms.map(|time| time.0)),
        ),
    ];
}

impl Columns for TickRow {
    const COLUMNS: &'static [Column<Self>] = &[
        Column("t_ms", Integer(|row| row.t_ms.0)),
        Column("tick", Integer(|row| row.tick)),
        Column("robot", Text(|row| (&row.robot).into())),
        Column("section", Text(|row| (&row.section).into())),
        Column("hash", Text(|row| format!("{:016x}", row.hash).into())),
    ];
}

impl<R> Column<R> {
    fn schema(&self) -> Result<TypePtr, ::parquet::errors::ParquetError> {
        let (physical, logical) = match self.1 {
            Integer(_) | Optional(_) => (PhysicalType::INT64, None),
            Single(_) | OptionalSingle(_) => (PhysicalType::FLOAT, None),
            Double(_) => (PhysicalType::DOUBLE, None),
            Flag(_) => (PhysicalType::BOOLEAN, None),
            Text(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = match self.1 {
            Optional(_) | OptionalSingle(_) => Repetition::OPTIONAL,
            _ => Repetition::REQUIRED,
        };
        let column = Type::primitive_type_builder(self.0, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(column))
    }

    fn write(
        &self,
        rows: &[R],
        column: &mut SerializedColumnWriter<'_>,
    ) -> Result<(), ::parquet::errors::ParquetError> {
        let rows = rows.iter();
        match self.1 {
            Integer(of) => required::<Int64Type>(column, rows.map(of).map(integer).collect()),
            Optional(of) => {
                optional::<Int64Type>(column, rows.map(|row| of(row).map(integer)).collect())
            }
            Single(of) => required::<FloatType>(column, rows.map(of).collect()),
            OptionalSingle(of) => optional::<FloatType>(column, rows.map(of).collect()),
            Double(of) => required::<DoubleType>(column, rows.map(of).collect()),
            Flag(of) => required::<BoolType>(column, rows.map(of).collect()),
            Text(of) => {
                let text = |row| ByteArray::from(of(row).into_owned().into_bytes());
                required::<ByteArrayType>(column, rows.map(text).collect())
            }
        }
    }
}

/// Parquet's signed integers, for unsigned ones make differences in a notebook wrap around. 2^63 ms are 292 million years.
fn integer(number: u64) -> i64 {
    number as i64
}

fn required<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: Vec<T::T>,
) -> Result<(), ::parquet::errors::ParquetError> {
    column.typed::<T>().write_batch(&values, None, None)?;
    Ok(())
}

fn optional<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: Vec<Option<T::T>>,
) -> Result<(), ::parquet::errors::ParquetError> {
    let there: Vec<i16> = values.iter().map(|value| value.is_some().into()).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    column
        .typed::<T>()
        .write_batch(&values, Some(&there), None)?;
    Ok(())
}

fn write_table<R: Columns>(log: &RunLog, file: &mut NewFile) -> anyhow::Result<()> {
    let columns = R::COLUMNS
        .iter()
        .map(Column::schema)
        .collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder(name(R::TABLE))
        .with_fields(columns)
        .build()?;
    let facts = facts(log).into_iter();
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(Some(
            facts
                .map(|(key, value)| KeyValue::new(key, value))
                .collect(),
        ))
        .build();
    let mut writer: SerializedFileWriter<BufWriter<&mut File>> =
        SerializedFileWriter::new(file.writer(), Arc::new(schema), Arc::new(properties))?;
    let mut rows = log.each_row::<R>();
    loop {
        let group: Vec<R> = rows.by_ref().take(GROUP_ROWS).collect::<Result<_, _>>()?;
        if group.is_empty() {
            break;
        }
        let mut group_writer = writer.next_row_group()?;
        for column in R::COLUMNS {
            let mut column_writer = group_writer
                .next_column()?
                .context("fewer columns than in the schema")?;
            column.write(&group, &mut column_writer)?;
            column_writer.close()?;
        }
        group_writer.close()?;
    }
    writer.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check<R: Columns>() {
        let names: Vec<&str> = R::COLUMNS.iter().map(|column| column.0).collect();
        assert_eq!(names.join(","), R::TABLE.header().trim_end());
    }

    #[test]
    fn every_column_under_its_name() {
        check::<MotivationRow>();
        check::<MessageRow>();
        check::<EventRow>();
        check::<PoseRow>();
        check::<MissionRow>();
        check::<TickRow>();
    }
}

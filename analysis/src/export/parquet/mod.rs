//! Export of a log's tables as Parquet: one file per table, with the column names of the CSV.
//!
//! Numbers keep their exact values: times and counts are 64-bit integers, positions are single and motivations double
//! floats. Flags are booleans. Missing numbers are null, and missing texts are empty.

mod column;

use std::fs::{self, File};
use std::io::{BufWriter, ErrorKind};
use std::path::Path;
use std::sync::Arc;

use ::parquet::basic::Compression;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::Type;
use anyhow::{Context, anyhow, bail};
use run_log::{
    AllocationMessageRow, AllocationRow, DeclaredRow, EventRow, MessageRow, MissionRow,
    MotivationRow, PoseRow, RunLog, Table, TableRow, TargetRow, TickRow,
};

use super::columns::{Column, declared, of_mission};
use super::facts;
use crate::new_file::NewFile;

/// Rows per group, which are in memory at once.
const GROUP_ROWS: usize = 1 << 16;

type WriteTable = fn(&RunLog, &mut NewFile) -> anyhow::Result<()>;

/// Writes the log's tables into a folder. Returns the tables that the log level excludes. Files of excluded tables from
/// an older export are removed, because they would seem to belong to this run.
///
/// # Errors
/// Returns an error when the log has no tables, a row is invalid, or a file cannot be written. Older files remain until
/// all new files are written.
pub fn write(log: &RunLog, folder: &Path) -> anyhow::Result<Vec<&'static str>> {
    let tables: [(Table, WriteTable); 9] = [
        (MotivationRow::TABLE, write_known::<MotivationRow>),
        (AllocationRow::TABLE, write_known::<AllocationRow>),
        (
            AllocationMessageRow::TABLE,
            write_known::<AllocationMessageRow>,
        ),
        (MessageRow::TABLE, write_known::<MessageRow>),
        (EventRow::TABLE, write_known::<EventRow>),
        (PoseRow::TABLE, write_known::<PoseRow>),
        (MissionRow::TABLE, write_mission),
        (TargetRow::TABLE, write_known::<TargetRow>),
        (TickRow::TABLE, write_known::<TickRow>),
    ];
    let (kept, left_out): (Vec<_>, Vec<_>) = tables
        .into_iter()
        .partition(|(table, _)| log.run.log.keeps(*table) && !is_absent(log, *table));
    if kept.is_empty() {
        bail!(
            "the run was logged with --log {}, which keeps no tables: run it again with --log full",
            log.run.log.as_str()
        );
    }
    fs::create_dir_all(folder).with_context(|| format!("cannot create {}", folder.display()))?;
    let path = |table: Table| folder.join(format!("{}.parquet", name(table)));
    let mut files = Vec::new();
    for (table, write) in kept {
        let path = path(table);
        let mut file = NewFile::create(&path)?;
        write(log, &mut file)
            // The intermediate errors repeat the same text.
            .map_err(|error| anyhow!("{}: {}", path.display(), error.root_cause()))?;
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
    let left_out = left_out.into_iter().map(|(table, _)| table);
    // Optional tables are not reported as missing.
    Ok(left_out
        .filter(|table| !table.is_optional())
        .map(name)
        .collect())
}

/// Returns whether an optional table has no file because it has no rows.
fn is_absent(log: &RunLog, table: Table) -> bool {
    table.is_optional() && log.table(table).is_empty()
}

/// Returns the table name: the CSV file name without extension.
fn name(table: Table) -> &'static str {
    table.file_name().trim_end_matches(".csv")
}

fn write_known<R: DeclaredRow>(log: &RunLog, file: &mut NewFile) -> anyhow::Result<()> {
    write_table(log, &declared::<R>(), file)
}

fn write_mission(log: &RunLog, file: &mut NewFile) -> anyhow::Result<()> {
    let declared = log.run.setup.catalog.mission.vocabulary().columns;
    write_table(log, &of_mission(declared), file)
}

fn write_table<R: TableRow>(
    log: &RunLog,
    columns: &[Column<R>],
    file: &mut NewFile,
) -> anyhow::Result<()> {
    let fields = columns
        .iter()
        .map(column::schema)
        .collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder(name(R::TABLE))
        .with_fields(fields)
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
        for column in columns {
            let mut column_writer = group_writer
                .next_column()?
                .context("fewer columns than in the schema")?;
            column::write(column, &group, &mut column_writer)?;
            column_writer.close()?;
        }
        group_writer.close()?;
    }
    writer.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::Field;
    use tempfile::TempDir;

    use super::*;
    use crate::visit;

    #[test]
    fn mission_csv_has_the_columns_and_types_that_the_mission_declares() {
        let tables = [(Table::Mission, visit::TABLE.as_bytes().to_vec())];
        let log = RunLog::from_tables(Path::new(""), visit::run_file(), tables.into());
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("mission.parquet");
        let mut file = NewFile::create(&path).unwrap();
        write_mission(&log, &mut file).unwrap();
        file.put_in_place().unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        let rows = reader.get_row_iter(None).unwrap();
        let rows: Vec<Vec<(String, Field)>> = rows.map(|row| row.unwrap().into_columns()).collect();
        let row = |values: [Field; 5]| -> Vec<(String, Field)> {
            let names = [
                "t_ms",
                "places_left",
                "places_visited",
                "last_visit_ms",
                "way_m",
            ];
            names.map(str::to_owned).into_iter().zip(values).collect()
        };
        let [count, time] = [Field::Long, Field::Long];
        assert_eq!(
            rows,
            [
                row([count(0), count(5), count(0), Field::Null, Field::Null]),
                row([
                    count(10_000),
                    count(4),
                    count(1),
                    time(10_000),
                    Field::Double(2.5)
                ]),
                row([
                    count(20_000),
                    count(2),
                    count(3),
                    time(20_000),
                    Field::Double(7.0)
                ]),
            ]
        );
    }
}

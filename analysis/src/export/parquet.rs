//! Export of a log's tables as Parquet: one file per table, with the column names of the CSV.
//!
//! Numbers keep their exact values: times and counts are 64-bit integers, positions are single and motivations double
//! floats. Flags are booleans. Missing numbers are null, and missing texts are empty.

use std::fs::{self, File};
use std::io::ErrorKind;
use std::path::Path;

use ::parquet::file::metadata::KeyValue;
use anyhow::{Context, bail};
use run_log::{
    AllocationMessageRow, AllocationRow, DeclaredRow, EventRow, HitRow, MessageRow, MissionRow,
    MotivationRow, PoseRow, RunLog, SentRow, Table, TableRow, TargetRow, TickRow,
};

use super::facts;
use crate::columns::parquet::{create, write_group};
use crate::columns::{Column, declared, of_mission};
use crate::new_file::{NewFile, Output};

/// Rows per group, which are in memory at once.
const GROUP_ROWS: usize = 1 << 16;

type TableFile<'f> = Output<&'f mut File>;
type WriteTable = fn(&RunLog, &mut TableFile<'_>) -> anyhow::Result<()>;

/// Writes the log's tables into a folder. Returns the tables that the log level excludes. Files of excluded tables from
/// an older export are removed, because they would seem to belong to this run.
///
/// # Errors
/// Returns an error when the log has no tables, a row is invalid, or a file cannot be written. Older files remain until
/// all new files are written.
pub fn write(log: &RunLog, folder: &Path) -> anyhow::Result<Vec<&'static str>> {
    fn known<R: DeclaredRow>() -> (Table, WriteTable) {
        (R::TABLE, |log, file| {
            write_table(log, &declared::<R>(), file)
        })
    }
    let tables = [
        known::<MotivationRow>(),
        known::<AllocationRow>(),
        known::<AllocationMessageRow>(),
        known::<MessageRow>(),
        known::<SentRow>(),
        known::<HitRow>(),
        known::<EventRow>(),
        known::<PoseRow>(),
        (MissionRow::TABLE, write_mission as WriteTable),
        known::<TargetRow>(),
        known::<TickRow>(),
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
    let path = |table| folder.join(format!("{}.parquet", name(table)));
    let mut files = Vec::new();
    for (table, write) in kept {
        let path = path(table);
        let mut file = NewFile::create(&path)?;
        file.write(|output| write(log, output))?;
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

fn write_mission(log: &RunLog, file: &mut TableFile<'_>) -> anyhow::Result<()> {
    let declared = log.run.setup.catalog.mission.vocabulary().columns;
    write_table(log, &of_mission(declared), file)
}

fn write_table<R: TableRow>(
    log: &RunLog,
    columns: &[Column<R>],
    file: &mut TableFile<'_>,
) -> anyhow::Result<()> {
    let facts = facts(log).into_iter();
    let facts = facts
        .map(|(key, value)| KeyValue::new(key, value))
        .collect();
    let mut writer = create(file, name(R::TABLE), columns, Some(facts))?;
    let mut rows = log.each_row::<R>();
    loop {
        let group: Vec<R> = rows.by_ref().take(GROUP_ROWS).collect::<Result<_, _>>()?;
        if group.is_empty() {
            break;
        }
        write_group(&mut writer, columns, &group)?;
    }
    writer.close()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use ::parquet::file::reader::{FileReader, SerializedFileReader};
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
        file.write(|output| write_mission(&log, output)).unwrap();
        file.put_in_place().unwrap();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        let rows = reader.get_row_iter(None).unwrap();
        let rows: Vec<String> = rows.map(|row| row.unwrap().to_string()).collect();
        let expected = [
            "{t_ms: 0, places_left: 5, places_visited: 0, last_visit_ms: null, way_m: null}",
            "{t_ms: 10000, places_left: 4, places_visited: 1, last_visit_ms: 10000, way_m: 2.5}",
            "{t_ms: 20000, places_left: 2, places_visited: 3, last_visit_ms: 20000, way_m: 7.0}",
        ];
        assert_eq!(rows, expected);
    }
}

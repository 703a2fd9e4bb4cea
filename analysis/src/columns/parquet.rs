//! Parquet files. Whole numbers are 64 bits with a sign, times and counts included.

use std::io::Write;
use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type,
};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{Type, TypePtr};
use anyhow::Context;
use run_log::{CellKind, CellValue};

use super::Column;

/// Creates a file with these columns and facts.
pub fn create<W: Write + Send, R>(
    file: W,
    table: &str,
    columns: &[Column<R>],
    facts: Option<Vec<KeyValue>>,
) -> anyhow::Result<SerializedFileWriter<W>> {
    let fields = columns.iter().map(schema).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder(table)
        .with_fields(fields)
        .build()?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_key_value_metadata(facts)
        .build();
    Ok(SerializedFileWriter::new(
        file,
        Arc::new(schema),
        Arc::new(properties),
    )?)
}

/// Appends rows as a group.
pub fn write_group<W: Write + Send, R>(
    file: &mut SerializedFileWriter<W>,
    columns: &[Column<R>],
    rows: &[R],
) -> anyhow::Result<()> {
    let mut group = file.next_row_group()?;
    for column in columns {
        let mut writer = group
            .next_column()?
            .context("fewer columns than in the schema")?;
        write(column, rows, &mut writer)?;
        writer.close()?;
    }
    group.close()?;
    Ok(())
}

fn schema<R>(column: &Column<R>) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.kind {
        CellKind::Whole32 | CellKind::Whole64 => (PhysicalType::INT64, None),
        CellKind::Single => (PhysicalType::FLOAT, None),
        CellKind::Double => (PhysicalType::DOUBLE, None),
        CellKind::Flag => (PhysicalType::BOOLEAN, None),
        CellKind::Text | CellKind::Hash => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let repetition = match column.is_optional {
        true => Repetition::OPTIONAL,
        false => Repetition::REQUIRED,
    };
    let column = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(column))
}

fn write<R>(
    column: &Column<R>,
    rows: &[R],
    writer: &mut SerializedColumnWriter<'_>,
) -> Result<(), ParquetError> {
    let write = (column, rows, writer);
    match column.kind {
        // Differences of unsigned integers would wrap around in notebooks. 2^63 ms are 292 million years.
        CellKind::Whole32 | CellKind::Whole64 => {
            write_as::<R, Int64Type>(write, |value| match value {
                CellValue::Whole(number) => Some(number as i64),
                _ => None,
            })
        }
        CellKind::Single => write_as::<R, FloatType>(write, |value| match value {
            CellValue::Single(number) => Some(number),
            _ => None,
        }),
        CellKind::Double => write_as::<R, DoubleType>(write, |value| match value {
            CellValue::Double(number) => Some(number),
            _ => None,
        }),
        CellKind::Flag => write_as::<R, BoolType>(write, |value| match value {
            CellValue::Flag(flag) => Some(flag),
            _ => None,
        }),
        CellKind::Text | CellKind::Hash => {
            write_as::<R, ByteArrayType>(write, |value| match value {
                CellValue::Text(text) => Some(ByteArray::from(text)),
                CellValue::Hash(hash) => Some(ByteArray::from(format!("{hash:016x}").into_bytes())),
                _ => None,
            })
        }
    }
}

/// Writes the values as the type `T`. A required value that is missing becomes the default of its type, as the count of
/// a mission that has not begun.
fn write_as<R, T: DataType>(
    (column, rows, writer): (&Column<R>, &[R], &mut SerializedColumnWriter<'_>),
    convert: fn(CellValue<'_>) -> Option<T::T>,
) -> Result<(), ParquetError> {
    let values = rows.iter().map(|row| (column.value)(row).and_then(convert));
    let writer = writer.typed::<T>();
    if column.is_optional {
        let values: Vec<Option<T::T>> = values.collect();
        let levels: Vec<i16> = values.iter().map(|value| value.is_some().into()).collect();
        let values: Vec<T::T> = values.into_iter().flatten().collect();
        writer.write_batch(&values, Some(&levels), None)?;
    } else {
        let values: Vec<T::T> = values.map(Option::unwrap_or_default).collect();
        writer.write_batch(&values, None, None)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use ::parquet::file::reader::{FileReader, SerializedFileReader};

    use crate::sweep::results::results_table;
    use crate::sweep::results::tests::{complete, design, failed, incomplete};

    #[test]
    fn a_written_table_can_be_read() {
        let design = design("[grid]\nbody.speed_m_s = [0.5, 1, 0.25]\n");
        let rows = [complete(0, 4_000), incomplete(1), failed(2)];
        let bytes = results_table(&design, &rows).parquet().unwrap();
        let path = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(path.path(), bytes).unwrap();
        let file = SerializedFileReader::new(path.reopen().unwrap()).unwrap();
        let rows = file.get_row_iter(None).unwrap();
        let found: Vec<String> = rows.map(|row| row.unwrap().to_string()).collect();
        assert_eq!(found.len(), 3);
        for (row, part) in [
            (1, "body.speed_m_s: 1.0, "),
            (0, "sim_time_ms: 4000, "),
            (0, "report_lateness_mean_ms: 1.5, "),
            (1, "report_lateness_mean_ms: null, "),
            (2, "outcome: \"failed\", hash: null, "),
            (0, "reason: null}"),
        ] {
            assert!(found[row].contains(part), "{part}: {}", found[row]);
        }
    }
}

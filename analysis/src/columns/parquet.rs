//! The results table as Parquet. Equal rows give equal bytes.

use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{Type, TypePtr};
use anyhow::Context;

use super::Column;
use super::Values::{Flags, Integers, Numbers, Texts};

/// Returns the table as a Parquet file.
pub fn to_parquet(columns: &[Column]) -> anyhow::Result<Vec<u8>> {
    let fields = columns.iter().map(schema).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("runs")
        .with_fields(fields)
        .build()?;
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .build();
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::new(properties))?;
    let mut group = file.next_row_group()?;
    for column in columns {
        let mut writer = group
            .next_column()?
            .context("the table has fewer columns than the schema")?;
        write(column, &mut writer)?;
        writer.close()?;
    }
    group.close()?;
    file.close()?;
    Ok(bytes)
}

fn schema(column: &Column) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.values {
        Integers(_) => (PhysicalType::INT64, None),
        Numbers(_) => (PhysicalType::DOUBLE, None),
        Flags(_) => (PhysicalType::BOOLEAN, None),
        Texts(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let column = Type::primitive_type_builder(&column.name, physical)
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(column))
}

fn write(column: &Column, writer: &mut SerializedColumnWriter<'_>) -> Result<(), ParquetError> {
    match &column.values {
        Integers(values) => write_optional::<Int64Type>(writer, values.iter().copied()),
        Numbers(values) => write_optional::<DoubleType>(writer, values.iter().copied()),
        Flags(values) => write_optional::<BoolType>(writer, values.iter().copied()),
        Texts(values) => {
            let bytes = |text: &String| ByteArray::from(text.clone().into_bytes());
            write_optional::<ByteArrayType>(
                writer,
                values.iter().map(|text| text.as_ref().map(bytes)),
            )
        }
    }
}

/// Writes values of an optional column.
pub fn write_optional<T: DataType>(
    writer: &mut SerializedColumnWriter<'_>,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let values: Vec<Option<T::T>> = values.collect();
    let levels: Vec<i16> = values.iter().map(|value| value.is_some().into()).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    writer
        .typed::<T>()
        .write_batch(&values, Some(&levels), None)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use ::parquet::record::Field;

    use super::*;
    use crate::sweep::results::results_table;
    use crate::sweep::results::tests::{complete, design, failed, incomplete};

    #[test]
    fn a_written_table_can_be_read() {
        let design = design("[grid]\nbody.speed_m_s = [0.5, 1, 0.25]\n");
        let rows = [complete(0, 4_000), incomplete(1), failed(2)];
        let bytes = to_parquet(&results_table(&design, &rows).columns).unwrap();
        let path = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(path.path(), bytes).unwrap();
        let file = SerializedFileReader::new(path.reopen().unwrap()).unwrap();
        let found: Vec<Vec<(String, Field)>> = file
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().into_columns())
            .collect();
        let field = |row: usize, name: &str| {
            let found = found[row].iter().find(|(column, _)| column == name);
            found.unwrap().1.clone()
        };
        assert_eq!(found.len(), 3);
        assert_eq!(field(1, "body.speed_m_s"), Field::Double(1.0));
        assert_eq!(field(0, "sim_time_ms"), Field::Long(4000));
        assert_eq!(field(0, "report_lateness_mean_ms"), Field::Double(1.5));
        assert_eq!(field(1, "report_lateness_mean_ms"), Field::Null);
        assert_eq!(field(2, "outcome"), Field::Str("failed".to_owned()));
        assert_eq!(field(2, "hash"), Field::Null);
        assert_eq!(field(0, "reason"), Field::Null);
    }
}

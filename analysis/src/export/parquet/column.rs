//! The encoding of a column's values.

use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type,
};
use ::parquet::errors::ParquetError;
use ::parquet::file::writer::SerializedColumnWriter;
use ::parquet::schema::types::{Type, TypePtr};
use run_log::{CellKind, CellValue};

use crate::export::columns::Column;

/// Returns the column's type in the file.
pub fn schema<R>(column: &Column<R>) -> Result<TypePtr, ParquetError> {
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
    let column = Type::primitive_type_builder(column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(column))
}

/// Writes the column's values of these rows.
pub fn write<R>(
    column: &Column<R>,
    rows: &[R],
    writer: &mut SerializedColumnWriter<'_>,
) -> Result<(), ParquetError> {
    match column.kind {
        // Differences of unsigned integers would wrap around in notebooks. 2^63 ms are 292 million years.
        CellKind::Whole32 | CellKind::Whole64 => {
            write_as::<R, Int64Type>(column, rows, writer, |value| match value {
                CellValue::Whole(number) => Some(number as i64),
                _ => None,
            })
        }
        CellKind::Single => write_as::<R, FloatType>(column, rows, writer, |value| match value {
            CellValue::Single(number) => Some(number),
            _ => None,
        }),
        CellKind::Double => write_as::<R, DoubleType>(column, rows, writer, |value| match value {
            CellValue::Double(number) => Some(number),
            _ => None,
        }),
        CellKind::Flag => write_as::<R, BoolType>(column, rows, writer, |value| match value {
            CellValue::Flag(flag) => Some(flag),
            _ => None,
        }),
        CellKind::Text | CellKind::Hash => {
            write_as::<R, ByteArrayType>(column, rows, writer, |value| match value {
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
    column: &Column<R>,
    rows: &[R],
    writer: &mut SerializedColumnWriter<'_>,
    convert: fn(CellValue<'_>) -> Option<T::T>,
) -> Result<(), ParquetError> {
    let values = rows.iter().map(|row| (column.value)(row).and_then(convert));
    if column.is_optional {
        let values: Vec<Option<T::T>> = values.collect();
        let levels: Vec<i16> = values.iter().map(|value| value.is_some().into()).collect();
        let values: Vec<T::T> = values.into_iter().flatten().collect();
        let writer = writer.typed::<T>();
        writer.write_batch(&values, Some(&levels), None)?;
    } else {
        let values: Vec<T::T> = values.map(Option::unwrap_or_default).collect();
        writer.typed::<T>().write_batch(&values, None, None)?;
    }
    Ok(())
}

//! A table column: the source of its values and their encoding.

use std::borrow::Cow;
use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type,
};
use ::parquet::errors::ParquetError;
use ::parquet::file::writer::SerializedColumnWriter;
use ::parquet::schema::types::{Type, TypePtr};
use scenario::mission::columns::ColumnKind;

/// A column with its name and the source of its values.
pub struct Column<R>(pub &'static str, pub Values<R>);

/// The source and type of a column's values.
pub enum Values<R> {
    /// Times and counts as 64-bit integers.
    Integer(fn(&R) -> u64),
    /// 64-bit integers; null for missing values.
    Optional(fn(&R) -> Option<u64>),
    Single(fn(&R) -> f32),
    /// 32-bit floats; null for missing values.
    OptionalSingle(fn(&R) -> Option<f32>),
    Double(fn(&R) -> f64),
    /// 64-bit floats; null for missing values.
    OptionalDouble(fn(&R) -> Option<f64>),
    Flag(fn(&R) -> bool),
    /// A column of mission.csv: counts, optional times, or optional 64-bit floats.
    Declared(ColumnKind, fn(&R, &str) -> Option<f64>),
    /// UTF-8 text; empty for missing values.
    Text(for<'r> fn(&'r R) -> Cow<'r, str>),
}

use Values::{
    Declared, Double, Flag, Integer, Optional, OptionalDouble, OptionalSingle, Single, Text,
};

impl<R> Column<R> {
    /// Returns the column's type in the file.
    pub fn schema(&self) -> Result<TypePtr, ParquetError> {
        let (physical, logical) = match self.1 {
            Declared(ColumnKind::Real, _) => (PhysicalType::DOUBLE, None),
            Integer(_) | Optional(_) | Declared(..) => (PhysicalType::INT64, None),
            Single(_) | OptionalSingle(_) => (PhysicalType::FLOAT, None),
            Double(_) | OptionalDouble(_) => (PhysicalType::DOUBLE, None),
            Flag(_) => (PhysicalType::BOOLEAN, None),
            Text(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = match self.1 {
            Optional(_)
            | OptionalSingle(_)
            | OptionalDouble(_)
            | Declared(ColumnKind::Time | ColumnKind::Real, _) => Repetition::OPTIONAL,
            _ => Repetition::REQUIRED,
        };
        let column = Type::primitive_type_builder(self.0, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(column))
    }

    /// Writes the column's values of these rows.
    pub fn write(
        &self,
        rows: &[R],
        column: &mut SerializedColumnWriter<'_>,
    ) -> Result<(), ParquetError> {
        let rows = rows.iter();
        match self.1 {
            Integer(of) => required::<Int64Type>(column, rows.map(of).map(integer).collect()),
            Optional(of) => {
                optional::<Int64Type>(column, rows.map(|row| of(row).map(integer)).collect())
            }
            Single(of) => required::<FloatType>(column, rows.map(of).collect()),
            OptionalSingle(of) => optional::<FloatType>(column, rows.map(of).collect()),
            Double(of) => required::<DoubleType>(column, rows.map(of).collect()),
            OptionalDouble(of) => optional::<DoubleType>(column, rows.map(of).collect()),
            Flag(of) => required::<BoolType>(column, rows.map(of).collect()),
            Declared(kind, of) => {
                let values = rows.map(|row| of(row, self.0));
                let whole = |value: f64| integer(value as u64);
                match kind {
                    ColumnKind::Real => optional::<DoubleType>(column, values.collect()),
                    ColumnKind::Time => {
                        let times = values.map(|value| value.map(whole));
                        optional::<Int64Type>(column, times.collect())
                    }
                    ColumnKind::Done
                    | ColumnKind::Left
                    | ColumnKind::Count
                    | ColumnKind::Expired => {
                        let counts = values.map(|value| value.map_or(0, whole));
                        required::<Int64Type>(column, counts.collect())
                    }
                }
            }
            Text(of) => {
                let text = |row| ByteArray::from(of(row).into_owned().into_bytes());
                required::<ByteArrayType>(column, rows.map(text).collect())
            }
        }
    }
}

/// Converts a number to a signed integer. Differences of unsigned integers would wrap around in notebooks. 2^63 ms are
/// 292 million years.
fn integer(number: u64) -> i64 {
    number as i64
}

fn required<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: Vec<T::T>,
) -> Result<(), ParquetError> {
    column.typed::<T>().write_batch(&values, None, None)?;
    Ok(())
}

fn optional<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    values: Vec<Option<T::T>>,
) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values.iter().map(|value| value.is_some().into()).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    column
        .typed::<T>()
        .write_batch(&values, Some(&levels), None)?;
    Ok(())
}

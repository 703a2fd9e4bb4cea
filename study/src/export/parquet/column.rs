//! A column of a table: where its values come from, and how they are written.

use std::borrow::Cow;
use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{
    BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type,
};
use ::parquet::errors::ParquetError;
use ::parquet::file::writer::SerializedColumnWriter;
use ::parquet::schema::types::{Type, TypePtr};
use alliance_proto::mission::columns::ColumnKind;

/// A column: its name, and where a row has it.
pub struct Column<R>(pub &'static str, pub Values<R>);

/// What a column holds.
pub enum Values<R> {
    /// Times and counts.
    Integer(fn(&R) -> u64),
    /// The same; null where a row has none.
    Optional(fn(&R) -> Option<u64>),
    /// 32-bit floats.
    Single(fn(&R) -> f32),
    /// The same; null where a row has none.
    OptionalSingle(fn(&R) -> Option<f32>),
    /// 64-bit floats.
    Double(fn(&R) -> f64),
    /// Truth values.
    Flag(fn(&R) -> bool),
    /// A column of mission.csv: counts, times that may be null, or 64-bit floats that may.
    Declared(ColumnKind, fn(&R, &str) -> Option<f64>),
    /// UTF-8, empty where a row has none.
    Text(for<'r> fn(&'r R) -> Cow<'r, str>),
}

use Values::{Declared, Double, Flag, Integer, Optional, OptionalSingle, Single, Text};

impl<R> Column<R> {
    /// Its type in the file.
    ///
    /// # Errors
    /// Those of the library.
    pub fn schema(&self) -> Result<TypePtr, ParquetError> {
        let (physical, logical) = match self.1 {
            Declared(ColumnKind::Real, _) => (PhysicalType::DOUBLE, None),
            Integer(_) | Optional(_) | Declared(..) => (PhysicalType::INT64, None),
            Single(_) | OptionalSingle(_) => (PhysicalType::FLOAT, None),
            Double(_) => (PhysicalType::DOUBLE, None),
            Flag(_) => (PhysicalType::BOOLEAN, None),
            Text(_) => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = match self.1 {
            Optional(_) | OptionalSingle(_) | Declared(ColumnKind::Time | ColumnKind::Real, _) => {
                Repetition::OPTIONAL
            }
            _ => Repetition::REQUIRED,
        };
        let column = Type::primitive_type_builder(self.0, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()?;
        Ok(Arc::new(column))
    }

    /// Writes its values in these rows.
    ///
    /// # Errors
    /// Those of the file.
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
                    ColumnKind::Done | ColumnKind::Left | ColumnKind::Count => {
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

/// Parquet's signed integers, for unsigned ones make differences in a notebook wrap around. 2^63 ms are 292 million years.
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
    let there: Vec<i16> = values.iter().map(|value| value.is_some().into()).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    column
        .typed::<T>()
        .write_batch(&values, Some(&there), None)?;
    Ok(())
}

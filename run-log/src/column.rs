//! The columns of tables: their types, and the values of their fields.

use std::fmt;

use scenario::time::SimTime;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// A column of a table.
pub struct Column<R> {
    /// The name in the header line. It ends with the unit, if there is one.
    pub name: &'static str,
    /// The meaning in one line.
    pub about: &'static str,
    /// The type of the values.
    pub kind: CellKind,
    /// True if a value may be missing. A missing text is empty.
    pub is_optional: bool,
    /// A function that returns the value in a row; `None` if it is missing.
    pub value: for<'r> fn(&'r R) -> Option<CellValue<'r>>,
}

/// The type of the values of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellKind {
    /// A whole number below 2^32.
    Whole32,
    /// A whole number of up to 64 bits.
    Whole64,
    /// A number of single precision.
    Single,
    /// A number of double precision.
    Double,
    /// A truth value, written as 0 or 1.
    Flag,
    /// A text, possibly empty.
    Text,
    /// A hash: 16 hexadecimal digits.
    Hash,
}

impl CellKind {
    /// Returns the name of the type for documents.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Whole32 | Self::Whole64 => "whole number",
            Self::Single => "number (single precision)",
            Self::Double => "number (double precision)",
            Self::Flag => "0 or 1",
            Self::Text => "text",
            Self::Hash => "16 hexadecimal digits",
        }
    }
}

/// A value in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellValue<'r> {
    Whole(u64),
    Single(f32),
    Double(f64),
    Flag(bool),
    Text(&'r str),
    Hash(u64),
}

/// A hash in ticks.csv.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowHash(pub u64);

impl fmt::LowerHex for RowHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::LowerHex::fmt(&self.0, f)
    }
}

/// A type of values in rows.
pub(super) trait Cell: Sized {
    const KIND: CellKind;
    const IS_OPTIONAL: bool = false;

    /// Reads the value from a field of a CSV file.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>;

    /// Returns the value; `None` if it is missing.
    fn value(&self) -> Option<CellValue<'_>>;
}

/// Implements `Cell` for types that CSV files contain in the form of serde.
macro_rules! cells {
    ($($type:ty: $kind:ident = $value:expr;)+) => {$(
        impl Cell for $type {
            const KIND: CellKind = CellKind::$kind;

            fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Self::deserialize(deserializer)
            }

            fn value(&self) -> Option<CellValue<'_>> {
                let value: for<'r> fn(&'r Self) -> CellValue<'r> = $value;
                Some(value(self))
            }
        }

        impl Cell for Option<$type> {
            const KIND: CellKind = CellKind::$kind;
            const IS_OPTIONAL: bool = true;

            fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Self::deserialize(deserializer)
            }

            fn value(&self) -> Option<CellValue<'_>> {
                self.as_ref()?.value()
            }
        }
    )+};
}

cells! {
    SimTime: Whole64 = |time| CellValue::Whole(time.0);
    u64: Whole64 = |number| CellValue::Whole(*number);
    u32: Whole32 = |number| CellValue::Whole((*number).into());
    u16: Whole32 = |number| CellValue::Whole((*number).into());
    f32: Single = |number| CellValue::Single(*number);
    f64: Double = |number| CellValue::Double(*number);
    String: Text = |text| CellValue::Text(text);
}

impl Cell for bool {
    const KIND: CellKind = CellKind::Flag;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match u8::deserialize(deserializer)? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(D::Error::custom(format!("{other} is neither 0 nor 1"))),
        }
    }

    fn value(&self) -> Option<CellValue<'_>> {
        Some(CellValue::Flag(*self))
    }
}

impl Cell for RowHash {
    const KIND: CellKind = CellKind::Hash;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let digits = String::deserialize(deserializer)?;
        let hash = parse_hash(&digits)
            .ok_or_else(|| D::Error::custom(format!("'{digits}' is not 16 hexadecimal digits")))?;
        Ok(Self(hash))
    }

    fn value(&self) -> Option<CellValue<'_>> {
        Some(CellValue::Hash(self.0))
    }
}

/// Parses a hash of ticks.csv.
pub(super) fn parse_hash(digits: &str) -> Option<u64> {
    let hash = u64::from_str_radix(digits, 16).ok()?;
    (digits.len() == 16).then_some(hash)
}

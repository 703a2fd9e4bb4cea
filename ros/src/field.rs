//! Values of fields: their types and their encoding.

use crate::cdr::CdrWriter;
use crate::description::{BaseType, FieldType, Shape};
use crate::read::{CdrReader, ReadError};

/// A value that a field of a message can contain.
pub trait Field: Sized {
    /// The type of the field.
    const TYPE: FieldType;

    /// Appends the value in CDR.
    fn write(&self, to: &mut CdrWriter);

    /// Reads a value in CDR.
    ///
    /// # Errors
    /// Returns an error if the bytes contain no such value.
    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError>;
}

/// A field type that sequences and arrays can contain.
pub trait Element: Field {}

/// An octet that is not a number: the type `byte`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Byte(pub u8);

macro_rules! numbers {
    ($($type:ty: $base:ident;)+) => {$(
        impl Field for $type {
            const TYPE: FieldType = FieldType { base: BaseType::$base, shape: Shape::Single };

            fn write(&self, to: &mut CdrWriter) {
                to.put(self.to_le_bytes());
            }

            fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
                from.take().map(<$type>::from_le_bytes)
            }
        }

        impl Element for $type {}
    )+};
}

numbers! {
    i8: Int8;
    u8: Uint8;
    i32: Int32;
    u32: Uint32;
    f32: Float32;
    f64: Float64;
}

impl Field for bool {
    const TYPE: FieldType = FieldType {
        base: BaseType::Bool,
        shape: Shape::Single,
    };

    fn write(&self, to: &mut CdrWriter) {
        to.put([u8::from(*self)]);
    }

    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
        match from.take()? {
            [0] => Ok(false),
            [1] => Ok(true),
            _ => Err(ReadError::Bool),
        }
    }
}

impl Field for Byte {
    const TYPE: FieldType = FieldType {
        base: BaseType::Byte,
        shape: Shape::Single,
    };

    fn write(&self, to: &mut CdrWriter) {
        to.put([self.0]);
    }

    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
        from.take().map(|[octet]| Self(octet))
    }
}

impl Field for String {
    const TYPE: FieldType = FieldType {
        base: BaseType::String,
        shape: Shape::Single,
    };

    fn write(&self, to: &mut CdrWriter) {
        to.put_text(self);
    }

    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
        from.take_text()
    }
}

impl Element for String {}

impl<T: Element> Field for Vec<T> {
    const TYPE: FieldType = FieldType {
        base: T::TYPE.base,
        shape: Shape::Sequence,
    };

    fn write(&self, to: &mut CdrWriter) {
        to.put_length(self.len());
        for value in self {
            value.write(to);
        }
    }

    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
        // The length is not trusted with memory: each value takes a byte at least, so a false length ends the bytes.
        let length = from.take_length()?;
        let mut values = Self::new();
        for _ in 0..length {
            values.push(T::read(from)?);
        }
        Ok(values)
    }
}

impl<T: Element, const N: usize> Field for [T; N] {
    const TYPE: FieldType = FieldType {
        base: T::TYPE.base,
        shape: Shape::Array(N),
    };

    fn write(&self, to: &mut CdrWriter) {
        for value in self {
            value.write(to);
        }
    }

    fn read(from: &mut CdrReader<'_>) -> Result<Self, ReadError> {
        let mut values = Vec::with_capacity(N);
        for _ in 0..N {
            values.push(T::read(from)?);
        }
        // The list has N values.
        Self::try_from(values).map_err(|_| ReadError::End)
    }
}

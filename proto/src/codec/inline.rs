//! An inline serializer for the format of bincode. Every tick of a run encodes and hashes all readings and reports, and
//! bincode's own serializer is called for every field. The tests compare both encoders byte by byte.
//!
//! The format (bincode 2, standard configuration):
//!
//! - Floats and bytes: unchanged, in little-endian order.
//! - Unsigned integers wider than a byte, lengths and variant numbers: one byte up to 250. For larger values, a byte
//!   with the width precedes the bytes of the value.
//! - Signed integers: as unsigned integers after zigzag encoding.
//! - Options: a byte, and the value if there is one.
//! - Structs and tuples: their fields in order.

use std::fmt::Display;

use serde::ser::{self, Serialize};

/// A value that cannot be encoded.
#[derive(Debug, thiserror::Error)]
pub(super) enum Refused {
    /// A list without a known length.
    #[error("a sequence of unknown length")]
    UnknownLength,
    /// The value reports an error. The box keeps the result of each field small.
    #[error("{0}")]
    Other(Box<str>),
}

impl ser::Error for Refused {
    fn custom<T: Display>(reason: T) -> Self {
        Self::Other(reason.to_string().into())
    }
}

/// A serializer into a buffer of fixed size. Bytes beyond its end are only counted; the caller then repeats the call
/// with a larger buffer. A field thus costs a comparison and no call.
pub(super) struct Encoder<'a> {
    place: &'a mut [u8],
    /// The length of the encoding so far, bytes.
    length: usize,
}

/// The largest number that takes one byte.
const ONE_BYTE_MAX: u8 = 250;

impl<'a> Encoder<'a> {
    #[inline(always)]
    pub fn new(place: &'a mut [u8]) -> Self {
        Self { place, length: 0 }
    }

    /// Returns the length of the encoding, bytes, including bytes that did not fit.
    #[inline(always)]
    pub fn length(&self) -> usize {
        self.length
    }

    #[inline(always)]
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        let end = self.length + N;
        if let Some(place) = self.place.get_mut(self.length..end) {
            place.copy_from_slice(&bytes);
        }
        self.length = end;
    }

    fn put_all(&mut self, bytes: &[u8]) {
        let end = self.length + bytes.len();
        if let Some(place) = self.place.get_mut(self.length..end) {
            place.copy_from_slice(bytes);
        }
        self.length = end;
    }

    #[inline(always)]
    pub fn unsigned(&mut self, value: u64) {
        if value <= u64::from(ONE_BYTE_MAX) {
            self.put([value as u8]);
        } else {
            self.wide(value);
        }
    }

    #[inline]
    fn wide(&mut self, value: u64) {
        // A single write of prefix and value.
        let [a, b, c, d, ..] = value.to_le_bytes();
        if value <= u64::from(u16::MAX) {
            self.put([ONE_BYTE_MAX + 1, a, b]);
        } else if value <= u64::from(u32::MAX) {
            self.put([ONE_BYTE_MAX + 2, a, b, c, d]);
        } else {
            self.put([ONE_BYTE_MAX + 3]);
            self.put(value.to_le_bytes());
        }
    }

    fn signed(&mut self, value: i64) {
        self.unsigned(((value << 1) ^ (value >> 63)) as u64);
    }

    #[inline(always)]
    fn count(&mut self, length: Option<usize>) -> Result<(), Refused> {
        self.unsigned(length.ok_or(Refused::UnknownLength)? as u64);
        Ok(())
    }
}

type Done = Result<(), Refused>;

impl ser::Serializer for &mut Encoder<'_> {
    type Ok = ();
    type Error = Refused;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Self;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    #[inline(always)]
    fn is_human_readable(&self) -> bool {
        false
    }

    #[inline(always)]
    fn serialize_bool(self, value: bool) -> Done {
        self.put([u8::from(value)]);
        Ok(())
    }

    #[inline(always)]
    fn serialize_u8(self, value: u8) -> Done {
        self.put([value]);
        Ok(())
    }

    #[inline(always)]
    fn serialize_u16(self, value: u16) -> Done {
        self.unsigned(value.into());
        Ok(())
    }

    #[inline(always)]
    fn serialize_u32(self, value: u32) -> Done {
        self.unsigned(value.into());
        Ok(())
    }

    #[inline(always)]
    fn serialize_u64(self, value: u64) -> Done {
        self.unsigned(value);
        Ok(())
    }

    fn serialize_i8(self, value: i8) -> Done {
        self.put(value.to_le_bytes());
        Ok(())
    }

    fn serialize_i16(self, value: i16) -> Done {
        self.signed(value.into());
        Ok(())
    }

    fn serialize_i32(self, value: i32) -> Done {
        self.signed(value.into());
        Ok(())
    }

    fn serialize_i64(self, value: i64) -> Done {
        self.signed(value);
        Ok(())
    }

    fn serialize_u128(self, value: u128) -> Done {
        match u64::try_from(value) {
            Ok(value) => self.unsigned(value),
            Err(_) => {
                self.put([ONE_BYTE_MAX + 4]);
                self.put(value.to_le_bytes());
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn serialize_f32(self, value: f32) -> Done {
        self.put(value.to_le_bytes());
        Ok(())
    }

    #[inline(always)]
    fn serialize_f64(self, value: f64) -> Done {
        self.put(value.to_le_bytes());
        Ok(())
    }

    fn serialize_char(self, value: char) -> Done {
        let mut utf8 = [0; 4];
        self.put_all(value.encode_utf8(&mut utf8).as_bytes());
        Ok(())
    }

    fn serialize_str(self, value: &str) -> Done {
        self.serialize_bytes(value.as_bytes())
    }

    fn serialize_bytes(self, value: &[u8]) -> Done {
        self.unsigned(value.len() as u64);
        self.put_all(value);
        Ok(())
    }

    #[inline(always)]
    fn serialize_none(self) -> Done {
        self.put([0]);
        Ok(())
    }

    #[inline(always)]
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Done {
        self.put([1]);
        value.serialize(self)
    }

    #[inline(always)]
    fn serialize_unit(self) -> Done {
        Ok(())
    }

    #[inline(always)]
    fn serialize_unit_struct(self, _name: &'static str) -> Done {
        Ok(())
    }

    #[inline(always)]
    fn serialize_unit_variant(
        self,
        _name: &'static str,
        index: u32,
        _variant: &'static str,
    ) -> Done {
        self.unsigned(index.into());
        Ok(())
    }

    #[inline(always)]
    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _name: &'static str,
        value: &T,
    ) -> Done {
        value.serialize(self)
    }

    #[inline(always)]
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _name: &'static str,
        index: u32,
        _variant: &'static str,
        value: &T,
    ) -> Done {
        self.unsigned(index.into());
        value.serialize(self)
    }

    #[inline(always)]
    fn serialize_seq(self, length: Option<usize>) -> Result<Self, Refused> {
        self.count(length)?;
        Ok(self)
    }

    #[inline(always)]
    fn serialize_tuple(self, _length: usize) -> Result<Self, Refused> {
        Ok(self)
    }

    #[inline(always)]
    fn serialize_tuple_struct(self, _name: &'static str, _length: usize) -> Result<Self, Refused> {
        Ok(self)
    }

    #[inline(always)]
    fn serialize_tuple_variant(
        self,
        _name: &'static str,
        index: u32,
        _variant: &'static str,
        _length: usize,
    ) -> Result<Self, Refused> {
        self.unsigned(index.into());
        Ok(self)
    }

    fn serialize_map(self, length: Option<usize>) -> Result<Self, Refused> {
        self.count(length)?;
        Ok(self)
    }

    #[inline(always)]
    fn serialize_struct(self, _name: &'static str, _length: usize) -> Result<Self, Refused> {
        Ok(self)
    }

    #[inline(always)]
    fn serialize_struct_variant(
        self,
        _name: &'static str,
        index: u32,
        _variant: &'static str,
        _length: usize,
    ) -> Result<Self, Refused> {
        self.unsigned(index.into());
        Ok(self)
    }
}

/// Implements a compound serializer that encodes its parts one after the other.
macro_rules! parts {
    ($trait:ident, $part:ident $(, $name:ident)?) => {
        impl ser::$trait for &mut Encoder<'_> {
            type Ok = ();
            type Error = Refused;

            #[inline(always)]
            fn $part<T: Serialize + ?Sized>(&mut self, $($name: &'static str,)? part: &T) -> Done {
                part.serialize(&mut **self)
            }

            #[inline(always)]
            fn end(self) -> Done {
                Ok(())
            }
        }
    };
}

parts!(SerializeSeq, serialize_element);
parts!(SerializeTuple, serialize_element);
parts!(SerializeTupleStruct, serialize_field);
parts!(SerializeTupleVariant, serialize_field);
parts!(SerializeStruct, serialize_field, _name);
parts!(SerializeStructVariant, serialize_field, _name);

impl ser::SerializeMap for &mut Encoder<'_> {
    type Ok = ();
    type Error = Refused;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Done {
        key.serialize(&mut **self)
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Done {
        value.serialize(&mut **self)
    }

    fn end(self) -> Done {
        Ok(())
    }
}

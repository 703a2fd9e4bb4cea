//! Random values of any type of the bus or the log. The type's own deserialization determines its shape, so new fields
//! and variants take part without further code.

use std::fmt;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::de::value::U32Deserializer;
use serde::de::{
    self, DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, IntoDeserializer, SeqAccess,
    VariantAccess, Visitor,
};

/// The largest number of elements of a list. Every fixed-capacity list has room for them.
const MOST: usize = 3;

/// The largest number of elements of a list in a value without bounds.
const MOST_UNBOUNDED: usize = 60;

/// Returns the value of a seed, without NaN, which does not equal itself. Draws that the type refuses, such as a text in
/// a wrong form, are repeated.
#[must_use]
pub fn drawn<T: DeserializeOwned>(seed: u64) -> T {
    draw(seed, false)
}

/// Returns the value of a seed like [`drawn`], also with NaN and with long lists: anything that the type allows.
#[must_use]
pub fn drawn_unbounded<T: DeserializeOwned>(seed: u64) -> T {
    draw(seed, true)
}

fn draw<T: DeserializeOwned>(seed: u64, is_unbounded: bool) -> T {
    let mut draw = Draw {
        rng: ChaCha8Rng::seed_from_u64(seed),
        is_unbounded,
    };
    loop {
        if let Ok(value) = T::deserialize(&mut draw) {
            return value;
        }
    }
}

/// A source of random values in place of bytes.
struct Draw {
    rng: ChaCha8Rng,
    /// True for values with NaN and long lists.
    is_unbounded: bool,
}

#[derive(Debug)]
struct Refused;

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("refused")
    }
}

impl std::error::Error for Refused {}

impl de::Error for Refused {
    fn custom<T: fmt::Display>(_: T) -> Self {
        Self
    }
}

impl Draw {
    fn below(&mut self, count: usize) -> usize {
        (self.rng.next_u64() % count as u64) as usize
    }

    /// Draws a small whole number, or one of any magnitude.
    fn bits(&mut self) -> u128 {
        if self.below(2) == 0 {
            return self.below(4) as u128;
        }
        let (high, low) = (self.rng.next_u64(), self.rng.next_u64());
        ((u128::from(high) << 64) | u128::from(low)) >> self.below(128)
    }

    /// Draws any number, NaN only without bounds.
    fn real(&mut self) -> f64 {
        match self.below(8) {
            4 if self.is_unbounded => f64::NAN,
            0 => 0.0,
            1 => -0.0,
            2 => f64::INFINITY,
            3 => f64::MIN_POSITIVE / 4.0,
            _ => f64::from(self.rng.next_u32() as i32) * 10_f64.powi(self.below(30) as i32 - 20),
        }
    }

    /// Draws the length of a list.
    fn length(&mut self) -> usize {
        let most = match self.is_unbounded && self.below(4) == 0 {
            true => MOST_UNBOUNDED,
            false => MOST,
        };
        self.below(most + 1)
    }

    fn text(&mut self) -> String {
        let letters = ['a', 'Z', '-', ' ', '\n', 'ü', '\u{1F916}'];
        let length = self.below(6);
        (0..length)
            .map(|_| letters[self.below(letters.len())])
            .collect()
    }

    fn elements(&mut self, left: usize) -> Elements<'_> {
        Elements { draw: self, left }
    }
}

/// Implements functions of a [`Deserializer`] that visit a single drawn value.
macro_rules! drawn_values {
    ($($name:ident: $visit:ident = $draw:expr;)*) => {
        $(fn $name<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
            let draw: fn(&mut Draw) -> _ = $draw;
            visitor.$visit(draw(self))
        })*
    };
}

impl<'de> Deserializer<'de> for &mut Draw {
    type Error = Refused;

    drawn_values! {
        deserialize_bool: visit_bool = |draw| draw.below(2) == 1;
        deserialize_u8: visit_u8 = |draw| draw.bits() as u8;
        deserialize_u16: visit_u16 = |draw| draw.bits() as u16;
        deserialize_u32: visit_u32 = |draw| draw.bits() as u32;
        deserialize_u64: visit_u64 = |draw| draw.bits() as u64;
        deserialize_u128: visit_u128 = |draw| draw.bits();
        deserialize_i8: visit_i8 = |draw| draw.bits() as i8;
        deserialize_i16: visit_i16 = |draw| draw.bits() as i16;
        deserialize_i32: visit_i32 = |draw| draw.bits() as i32;
        deserialize_i64: visit_i64 = |draw| draw.bits() as i64;
        deserialize_f32: visit_f32 = |draw| draw.real() as f32;
        deserialize_f64: visit_f64 = |draw| draw.real();
        deserialize_char: visit_char = |draw| draw.text().chars().next().unwrap_or('x');
        deserialize_string: visit_string = |draw| draw.text();
        deserialize_str: visit_string = |draw| draw.text();
        deserialize_byte_buf: visit_byte_buf = |draw| draw.text().into_bytes();
        deserialize_bytes: visit_byte_buf = |draw| draw.text().into_bytes();
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Refused> {
        unreachable!("the bus has no self-describing types")
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        if self.below(2) == 1 {
            visitor.visit_some(self)
        } else {
            visitor.visit_none()
        }
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        let length = self.length();
        visitor.visit_seq(self.elements(length))
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_seq(self.elements(length))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_seq(self.elements(length))
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        let length = self.length();
        visitor.visit_map(self.elements(length))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_seq(self.elements(fields.len()))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        let variant = self.below(variants.len()) as u32;
        visitor.visit_enum(Variant {
            draw: self,
            variant,
        })
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Refused> {
        unreachable!("the bus has no names of fields")
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Refused> {
        self.deserialize_any(visitor)
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// The elements of a list, the entries of a map, or the fields of a struct.
struct Elements<'d> {
    draw: &'d mut Draw,
    left: usize,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = Refused;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Refused> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(&mut *self.draw).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.left)
    }
}

impl<'de> de::MapAccess<'de> for Elements<'_> {
    type Error = Refused;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Refused> {
        self.next_element_seed(seed)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Refused> {
        seed.deserialize(&mut *self.draw)
    }
}

/// A variant of an enum with its content.
struct Variant<'d> {
    draw: &'d mut Draw,
    variant: u32,
}

impl<'de, 'd> EnumAccess<'de> for Variant<'d> {
    type Error = Refused;
    type Variant = &'d mut Draw;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Self::Variant), Refused> {
        let index: U32Deserializer<Refused> = self.variant.into_deserializer();
        Ok((seed.deserialize(index)?, self.draw))
    }
}

impl<'de> VariantAccess<'de> for &mut Draw {
    type Error = Refused;

    fn unit_variant(self) -> Result<(), Refused> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Refused> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_seq(self.elements(length))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Refused> {
        visitor.visit_seq(self.elements(fields.len()))
    }
}

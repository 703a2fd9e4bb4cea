//! Deserialization of TOML values. Errors use the terms of the file and contain the path to the value.

use std::fmt;
use std::iter::Enumerate;
use std::slice::Iter;

use serde::de::value::{BorrowedStrDeserializer, MapAccessDeserializer, StrDeserializer};
use serde::de::{self, DeserializeSeed, Deserializer, Error, Expected, Unexpected, Visitor};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{Problem, name_remedy};
use super::path::PathStep;

/// The problem with a key that its table does not have.
const UNKNOWN_KEY: &str = "unknown key";

impl Error for Problem {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::of_value(message.to_string(), "see the reference scenario")
    }

    fn invalid_type(found: Unexpected<'_>, wanted: &dyn Expected) -> Self {
        if found == Unexpected::UnitVariant {
            return Self::of_value("the choice needs a value", "write { CHOICE = VALUE }");
        }
        let found = match found {
            Unexpected::Bool(value) => value.to_string(),
            Unexpected::Unsigned(value) => value.to_string(),
            Unexpected::Signed(value) => value.to_string(),
            Unexpected::Float(value) => format!("{value:?}"),
            Unexpected::Str(value) => format!("the string '{value}'"),
            Unexpected::Seq => "an array".to_owned(),
            Unexpected::Map => "a table".to_owned(),
            other => other.to_string(),
        };
        let remedy = format!("write {}", type_in_file_terms(wanted));
        Self::of_value(format!("{found} does not fit"), remedy)
    }

    fn invalid_value(found: Unexpected<'_>, wanted: &dyn Expected) -> Self {
        Self::invalid_type(found, wanted)
    }

    fn unknown_variant(name: &str, known: &'static [&'static str]) -> Self {
        let what = format!("there is no choice '{name}'");
        let remedy = name_remedy(name, known.iter().copied());
        Self::of_value(what, remedy)
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        let remedy = name_remedy(name, known.iter().copied());
        Self::of_value(UNKNOWN_KEY, remedy)
    }

    fn missing_field(name: &'static str) -> Self {
        Self::at([name], "the key is missing", "give it a value")
    }
}

/// Returns the name of a type in the terms of a file.
fn type_in_file_terms(wanted: &dyn Expected) -> String {
    let wanted = wanted.to_string();
    match wanted.as_str() {
        "a boolean" => "true or false".to_owned(),
        "u32" => format!("a whole number from 0 to {}", u32::MAX),
        "u64" => "a whole number that is not negative".to_owned(),
        "i32" => format!("a whole number from {} to {}", i32::MIN, i32::MAX),
        "f32" | "f64" => "a number".to_owned(),
        "a string" => "a string in quotes".to_owned(),
        "a sequence" => "an array".to_owned(),
        "unit" => "the choice alone, as a string in quotes".to_owned(),
        _ if wanted == "a map" || wanted.starts_with("struct ") => "a table".to_owned(),
        _ => wanted,
    }
}

/// A deserializer for a value of a file.
#[derive(Clone, Copy)]
pub(super) struct TomlValue<'de>(pub &'de DeValue<'de>);

impl<'de> Deserializer<'de> for TomlValue<'de> {
    type Error = Problem;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Problem> {
        match self.0 {
            DeValue::Boolean(value) => visitor.visit_bool(*value),
            DeValue::String(value) => visitor.visit_borrowed_str(value),
            DeValue::Integer(value) => {
                let parsed = i64::from_str_radix(value.as_str(), value.radix());
                match parsed {
                    Ok(value) => visitor.visit_i64(value),
                    Err(_) => Err(Problem::of_value(
                        format!("{value} is out of range"),
                        format!("write a whole number from {} to {}", i64::MIN, i64::MAX),
                    )),
                }
            }
            DeValue::Float(value) => match value.as_str().parse() {
                Ok(value) => visitor.visit_f64(value),
                Err(_) => Err(Problem::of_value(
                    format!("'{value}' is not a number"),
                    "write a number",
                )),
            },
            DeValue::Datetime(value) => Err(Problem::of_value(
                format!("the date or time {value} does not fit"),
                "no key of a scenario accepts one",
            )),
            DeValue::Array(array) => visitor.visit_seq(Elements(array.iter().enumerate())),
            DeValue::Table(table) => visitor.visit_map(entries(table, &[])),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Problem> {
        visitor.visit_some(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Problem> {
        match self.0 {
            // The elements would be the values of the fields in order.
            DeValue::Array(_) => Err(Problem::of_value(
                "an array does not fit",
                "write a table, such as [name] instead of [[name]]",
            )),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Problem> {
        match self.0 {
            DeValue::String(name) => visitor.visit_enum(StrDeserializer::new(name)),
            DeValue::Table(table) if table.len() == 1 => {
                visitor.visit_enum(MapAccessDeserializer::new(entries(table, &[])))
            }
            other => Err(Problem::of_value(
                format!("the {} does not fit", other.type_str()),
                format!("write one of {}", variants.join(", ")),
            )),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf unit unit_struct newtype_struct seq
        tuple tuple_struct map identifier ignored_any
    }
}

/// A deserializer for a table whose reader adds or removes entries.
#[derive(Clone, Copy)]
pub(super) struct EditedTable<'de> {
    pub table: &'de DeTable<'de>,
    /// Entries that are read elsewhere.
    pub left_out: &'de [&'de str],
    /// Further keys that the file may state, for the remedy of an unknown key.
    pub others: &'de [&'de str],
    /// Keys that the reader adds and the file may not state.
    pub implied: &'de [&'de str],
}

impl<'de> Deserializer<'de> for EditedTable<'de> {
    type Error = Problem;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Problem> {
        visitor.visit_map(entries(self.table, self.left_out))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Problem> {
        let read = self.deserialize_any(visitor);
        read.map_err(|problem| match problem.place.key.0.as_slice() {
            [PathStep::Key(key)] if problem.problem == UNKNOWN_KEY => {
                let known = fields.iter().chain(self.others).copied();
                let known = known.filter(|known| !self.implied.contains(known));
                Problem::at([key.as_str()], UNKNOWN_KEY, name_remedy(key, known))
            }
            _ => problem,
        })
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 u8 u16 u32 u64 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct seq
        tuple tuple_struct map enum identifier ignored_any
    }
}

struct Elements<'de>(Enumerate<Iter<'de, Spanned<DeValue<'de>>>>);

impl<'de> de::SeqAccess<'de> for Elements<'de> {
    type Error = Problem;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Problem> {
        let element = self.0.next().map(|(index, element)| {
            seed.deserialize(TomlValue(element.get_ref()))
                .map_err(|problem| problem.under(PathStep::Index(index)))
        });
        element.transpose()
    }
}

/// The entries of a table. `next` is the entry whose key has been read and whose value has not.
struct Entries<'de, I> {
    rest: I,
    next: Option<(&'de str, &'de DeValue<'de>)>,
}

fn entries<'de>(
    table: &'de DeTable<'de>,
    left_out: &'de [&'de str],
) -> Entries<'de, impl Iterator<Item = (&'de str, &'de DeValue<'de>)>> {
    Entries {
        rest: table
            .iter()
            .map(|(key, value)| (key.get_ref().as_ref(), value.get_ref()))
            .filter(move |(key, _)| !left_out.contains(key)),
        next: None,
    }
}

impl<'de, I> de::MapAccess<'de> for Entries<'de, I>
where
    I: Iterator<Item = (&'de str, &'de DeValue<'de>)>,
{
    type Error = Problem;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Problem> {
        self.next = self.rest.next();
        let key = self.next.map(|(key, _)| {
            seed.deserialize(BorrowedStrDeserializer::new(key))
                .map_err(|problem: Problem| problem.under([key]))
        });
        key.transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Problem> {
        let (key, value) = self
            .next
            .take()
            .ok_or_else(|| Problem::custom("a value was requested before its key"))?;
        seed.deserialize(TomlValue(value))
            .map_err(|problem| problem.under([key]))
    }
}

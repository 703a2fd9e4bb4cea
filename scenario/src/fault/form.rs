//! Serialization of a fault in files: a table with the fault's name as its only key. A name that is not common belongs
//! to a mission.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};

use super::{Fault, FaultValue, MissionFault};

impl Serialize for Fault {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Mission(fault) if serializer.is_human_readable() => {
                let mut map = serializer.serialize_map(Some(1))?;
                map.serialize_entry(&fault.name, &Values(&fault.values))?;
                map.end()
            }
            // The derived implementation serializes all other cases.
            _ => Self::serialize(self, serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Fault {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            deserializer.deserialize_map(FaultVisitor)
        } else {
            // The derived implementation reads the binary form.
            Self::deserialize(deserializer)
        }
    }
}

/// The values of a mission's fault, by key.
struct Values<'a>(&'a BTreeMap<String, FaultValue>);

impl Serialize for Values<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (key, value) in self.0 {
            match value {
                // Whole numbers are written as integers.
                FaultValue::Number(number) if number.fract() == 0.0 && number.abs() < 1e9 => {
                    map.serialize_entry(key, &(*number as i64))?;
                }
                FaultValue::Number(number) => map.serialize_entry(key, number)?,
                FaultValue::Name(name) => map.serialize_entry(key, name)?,
            }
        }
        map.end()
    }
}

/// The values of a fault that is not common. `None` if the file contains a string, as for many common faults.
struct StatedValues(Option<BTreeMap<String, FaultValue>>);

/// A value in a file: a number or a name.
struct StatedValue(FaultValue);

impl<'de> Deserialize<'de> for StatedValue {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ValueVisitor;

        impl Visitor<'_> for ValueVisitor {
            type Value = StatedValue;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a name")
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<StatedValue, E> {
                Ok(StatedValue(FaultValue::Number(number)))
            }

            fn visit_i64<E: Error>(self, number: i64) -> Result<StatedValue, E> {
                self.visit_f64(number as f64)
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<StatedValue, E> {
                self.visit_f64(number as f64)
            }

            fn visit_str<E: Error>(self, name: &str) -> Result<StatedValue, E> {
                Ok(StatedValue(FaultValue::Name(name.to_owned())))
            }
        }

        deserializer.deserialize_any(ValueVisitor)
    }
}

impl<'de> Deserialize<'de> for StatedValues {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ValuesVisitor;

        impl<'de> Visitor<'de> for ValuesVisitor {
            type Value = StatedValues;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of numbers and names")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<StatedValues, A::Error> {
                let mut values = BTreeMap::new();
                while let Some((key, StatedValue(value))) = map.next_entry()? {
                    values.insert(key, value);
                }
                Ok(StatedValues(Some(values)))
            }

            fn visit_str<E: Error>(self, _: &str) -> Result<StatedValues, E> {
                Ok(StatedValues(None))
            }
        }

        deserializer.deserialize_any(ValuesVisitor)
    }
}

/// The visitor that reads the table of a fault.
struct FaultVisitor;

impl<'de> Visitor<'de> for FaultVisitor {
    type Value = Fault;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a fault by its name")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Fault, A::Error> {
        let wrong_form = || A::Error::custom("a fault is a table with a single key, its name");
        let name: String = map.next_key()?.ok_or_else(wrong_form)?;
        let fault = if Fault::COMMON_NAMES.contains(&name.as_str()) {
            // The derived implementation reads common faults.
            let variant = Variant {
                name: Some(name),
                map: &mut map,
            };
            Fault::deserialize(MapAccessDeserializer::new(variant))?
        } else {
            let StatedValues(values) = map.next_value()?;
            let unknown = || A::Error::unknown_variant(&name, &Fault::COMMON_NAMES);
            let values = values.ok_or_else(unknown)?;
            Fault::Mission(MissionFault { name, values })
        };
        match map.next_key::<String>()? {
            None => Ok(fault),
            Some(_) => Err(wrong_form()),
        }
    }
}

/// A map whose key, the name of a fault, has been read and whose value comes next.
struct Variant<'m, A> {
    name: Option<String>,
    map: &'m mut A,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for Variant<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, A::Error> {
        let name = self.name.take().map(String::into_deserializer);
        name.map(|name| seed.deserialize(name)).transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.map.next_value_seed(seed)
    }
}

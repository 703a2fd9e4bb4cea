//! The seeds of a plan: a list or a range.

use std::fmt;

use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::MAX_RUNS;

#[derive(Clone, Debug, PartialEq)]
pub struct Seeds(pub Vec<i64>);

impl Default for Seeds {
    fn default() -> Self {
        Self(vec![1])
    }
}

impl<'de> Deserialize<'de> for Seeds {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct FromTo {
            from: i64,
            to: i64,
        }
        struct Form;
        impl Form {
            fn range<E: Error>(from: i64, to: i64) -> Result<Seeds, E> {
                // The bound also limits the number of runs.
                if 0 <= from && from <= to && to - from < MAX_RUNS as i64 {
                    Ok(Seeds((from..=to).collect()))
                } else {
                    Err(E::custom(format!(
                        "the range of seeds {from} to {to} is empty, negative or too long"
                    )))
                }
            }
        }
        impl<'de> Visitor<'de> for Form {
            type Value = Seeds;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of seeds, { from = …, to = … }, or a list of seeds")
            }
            fn visit_i64<E: Error>(self, count: i64) -> Result<Seeds, E> {
                Self::range(1, count)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Seeds, A::Error> {
                let mut seeds = Vec::new();
                while let Some(seed) = sequence.next_element()? {
                    Self::range::<A::Error>(seed, seed)?;
                    seeds.push(seed);
                }
                Ok(Seeds(seeds))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Seeds, A::Error> {
                let FromTo { from, to } = FromTo::deserialize(MapAccessDeserializer::new(map))?;
                Self::range(from, to)
            }
        }
        deserializer.deserialize_any(Form)
    }
}

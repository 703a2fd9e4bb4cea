//! What a mission puts on the bus and into the log: [`Sensed`] by devices that only it has, a [`Deed`] that only it knows, the
//! [`Lore`] that heartbeats repeat, the [`Payload`] of its bulletins, and its [`MissionFigures`]. What it is in scenarios and
//! files is [`data`]'s; what it tells of itself in mission.csv [`columns`]'.
//!
//! A mission that is known here has a typed place; any other one encodes its own types into [`Bytes`].

pub mod columns;
pub mod data;
mod figures;
pub mod items;
pub mod known;
pub mod prelude;
pub mod promises;
pub mod section;

use std::fmt;

use serde::de::{DeserializeOwned, Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::codec::{self, CodecError};
use items::{ItemsBulletin, ItemsDeed, ItemsSensed, Knowledge};

pub use figures::{MissionFigures, Target, TeamFigures, Value};

/// Most bytes of what an open mission's devices tell a robot in a step.
pub const SENSED_MAX: usize = 160;

/// Most bytes of a deed of an open mission.
pub const DEED_MAX: usize = 32;

/// Most bytes of what a robot of an open mission knows, and of a bulletin of it.
pub const LORE_MAX: usize = 600;

/// What the devices of a mission tell a robot in a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sensed {
    /// Nothing.
    #[default]
    Nothing,
    /// Of [`items`].
    Items(ItemsSensed),
    /// In any other mission: the encoding of a type of its own; elsewhere, for a robot's readings are to lie close together.
    Open(Box<Bytes<SENSED_MAX>>),
}

impl Sensed {
    /// What the devices for [`items`] tell: nothing in a mission without them.
    #[inline]
    #[must_use]
    pub fn items(&self) -> &ItemsSensed {
        const NOTHING: &ItemsSensed = &ItemsSensed::NOTHING;
        match self {
            Self::Items(sensed) => sensed,
            Self::Nothing | Self::Open(_) => NOTHING,
        }
    }

    /// The same, to be written to.
    #[inline]
    pub fn items_mut(&mut self) -> &mut ItemsSensed {
        if !matches!(self, Self::Items(_)) {
            *self = Self::Items(ItemsSensed::NOTHING);
        }
        let Self::Items(sensed) = self else {
            unreachable!("it has just been made so")
        };
        sensed
    }
}

/// What a robot does in a step beside driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Deed {
    /// Nothing.
    #[default]
    Nothing,
    /// Of [`items`].
    Items(ItemsDeed),
    /// In any other mission: the encoding of a type of its own.
    Open(Bytes<DEED_MAX>),
}

impl Deed {
    /// What it means with [`items`].
    #[inline]
    #[must_use]
    pub fn items(&self) -> ItemsDeed {
        match self {
            Self::Items(deed) => *deed,
            Self::Nothing | Self::Open(_) => ItemsDeed::default(),
        }
    }
}

/// What a robot knows of its mission; every heartbeat repeats it, so that lost messages and newcomers are no special case.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Lore {
    /// Nothing.
    #[default]
    Nothing,
    /// Of [`items`].
    Items(Knowledge),
    /// In any other mission: the encoding of a type of its own, [`LORE_MAX`] bytes at most.
    Open(#[serde(deserialize_with = "at_most_lore")] Vec<u8>),
}

/// What a bulletin of a mission says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Payload {
    /// Of [`items`].
    Items(ItemsBulletin),
    /// In any other mission: the encoding of a type of its own, [`LORE_MAX`] bytes at most.
    Open(#[serde(deserialize_with = "at_most_lore")] Vec<u8>),
}

fn at_most_lore<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
    let bytes = Vec::deserialize(deserializer)?;
    if bytes.len() > LORE_MAX {
        let expected = format!("at most {LORE_MAX} bytes");
        return Err(D::Error::invalid_length(bytes.len(), &expected.as_str()));
    }
    Ok(bytes)
}

/// A few bytes in place: a step that hands them on does not allocate.
#[derive(Clone, Copy)]
pub struct Bytes<const N: usize> {
    length: u8,
    /// Zeros from `length` on.
    bytes: [u8; N],
}

impl<const N: usize> Bytes<N> {
    /// The encoding of a value.
    ///
    /// # Errors
    /// [`CodecError::TooLarge`] above `N` bytes.
    pub fn encode<T: Serialize>(value: &T) -> Result<Self, CodecError> {
        let mut new = Self::default();
        let length = codec::encode_to_slice(value, &mut new.bytes)?;
        new.length = u8::try_from(length)
            .ok()
            .filter(|_| length <= N)
            .ok_or(CodecError::TooLarge(length))?;
        Ok(new)
    }

    /// The value whose encoding they are.
    ///
    /// # Errors
    /// See [`codec::decode`].
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, CodecError> {
        codec::decode(self.as_slice())
    }

    /// The bytes.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }

    /// Those bytes, whatever they mean; `None` above `N` of them.
    #[must_use]
    pub fn copied(bytes: &[u8]) -> Option<Self> {
        let mut new = Self::default();
        new.bytes.get_mut(..bytes.len())?.copy_from_slice(bytes);
        new.length = u8::try_from(bytes.len()).ok()?;
        Some(new)
    }
}

impl<const N: usize> Default for Bytes<N> {
    fn default() -> Self {
        Self {
            length: 0,
            bytes: [0; N],
        }
    }
}

impl<const N: usize> PartialEq for Bytes<N> {
    fn eq(&self, other: &Self) -> bool {
        self.as_slice() == other.as_slice()
    }
}

impl<const N: usize> fmt::Debug for Bytes<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.as_slice().fmt(f)
    }
}

impl<const N: usize> Serialize for Bytes<N> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(self.as_slice())
    }
}

impl<'de, const N: usize> Deserialize<'de> for Bytes<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AtMost<const N: usize>;

        impl<'de, const N: usize> Visitor<'de> for AtMost<N> {
            type Value = Bytes<N>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "at most {N} bytes")
            }

            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Self::Value, E> {
                Bytes::copied(bytes).ok_or_else(|| E::invalid_length(bytes.len(), &self))
            }

            // As JSON has them.
            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut bytes = Vec::new();
                while let Some(byte) = list.next_element()? {
                    bytes.push(byte);
                }
                self.visit_bytes(&bytes)
            }
        }

        deserializer.deserialize_bytes(AtMost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_comes_back_and_what_does_not_is_refused() {
        let value = (7_u32, "point".to_owned(), Some(0.5_f32));
        let bytes = Bytes::<32>::encode(&value).unwrap();
        assert_eq!(bytes.decode::<(u32, String, Option<f32>)>().unwrap(), value);
        assert!(bytes.decode::<(u32, u32)>().is_err());
        assert!(Bytes::<8>::encode(&value).is_err());
    }

    #[test]
    fn they_cross_the_bus_within_their_bounds() {
        let bytes = Bytes::<DEED_MAX>::encode(&[1_u8, 2, 3]).unwrap();
        let deed = Deed::Open(bytes);
        let on_the_bus = codec::encode(&deed).unwrap();
        assert_eq!(on_the_bus, [2, 3, 1, 2, 3]);
        assert_eq!(codec::decode::<Deed>(&on_the_bus).unwrap(), deed);
        let json = serde_json::to_string(&deed).unwrap();
        assert_eq!(serde_json::from_str::<Deed>(&json).unwrap(), deed);
        let mut too_long = vec![2, DEED_MAX as u8 + 1];
        too_long.extend([0; DEED_MAX + 1]);
        assert!(codec::decode::<Deed>(&too_long).is_err());
    }

    #[test]
    fn lore_has_its_bound() {
        let of = |length| codec::encode(&Lore::Open(vec![7; length])).unwrap();
        assert!(codec::decode::<Lore>(&of(LORE_MAX)).is_ok());
        assert!(codec::decode::<Lore>(&of(LORE_MAX + 1)).is_err());
    }

    #[test]
    fn of_another_mission_the_clean_up_reads_nothing() {
        let mut sensed = Sensed::Open(Box::default());
        assert_eq!(*sensed.items(), ItemsSensed::default());
        sensed.items_mut().holding = Some(true);
        assert_eq!(sensed.items().holding, Some(true));
        let deed = Deed::Open(Bytes::default());
        assert_eq!(deed.items(), ItemsDeed::default());
    }
}

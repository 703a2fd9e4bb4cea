//! Mission data in messages and in the log: sensor readings ([`SensorReading`]), actions ([`Action`]), the shared knowledge in
//! heartbeats ([`SharedKnowledge`]) and the [`Payload`] of bulletins.
//!
//! Missions with [`items`] have typed variants. Any other mission has types of its own, which are bytes on the bus.

pub mod items;
mod reading;

use std::fmt;

use serde::de::{DeserializeOwned, Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::codec::{self, CodecError};
use items::{ItemsAction, ItemsBulletin, ItemsKnowledge, ItemsReading};

pub use reading::{OpenReading, Reading};

/// The maximum size of an open mission's sensor readings in a step, bytes.
pub const MAX_READING_BYTES: usize = 192;

/// The maximum size of an open mission's action, bytes.
pub const MAX_ACTION_BYTES: usize = 32;

/// The maximum size of an open mission's shared knowledge, and of its bulletins, bytes.
pub const MAX_KNOWLEDGE_BYTES: usize = 600;

/// The readings of a mission's own sensors in a step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorReading {
    /// No readings of mission devices.
    #[default]
    Nothing,
    /// The readings of missions with [`items`].
    Items(ItemsReading),
    /// The readings of any other mission, in its own type.
    Open(OpenReading),
}

/// A robot's action in a step besides driving.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Action {
    /// No action besides driving.
    #[default]
    Nothing,
    /// The action of missions with [`items`].
    Items(ItemsAction),
    /// The action of any other mission: the encoding of its own type.
    Open(Bytes<MAX_ACTION_BYTES>),
}

impl Action {
    /// Creates the action of a mission without [`items`].
    ///
    /// # Panics
    /// Panics if the encoding takes more than [`MAX_ACTION_BYTES`] bytes.
    #[must_use]
    pub fn new<A: Serialize>(action: &A) -> Self {
        match Bytes::encode(action) {
            Ok(bytes) => Self::Open(bytes),
            Err(error) => panic!("the action of a robot for its mission: {error}"),
        }
    }

    /// Returns the action of a mission without [`items`]; `None` for an action of another form.
    #[must_use]
    pub fn value<A: DeserializeOwned>(&self) -> Option<A> {
        match self {
            Self::Open(bytes) => bytes.decode().ok(),
            Self::Nothing | Self::Items(_) => None,
        }
    }

    /// Returns the action with [`items`], or the default action in other missions.
    #[inline]
    #[must_use]
    pub fn items(&self) -> ItemsAction {
        match self {
            Self::Items(action) => *action,
            Self::Nothing | Self::Open(_) => ItemsAction::default(),
        }
    }
}

/// A robot's shared knowledge of its mission. Every heartbeat repeats it, so lost messages and new robots need no
/// special handling.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SharedKnowledge {
    /// No knowledge to share.
    #[default]
    Nothing,
    /// The knowledge of missions with [`items`].
    Items(ItemsKnowledge),
    /// The knowledge of any other mission: the encoding of its own type, at most [`MAX_KNOWLEDGE_BYTES`] bytes.
    Open(#[serde(deserialize_with = "bounded_knowledge")] Vec<u8>),
}

impl SharedKnowledge {
    /// Replaces the knowledge of a mission without [`items`]. It reuses the memory of the old value.
    ///
    /// # Panics
    /// Panics if the encoding takes more than [`MAX_KNOWLEDGE_BYTES`] bytes.
    pub fn set<K: Serialize>(&mut self, knowledge: &K) {
        let mut bytes = match std::mem::take(self) {
            Self::Open(bytes) => bytes,
            Self::Nothing | Self::Items(_) => Vec::new(),
        };
        encode_knowledge("the shared knowledge of a robot", knowledge, &mut bytes);
        *self = Self::Open(bytes);
    }
}

/// The content of a mission's bulletin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Payload {
    /// The content for missions with [`items`].
    Items(ItemsBulletin),
    /// The content for any other mission: the encoding of its own type, at most [`MAX_KNOWLEDGE_BYTES`] bytes.
    Open(#[serde(deserialize_with = "bounded_knowledge")] Vec<u8>),
}

impl Payload {
    /// Creates the content of a bulletin of a mission without [`items`].
    ///
    /// # Panics
    /// Panics if the encoding takes more than [`MAX_KNOWLEDGE_BYTES`] bytes.
    #[must_use]
    pub fn new<B: Serialize>(content: &B) -> Self {
        let mut bytes = Vec::new();
        encode_knowledge("the content of a bulletin", content, &mut bytes);
        Self::Open(bytes)
    }
}

fn encode_knowledge<T: Serialize>(subject: &str, value: &T, bytes: &mut Vec<u8>) {
    bytes.resize(MAX_KNOWLEDGE_BYTES, 0);
    match codec::encode_to_slice(value, bytes) {
        Ok(length) if length <= MAX_KNOWLEDGE_BYTES => bytes.truncate(length),
        Ok(length) => panic!(
            "{subject} takes {length} bytes; at most {MAX_KNOWLEDGE_BYTES} bytes are allowed"
        ),
        Err(error) => panic!("{subject}: {error}"),
    }
}

fn bounded_knowledge<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<u8>, D::Error> {
    let bytes = Vec::deserialize(deserializer)?;
    if bytes.len() > MAX_KNOWLEDGE_BYTES {
        let expected = format!("at most {MAX_KNOWLEDGE_BYTES} bytes");
        return Err(D::Error::invalid_length(bytes.len(), &expected.as_str()));
    }
    Ok(bytes)
}

/// A byte buffer of fixed capacity. A step passes it on without allocation.
#[derive(Clone, Copy)]
pub struct Bytes<const N: usize> {
    length: u8,
    /// Zeros from `length` on.
    bytes: [u8; N],
}

impl<const N: usize> Bytes<N> {
    /// Encodes a value into the buffer.
    ///
    /// # Errors
    /// Returns [`CodecError::TooLarge`] above `N` bytes.
    pub fn encode<T: Serialize>(value: &T) -> Result<Self, CodecError> {
        let mut new = Self::default();
        new.fill(value)?;
        Ok(new)
    }

    /// Encodes a value into an empty buffer.
    fn fill<T: Serialize>(&mut self, value: &T) -> Result<(), CodecError> {
        let length = codec::encode_to_slice(value, &mut self.bytes)?;
        self.length = u8::try_from(length)
            .ok()
            .filter(|_| length <= N)
            .ok_or(CodecError::TooLarge(length, N))?;
        Ok(())
    }

    /// Decodes the value in the buffer.
    pub fn decode<T: DeserializeOwned>(&self) -> Result<T, CodecError> {
        codec::decode(self.as_slice())
    }

    /// Returns the used part of the buffer.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }

    /// Copies bytes without decoding them. Returns `None` above `N` bytes.
    #[must_use]
    pub fn from_slice(bytes: &[u8]) -> Option<Self> {
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
                Bytes::from_slice(bytes).ok_or_else(|| E::invalid_length(bytes.len(), &self))
            }

            // JSON represents bytes as a list.
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
    fn values_that_fit_are_decoded_and_larger_ones_are_refused() {
        let value = (7_u32, "point".to_owned(), Some(0.5_f32));
        let bytes = Bytes::<32>::encode(&value).unwrap();
        assert_eq!(bytes.decode::<(u32, String, Option<f32>)>().unwrap(), value);
        assert!(bytes.decode::<(u32, u32)>().is_err());
        assert!(Bytes::<8>::encode(&value).is_err());
    }

    #[test]
    fn bytes_are_encoded_within_their_bounds() {
        let bytes = Bytes::<MAX_ACTION_BYTES>::encode(&[1_u8, 2, 3]).unwrap();
        let action = Action::Open(bytes);
        let encoded = codec::encode(&action).unwrap();
        assert_eq!(encoded, [2, 3, 1, 2, 3]);
        assert_eq!(codec::decode::<Action>(&encoded).unwrap(), action);
        let json = serde_json::to_string(&action).unwrap();
        assert_eq!(serde_json::from_str::<Action>(&json).unwrap(), action);
        let mut too_long = vec![2, MAX_ACTION_BYTES as u8 + 1];
        too_long.extend([0; MAX_ACTION_BYTES + 1]);
        assert!(codec::decode::<Action>(&too_long).is_err());
    }

    #[test]
    fn shared_knowledge_is_bounded() {
        let encoded = |length| codec::encode(&SharedKnowledge::Open(vec![7; length])).unwrap();
        assert!(codec::decode::<SharedKnowledge>(&encoded(MAX_KNOWLEDGE_BYTES)).is_ok());
        assert!(codec::decode::<SharedKnowledge>(&encoded(MAX_KNOWLEDGE_BYTES + 1)).is_err());
    }
}

//! The readings of a mission's own devices, as a value of the mission's own type.
//!
//! In one process a reading stays a value from the world to the controller. The bus and the hash of a tick need bytes:
//! [`OpenReading::with_bytes`] is the only place that encodes a reading, and [`OpenReading::value`] the only one that decodes
//! it.

use std::any::Any;
use std::borrow::Cow;
use std::fmt::Debug;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::items::ItemsReading;
use super::{Bytes, MAX_READING_BYTES, SensorReading};
use prefetch::prefetch;

/// A type of sensor readings of a mission. The default is the reading of dead devices. At most [`MAX_READING_BYTES`]
/// bytes on the bus.
pub trait Reading:
    Serialize + DeserializeOwned + Default + Clone + Debug + Send + Sync + 'static
{
}

impl<T> Reading for T where
    T: Serialize + DeserializeOwned + Default + Clone + Debug + Send + Sync + 'static
{
}

/// The readings of a mission without [`items`](super::items).
#[derive(Clone, Debug)]
pub struct OpenReading(Content);

#[derive(Clone, Debug)]
enum Content {
    /// A reading of this process.
    Value(Box<dyn AnyReading>),
    /// A reading from the bus. The box keeps a robot's readings close together.
    Bytes(Box<Bytes<MAX_READING_BYTES>>),
}

/// The object-safe side of [`Reading`].
trait AnyReading: Any + Debug + Send + Sync {
    /// Encodes the value into an empty buffer.
    fn encode(&self, bytes: &mut Bytes<MAX_READING_BYTES>);
    fn clone_box(&self) -> Box<dyn AnyReading>;
}

impl<R: Reading> AnyReading for R {
    fn encode(&self, bytes: &mut Bytes<MAX_READING_BYTES>) {
        bytes
            .fill(self)
            .unwrap_or_else(|error| panic!("cannot encode the readings of the mission: {error}"));
    }

    fn clone_box(&self) -> Box<dyn AnyReading> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn AnyReading> {
    fn clone(&self) -> Self {
        (**self).clone_box()
    }
}

impl OpenReading {
    /// Passes the encoding of the reading to `use_bytes`, and returns its result.
    ///
    /// # Panics
    /// Panics if the encoding of a value takes more than [`MAX_READING_BYTES`] bytes.
    pub fn with_bytes<T>(&self, use_bytes: impl FnOnce(&Bytes<MAX_READING_BYTES>) -> T) -> T {
        match &self.0 {
            Content::Value(value) => {
                let mut bytes = Bytes::default();
                (**value).encode(&mut bytes);
                use_bytes(&bytes)
            }
            Content::Bytes(bytes) => use_bytes(bytes),
        }
    }

    /// Returns the reading. A reading of another type is converted as on the bus; without a conversion the result is
    /// the default.
    fn value<R: Reading>(&self) -> Cow<'_, R> {
        if let Content::Value(value) = &self.0
            && let Some(value) = (&**value as &dyn Any).downcast_ref::<R>()
        {
            return Cow::Borrowed(value);
        }
        Cow::Owned(self.with_bytes(Bytes::decode).unwrap_or_default())
    }
}

impl SensorReading {
    /// Creates the reading of a mission without [`items`](super::items).
    #[must_use]
    pub fn new<R: Reading>(value: R) -> Self {
        Self::Open(OpenReading(Content::Value(Box::new(value))))
    }

    /// Creates a reading as it arrives from the bus.
    #[must_use]
    pub fn from_bytes(bytes: Bytes<MAX_READING_BYTES>) -> Self {
        Self::Open(OpenReading(Content::Bytes(Box::new(bytes))))
    }

    /// Returns the reading as a value of the mission's own type. It is the default if there is no reading, or one of
    /// another mission.
    #[inline]
    #[must_use]
    pub fn value<R: Reading>(&self) -> Cow<'_, R> {
        match self {
            Self::Open(open) => open.value(),
            Self::Items(items) => (items as &dyn Any)
                .downcast_ref::<R>()
                .map_or_else(Cow::default, Cow::Borrowed),
            Self::Nothing => Cow::Owned(R::default()),
        }
    }

    /// Returns the same reading of a mission without [`items`](super::items) for writing. It reuses the memory of a
    /// reading of that type.
    pub fn value_mut<R: Reading>(&mut self) -> &mut R {
        let is_same = match self {
            Self::Open(OpenReading(Content::Value(value))) => (&**value as &dyn Any).is::<R>(),
            _ => false,
        };
        if !is_same {
            *self = Self::new(self.value::<R>().into_owned());
        }
        let Self::Open(OpenReading(Content::Value(value))) = self else {
            unreachable!("the variant was set above")
        };
        (&mut **value as &mut dyn Any)
            .downcast_mut()
            .unwrap_or_else(|| unreachable!("the type was set above"))
    }

    /// Requests the memory of the reading, see [`prefetch`](mod@prefetch).
    #[inline]
    pub fn prefetch(&self) {
        if let Self::Open(OpenReading(Content::Value(value))) = self {
            prefetch(&**value);
        }
    }

    /// Returns the readings of the devices for [`items`](super::items). They are empty in a mission without items.
    #[inline]
    #[must_use]
    pub fn items(&self) -> &ItemsReading {
        const NOTHING: &ItemsReading = &ItemsReading::NOTHING;
        match self {
            Self::Items(sensed) => sensed,
            Self::Nothing | Self::Open(_) => NOTHING,
        }
    }

    /// Returns the same readings for writing.
    #[inline]
    pub fn items_mut(&mut self) -> &mut ItemsReading {
        if !matches!(self, Self::Items(_)) {
            *self = Self::Items(ItemsReading::NOTHING);
        }
        let Self::Items(sensed) = self else {
            unreachable!("the variant was set above")
        };
        sensed
    }
}

/// Compares the encodings, because the values have no common type.
impl PartialEq for OpenReading {
    fn eq(&self, other: &Self) -> bool {
        self.with_bytes(|bytes| other.with_bytes(|other| bytes == other))
    }
}

impl Serialize for OpenReading {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.with_bytes(|bytes| bytes.serialize(serializer))
    }
}

impl<'de> Deserialize<'de> for OpenReading {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Bytes::deserialize(deserializer).map(|bytes| Self(Content::Bytes(Box::new(bytes))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec;

    #[test]
    fn a_value_has_the_bytes_of_its_encoding() {
        let value = (7_u32, Some(0.5_f32));
        let reading = SensorReading::new(value);
        let bytes = SensorReading::from_bytes(Bytes::encode(&value).unwrap());
        assert_eq!(reading, bytes);
        let encoded = codec::encode(&reading).unwrap();
        assert_eq!(encoded, codec::encode(&bytes).unwrap());
        let decoded: SensorReading = codec::decode(&encoded).unwrap();
        for mut reading in [reading, bytes, decoded] {
            assert_eq!(*reading.value::<(u32, Option<f32>)>(), value);
            // Another type of the same form takes the value over, as from the bus.
            assert_eq!(*reading.value::<(u64, Option<f32>)>(), (7, Some(0.5)));
            assert_eq!(*reading.value::<String>(), "");
            reading.value_mut::<(u32, Option<f32>)>().0 += 1;
            assert_eq!(reading, SensorReading::new((8_u32, Some(0.5_f32))));
        }
    }

    #[test]
    fn readings_of_another_mission_contain_no_items() {
        let mut sensed = SensorReading::new(7_u8);
        assert_eq!(*sensed.items(), ItemsReading::default());
        sensed.items_mut().holding = Some(true);
        assert_eq!(sensed.value::<ItemsReading>().holding, Some(true));
        assert_eq!(*sensed.value::<u8>(), 0);
    }
}

//! The wire codec. Only this file calls bincode, which is pinned because it is unmaintained. `inline` writes the same
//! bytes as bincode's serializer.

mod inline;

use std::fmt::Formatter;

use bincode::error::DecodeError;
use serde::de::{DeserializeOwned, DeserializeSeed, Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use inline::Encoder;

/// The size limit of an encoded message, bytes. A tick of a robot in a crowded room takes a few kilobytes.
pub const LIMIT_BYTES: usize = 256 * 1024;

/// The initial buffer size, bytes. Most messages of a run fit, with their seal.
const USUAL_BYTES: usize = 256;

/// An error of encoding or decoding a message.
#[derive(Debug, thiserror::Error)]
pub enum CodecError {
    /// The message is larger than its limit: both sizes, bytes.
    #[error("message of {0} bytes is larger than the limit of {1}")]
    TooLarge(usize, usize),
    /// The bytes are not an encoding of the expected type.
    #[error("malformed message: {0}")]
    Malformed(String),
    /// The bytes continue after the message.
    #[error("{0} trailing bytes after the message")]
    Trailing(usize),
}

fn configuration<const LIMIT: usize>() -> impl bincode::config::Config {
    bincode::config::standard().with_limit::<LIMIT>()
}

/// Encodes a message.
///
/// # Errors
/// Returns [`CodecError::TooLarge`] above the size limit.
pub fn encode<T: Serialize>(message: &T) -> Result<Vec<u8>, CodecError> {
    encode_within::<T, LIMIT_BYTES>(message)
}

/// Encodes a message with a size limit of its own, bytes.
///
/// # Errors
/// Returns [`CodecError::TooLarge`] above the size limit.
pub fn encode_within<T: Serialize, const LIMIT: usize>(message: &T) -> Result<Vec<u8>, CodecError> {
    let mut bytes = vec![0; USUAL_BYTES];
    let length = encode_into(message, &mut bytes)?;
    if length > LIMIT {
        return Err(CodecError::TooLarge(length, LIMIT));
    }
    bytes.truncate(length);
    Ok(bytes)
}

/// Writes the encoding of a value of any size to the start of `room`, which grows if necessary, and returns its length.
///
/// # Errors
/// Returns [`CodecError::Malformed`] for a value that bincode cannot represent. Plain data is always representable.
#[inline]
pub fn encode_into<T: Serialize>(value: &T, room: &mut Vec<u8>) -> Result<usize, CodecError> {
    let length = write(value, room)?;
    if length > room.len() {
        room.resize(length + USUAL_BYTES, 0);
        write(value, room)?;
    }
    Ok(length)
}

/// Returns the length of a message's encoding, bytes.
///
/// # Errors
/// Returns [`CodecError::TooLarge`] above the size limit.
pub fn encoded_len<T: Serialize>(message: &T) -> Result<usize, CodecError> {
    match write(message, &mut [])? {
        length if length > LIMIT_BYTES => Err(CodecError::TooLarge(length, LIMIT_BYTES)),
        length => Ok(length),
    }
}

/// Returns the length of an unsigned number's encoding, bytes.
pub fn number_len(number: u64) -> usize {
    let mut encoder = Encoder::new(&mut []);
    encoder.unsigned(number);
    encoder.length()
}

/// Writes the part of an encoding that fits to the start of `place`, and returns the length of the whole encoding.
pub fn encode_to_slice<T: Serialize>(value: &T, place: &mut [u8]) -> Result<usize, CodecError> {
    write(value, place)
}

#[inline]
fn write<T: Serialize>(value: &T, place: &mut [u8]) -> Result<usize, CodecError> {
    let mut encoder = Encoder::new(place);
    value
        .serialize(&mut encoder)
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    Ok(encoder.length())
}

/// Decodes a message that fills `bytes` completely.
///
/// # Errors
/// Returns any [`CodecError`]. Arbitrary bytes cause no panic and allocate no more than the size limit allows.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    decode_within::<T, LIMIT_BYTES>(bytes)
}

/// Decodes a message that fills `bytes` completely, with a size limit of its own, bytes.
///
/// # Errors
/// Returns any [`CodecError`], like [`decode`].
pub fn decode_within<T: DeserializeOwned, const LIMIT: usize>(
    bytes: &[u8],
) -> Result<T, CodecError> {
    if bytes.len() > LIMIT {
        return Err(CodecError::TooLarge(bytes.len(), LIMIT));
    }
    let decoded = bincode::serde::decode_from_slice(bytes, configuration::<LIMIT>());
    let (message, used) = decoded.map_err(malformed)?;
    match bytes.len() - used {
        0 => Ok(message),
        trailing => Err(CodecError::Trailing(trailing)),
    }
}

/// Decodes a sequence of at most `most` items that fills `bytes` completely, into `items`. Unlike [`decode`] it does not
/// move the whole sequence. After an error `items` is empty.
///
/// # Errors
/// Returns any [`CodecError`], for the same bytes as [`decode`].
pub fn decode_items<T: DeserializeOwned>(
    bytes: &[u8],
    most: usize,
    items: &mut Vec<T>,
) -> Result<(), CodecError> {
    items.clear();
    let place = Items { most, items };
    let decoded =
        bincode::serde::seed_decode_from_slice(place, bytes, configuration::<LIMIT_BYTES>());
    let problem = match decoded {
        Ok(((), used)) if used == bytes.len() => return Ok(()),
        Ok(((), used)) => CodecError::Trailing(bytes.len() - used),
        Err(error) => malformed(error),
    };
    items.clear();
    Err(problem)
}

/// The place for the items of a sequence.
struct Items<'a, T> {
    most: usize,
    items: &'a mut Vec<T>,
}

impl<'de, T: Deserialize<'de>> DeserializeSeed<'de> for Items<'_, T> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Items<'_, T> {
    type Value = ();

    fn expecting(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "a sequence of at most {} items", self.most)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<(), A::Error> {
        while let Some(item) = sequence.next_element()? {
            if self.items.len() == self.most {
                return Err(A::Error::invalid_length(self.most + 1, &self));
            }
            self.items.push(item);
        }
        Ok(())
    }
}

/// Decodes the beginning of a message and ignores the rest.
pub fn decode_first<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    bincode::serde::decode_from_slice(bytes, configuration::<LIMIT_BYTES>())
        .map(|(first, _)| first)
        .map_err(malformed)
}

/// Returns the error of a message that does not decode. Bincode shows its texts in the form of Rust's `Debug`.
fn malformed(error: DecodeError) -> CodecError {
    CodecError::Malformed(match error {
        DecodeError::OtherString(text) => text,
        other => other.to_string(),
    })
}

#[cfg(test)]
mod tests;

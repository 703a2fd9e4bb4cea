//! The wire codec: the only file that calls bincode (unmaintained, pinned; DESIGN §3). What bincode would write is written by
//! `inline`, with the same bytes.

mod inline;

use serde::Serialize;
use serde::de::DeserializeOwned;

use inline::Encoder;

/// Largest encoded message, bytes. A tick of a robot in a crowded room takes a few kilobytes.
pub const LIMIT_BYTES: usize = 256 * 1024;

/// Memory that is asked for at first: most messages of a run fit, with their seal.
const USUAL_BYTES: usize = 256;

/// A message that cannot be put on, or taken from, the bus.
#[derive(Debug, thiserror::Error)]
pub enum CodecError {
    /// The message is larger than [`LIMIT_BYTES`].
    #[error("message of {0} bytes is larger than the limit of {LIMIT_BYTES}")]
    TooLarge(usize),
    /// The bytes are not an encoding of the expected type.
    #[error("malformed message: {0}")]
    Malformed(String),
    /// The bytes hold a message and something after it.
    #[error("{0} trailing bytes after the message")]
    Trailing(usize),
}

fn configuration() -> impl bincode::config::Config {
    bincode::config::standard().with_limit::<LIMIT_BYTES>()
}

/// Encodes a message.
///
/// # Errors
/// [`CodecError::TooLarge`] above the size limit.
pub fn encode<T: Serialize>(message: &T) -> Result<Vec<u8>, CodecError> {
    let mut bytes = vec![0; USUAL_BYTES];
    let length = encode_into(message, &mut bytes)?;
    if length > LIMIT_BYTES {
        return Err(CodecError::TooLarge(length));
    }
    bytes.truncate(length);
    Ok(bytes)
}

/// Writes the encoding of a value of any size to where `room` begins, and tells its length. The room grows if that takes more;
/// whoever encodes much keeps it for the next value.
///
/// # Errors
/// [`CodecError::Malformed`] for a value that bincode cannot represent; plain data always can.
#[inline]
pub fn encode_into<T: Serialize>(value: &T, room: &mut Vec<u8>) -> Result<usize, CodecError> {
    let length = write(value, room)?;
    if length > room.len() {
        room.resize(length + USUAL_BYTES, 0);
        write(value, room)?;
    }
    Ok(length)
}

/// How many bytes the encoding of a message takes.
///
/// # Errors
/// [`CodecError::TooLarge`] above the size limit.
pub fn encoded_len<T: Serialize>(message: &T) -> Result<usize, CodecError> {
    match write(message, &mut [])? {
        length if length > LIMIT_BYTES => Err(CodecError::TooLarge(length)),
        length => Ok(length),
    }
}

/// Writes the encoding of a value to where `place` begins, as far as it fits, and tells its length.
///
/// # Errors
/// See [`encode_into`].
pub fn encode_to_slice<T: Serialize>(value: &T, place: &mut [u8]) -> Result<usize, CodecError> {
    write(value, place)
}

/// The length of the encoding, of which as much is written as fits.
#[inline]
fn write<T: Serialize>(value: &T, place: &mut [u8]) -> Result<usize, CodecError> {
    let mut encoder = Encoder::new(place);
    value
        .serialize(&mut encoder)
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    Ok(encoder.length())
}

/// Decodes a message that takes up all of `bytes`.
///
/// # Errors
/// Any [`CodecError`]; arbitrary bytes never panic and never allocate more than the size limit allows.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    if bytes.len() > LIMIT_BYTES {
        return Err(CodecError::TooLarge(bytes.len()));
    }
    let (message, used) = bincode::serde::decode_from_slice(bytes, configuration())
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    match bytes.len() - used {
        0 => Ok(message),
        trailing => Err(CodecError::Trailing(trailing)),
    }
}

/// Decodes only what a message begins with, whatever follows.
///
/// # Errors
/// See [`decode`].
pub fn decode_first<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, CodecError> {
    bincode::serde::decode_from_slice(bytes, configuration())
        .map(|(first, _)| first)
        .map_err(|error| CodecError::Malformed(error.to_string()))
}

#[cfg(test)]
mod tests;

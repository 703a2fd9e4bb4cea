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
    let mut bytes = Vec::with_capacity(USUAL_BYTES);
    append(message, &mut bytes)?;
    if bytes.len() > LIMIT_BYTES {
        return Err(CodecError::TooLarge(bytes.len()));
    }
    Ok(bytes)
}

/// Appends the encoding of a value of any size to `bytes`, for hashing.
///
/// # Errors
/// [`CodecError::Malformed`] for a value that bincode cannot represent; plain data always can.
#[inline]
pub fn append<T: Serialize>(value: &T, bytes: &mut Vec<u8>) -> Result<(), CodecError> {
    value
        .serialize(&mut Encoder(bytes))
        .map_err(|error| CodecError::Malformed(error.to_string()))
}

/// How many bytes the encoding of a message takes.
///
/// # Errors
/// [`CodecError::TooLarge`] above the size limit.
pub fn encoded_len<T: Serialize>(message: &T) -> Result<usize, CodecError> {
    let mut count = Count(0);
    bincode::serde::encode_into_writer(message, &mut count, configuration())
        .map_err(|error| CodecError::Malformed(error.to_string()))?;
    if count.0 > LIMIT_BYTES {
        return Err(CodecError::TooLarge(count.0));
    }
    Ok(count.0)
}

/// Counts bytes.
struct Count(usize);

impl bincode::enc::write::Writer for &mut Count {
    #[inline(always)]
    fn write(&mut self, bytes: &[u8]) -> Result<(), bincode::error::EncodeError> {
        self.0 += bytes.len();
        Ok(())
    }
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

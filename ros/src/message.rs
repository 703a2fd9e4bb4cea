//! Messages as a whole: their bytes are the encapsulation header and the value.

use crate::cdr::CdrWriter;
use crate::description::MessageType;
use crate::field::Field;
use crate::read::{CdrReader, ReadError};

/// A message of a type that ROS 2 defines.
pub trait Message: Field {
    /// The type of the message.
    const MESSAGE: &'static MessageType;
}

/// Encodes a message, with its encapsulation header.
#[must_use]
pub fn encode(message: &impl Message) -> Vec<u8> {
    let mut writer = CdrWriter::default();
    message.write(&mut writer);
    writer.into_bytes()
}

/// Decodes a message, with its encapsulation header.
///
/// # Errors
/// Returns an error if the bytes are not exactly one message of the type.
pub fn decode<M: Message>(bytes: &[u8]) -> Result<M, ReadError> {
    let mut reader = CdrReader::little_endian(bytes)?;
    let message = M::read(&mut reader)?;
    reader.finish()?;
    Ok(message)
}

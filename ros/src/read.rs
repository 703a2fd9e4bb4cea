//! Decoding of messages that other programs sent. The counterpart of `cdr`.

/// The encapsulation headers of plain CDR. The two octets of options after them have no meaning.
const LITTLE_ENDIAN: [u8; 2] = [0, 1];
const BIG_ENDIAN: [u8; 2] = [0, 0];

/// The size of the encapsulation header, bytes.
const HEADER_BYTES: usize = 4;

/// The largest padding after a message, bytes.
const MAX_PADDING: usize = 3;

/// The reason why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    #[error("the message is not in plain little-endian CDR")]
    Encapsulation,
    #[error("the message ends too early")]
    End,
    #[error("the message is longer than its type")]
    Rest,
    #[error("a truth value is neither 0 nor 1")]
    Bool,
    #[error("a text is not UTF-8 with a zero byte at its end")]
    Text,
}

/// The bytes of a message during its decoding.
#[derive(Debug)]
pub struct CdrReader<'b> {
    /// The bytes after the encapsulation header, from which alignment counts.
    bytes: &'b [u8],
    place: usize,
    is_little_endian: bool,
}

impl<'b> CdrReader<'b> {
    /// Creates the reader of a message with its encapsulation header, in either byte order.
    ///
    /// # Errors
    /// Returns an error if the message is not in plain CDR.
    pub fn new(message: &'b [u8]) -> Result<Self, ReadError> {
        let parts = message.split_at_checked(HEADER_BYTES);
        let (header, bytes) = parts.ok_or(ReadError::Encapsulation)?;
        let is_little_endian = header.starts_with(&LITTLE_ENDIAN);
        if !is_little_endian && !header.starts_with(&BIG_ENDIAN) {
            return Err(ReadError::Encapsulation);
        }
        Ok(Self {
            bytes,
            place: 0,
            is_little_endian,
        })
    }

    /// Creates the reader of a message that must be little-endian.
    ///
    /// # Errors
    /// Returns an error if the message is not in plain little-endian CDR.
    pub fn little_endian(message: &'b [u8]) -> Result<Self, ReadError> {
        let reader = Self::new(message)?;
        let is_little_endian = reader.is_little_endian;
        is_little_endian
            .then_some(reader)
            .ok_or(ReadError::Encapsulation)
    }

    /// Checks that the message ends here, except for padding.
    ///
    /// # Errors
    /// Returns an error if it is longer.
    pub fn finish(&self) -> Result<(), ReadError> {
        match self.bytes.len() - self.place {
            ..=MAX_PADDING => Ok(()),
            _ => Err(ReadError::Rest),
        }
    }

    /// Reads a number of `N` bytes at a multiple of its size. The result is little-endian.
    ///
    /// # Errors
    /// Returns an error if the bytes end before.
    pub fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let start = self.place.next_multiple_of(N);
        let rest = self.bytes.get(start..).ok_or(ReadError::End)?;
        let number = rest.first_chunk().ok_or(ReadError::End)?;
        self.place = start + N;
        let mut number = *number;
        if !self.is_little_endian {
            number.reverse();
        }
        Ok(number)
    }

    /// Reads the number of values in a sequence, or of bytes in a text.
    ///
    /// # Errors
    /// Returns an error if the bytes end before.
    pub fn take_length(&mut self) -> Result<usize, ReadError> {
        Ok(u32::from_le_bytes(self.take()?) as usize)
    }

    /// Reads a text.
    ///
    /// # Errors
    /// Returns an error if the bytes end before, or if the text is not UTF-8 with a zero byte at its end.
    pub fn take_text(&mut self) -> Result<String, ReadError> {
        let length = self.take_length()?;
        let rest = &self.bytes[self.place..];
        let text = rest.get(..length).ok_or(ReadError::End)?;
        self.place += length;
        // Some encoders write an empty text without its zero byte.
        let text = match text {
            [] => text,
            [text @ .., 0] => text,
            _ => return Err(ReadError::Text),
        };
        let text = str::from_utf8(text).map_err(|_| ReadError::Text)?;
        Ok(text.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::messages::{
        Header, LaserScan, MarkerArray, Odometry, StringMessage, Time, TwistStamped,
    };
    use crate::{decode, encode};

    fn command(frame: &str, speed: f64) -> TwistStamped {
        let mut command = TwistStamped {
            header: Header {
                stamp: Time {
                    sec: -3,
                    nanosec: 50_000_001,
                },
                frame_id: frame.to_owned(),
            },
            ..TwistStamped::default()
        };
        command.twist.linear.x = speed;
        command
    }

    #[test]
    fn a_message_survives_a_round_trip() {
        for frame in ["", "base_link", "abc"] {
            let command = command(frame, 0.25);
            assert_eq!(decode(&encode(&command)), Ok(command));
        }
        let scan = LaserScan {
            ranges: vec![0.5, f32::INFINITY],
            ..LaserScan::default()
        };
        assert_eq!(decode(&encode(&scan)), Ok(scan));
        let odometry = Odometry::default();
        assert_eq!(decode(&encode(&odometry)), Ok(odometry));
    }

    #[test]
    fn bytes_that_are_no_message_are_refused() {
        let bytes = encode(&command("a", 1.0));
        for end in 0..bytes.len() {
            assert!(decode::<TwistStamped>(&bytes[..end]).is_err(), "{end}");
        }
        let longer = |more: usize| [&bytes[..], &vec![0; more]].concat();
        assert!(decode::<TwistStamped>(&longer(3)).is_ok());
        assert_eq!(decode::<TwistStamped>(&longer(4)), Err(ReadError::Rest));
        let text = |bytes: &[u8]| decode::<StringMessage>(bytes);
        // Big-endian.
        assert_eq!(
            text(&[0, 0, 0, 0, 0, 0, 0, 1, 0]),
            Err(ReadError::Encapsulation)
        );
        assert_eq!(
            text(&[0, 1, 0, 0, 255, 255, 255, 255, 0]),
            Err(ReadError::End)
        );
        assert_eq!(text(&[0, 1, 0, 0, 1, 0, 0, 0, 65]), Err(ReadError::Text));
        assert_eq!(
            text(&[0, 1, 0, 0, 2, 0, 0, 0, 255, 0]),
            Err(ReadError::Text)
        );
        assert_eq!(
            text(&[0, 1, 0, 0, 0, 0, 0, 0]),
            Ok(StringMessage::default())
        );
    }

    proptest! {
        #[test]
        fn no_bytes_cause_a_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            if let Some(start) = bytes.get_mut(..2) {
                start.copy_from_slice(&LITTLE_ENDIAN);
            }
            let _ = decode::<MarkerArray>(&bytes);
            let _ = decode::<LaserScan>(&bytes);
            if let Ok(command) = decode::<TwistStamped>(&bytes) {
                // Padding has any value.
                prop_assert!(encode(&command).len() <= bytes.len());
            }
        }
    }
}

//! Encoding of messages: the Common Data Representation, version 1, little-endian (OMG formal/02-06-51, section 15.3).

/// The encapsulation header: plain CDR, little-endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// The bytes of a message during its encoding.
#[derive(Debug)]
pub struct CdrWriter {
    bytes: Vec<u8>,
}

impl Default for CdrWriter {
    fn default() -> Self {
        let bytes = HEADER.to_vec();
        Self { bytes }
    }
}

impl CdrWriter {
    /// Returns the message with its encapsulation header.
    #[must_use]
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    /// Appends a number of `N` bytes at a multiple of its size, counted from the end of the header.
    pub fn put<const N: usize>(&mut self, number: [u8; N]) {
        while !(self.bytes.len() - HEADER.len()).is_multiple_of(N) {
            self.bytes.push(0);
        }
        self.bytes.extend(number);
    }

    /// Appends the number of values in a sequence, or of bytes in a text.
    pub fn put_length(&mut self, length: usize) {
        // A message is far shorter than 4 GiB.
        self.put((length as u32).to_le_bytes());
    }

    /// Appends a text with its length and the closing zero byte. Readers of ROS end a text at its first zero byte.
    pub fn put_text(&mut self, text: &str) {
        self.put_length(text.len() + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }
}

#[cfg(test)]
mod tests {
    use crate::encode;
    use crate::messages::{
        Clock, DiagnosticArray, DiagnosticStatus, Header, KeyValue, Odometry, StringMessage, Time,
    };

    #[test]
    fn numbers_are_little_endian_behind_the_header() {
        let clock = Clock {
            clock: Time {
                sec: 1,
                nanosec: 0x0a0b_0c0d,
            },
        };
        assert_eq!(encode(&clock), [0, 1, 0, 0, 1, 0, 0, 0, 13, 12, 11, 10]);
    }

    #[test]
    fn a_text_ends_with_zero_and_the_next_number_is_aligned() {
        let text = StringMessage {
            data: "ab".to_owned(),
        };
        assert_eq!(encode(&text), [0, 1, 0, 0, 3, 0, 0, 0, b'a', b'b', 0]);

        let status = DiagnosticArray {
            header: Header::default(),
            status: vec![DiagnosticStatus {
                values: vec![KeyValue::default()],
                ..DiagnosticStatus::default()
            }],
        };
        // Stamp 8, frame 5, padding 3, count 4, level 1, padding 3, three texts of 5 with padding 3, count 4, a text of
        // 5 with padding 3, and a text of 5.
        assert_eq!(encode(&status).len(), 4 + 8 + 8 + 4 + 4 + 24 + 4 + 8 + 5);
    }

    #[test]
    fn a_double_is_aligned_to_eight_bytes_after_the_header() {
        let odometry = Odometry::default();
        // Stamp 8, frame 5, padding 3, child frame 5, padding 3; then pose 7 numbers, twist 6, and two covariances.
        assert_eq!(encode(&odometry).len(), 4 + 16 + 8 + 8 * (7 + 6 + 72));
    }
}

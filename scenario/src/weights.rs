//! Weights of trained allocators. A scenario file names a file of weights. A setup contains its bytes, so that processes
//! and replays need no other file.

use std::fmt::Write;

use serde::Deserialize;
use serde_json::Value;

use super::Scenario;

/// The start of the text that contains the bytes of a file.
const PREFIX: &str = "hex:";

/// The content of a file of weights.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(try_from = "String")]
pub struct Weights(pub Vec<u8>);

impl Weights {
    /// The parameter of an allocator that contains weights.
    pub const KEY: &str = "weights";

    /// The largest size of a file, bytes. A setup has to fit into a message.
    pub const MAX_BYTES: u64 = 1 << 16;
}

impl TryFrom<String> for Weights {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let digits = text.strip_prefix(PREFIX);
        let digits = digits.ok_or_else(|| format!("the file '{text}' was not read"))?;
        let bytes = digits.as_bytes().chunks(2).map(|pair| {
            let pair = str::from_utf8(pair).ok()?;
            let is_byte = pair.len() == 2 && !pair.starts_with('+');
            u8::from_str_radix(pair, 16).ok().filter(|_| is_byte)
        });
        let bytes: Option<Vec<u8>> = bytes.collect();
        bytes
            .map(Self)
            .ok_or_else(|| "the text after 'hex:' is not hexadecimal".to_owned())
    }
}

impl Scenario {
    /// Replaces each name of a file of weights by the bytes of the file, which `read` returns. `read` receives the allocator and
    /// the name.
    ///
    /// # Errors
    /// Returns the error of `read`.
    pub fn include_weights<E>(
        &mut self,
        mut read: impl FnMut(&str, &str) -> Result<Vec<u8>, E>,
    ) -> Result<(), E> {
        for (allocator, values) in &mut self.allocators {
            if let Some(Value::String(text)) = values.get_mut(Weights::KEY)
                && !text.starts_with(PREFIX)
            {
                let bytes = read(allocator, text)?;
                let mut content = String::from(PREFIX);
                for byte in bytes {
                    // Writing to a string never fails.
                    let _ = write!(content, "{byte:02x}");
                }
                *text = content;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::default_scenario;

    #[test]
    fn a_file_of_weights_becomes_part_of_the_scenario() {
        let mut scenario = default_scenario();
        let values = scenario.allocators.entry("learned".to_owned()).or_default();
        values.insert("weights".to_owned(), Value::from("mine"));
        let read = |allocator: &str, file: &str| {
            assert_eq!((allocator, file), ("learned", "mine"));
            Ok::<_, ()>(vec![0, 171, 255])
        };
        scenario.include_weights(read).unwrap();
        let text = scenario.allocators["learned"]["weights"].as_str().unwrap();
        assert_eq!(text, "hex:00abff");
        assert_eq!(
            Weights::try_from(text.to_owned()),
            Ok(Weights(vec![0, 171, 255]))
        );
        // The bytes are not read again.
        let read = |_: &str, _: &str| Err(());
        assert_eq!(scenario.include_weights(read), Ok(()));
    }

    #[test]
    fn damaged_weights_are_refused() {
        for text in ["mine", "hex:0", "hex:0g", "hex:+1", "hex:ä"] {
            assert!(Weights::try_from(text.to_owned()).is_err(), "{text}");
        }
    }
}

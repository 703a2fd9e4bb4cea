//! The encoding of CSV rows, field by field, with cached parts for many rows.

use std::fmt::Display;
use std::io::Write;

use itoa::Integer;
use zmij::Float;

/// A CSV row that is written field by field without allocation.
pub(crate) struct Row<'b>(&'b mut Vec<u8>);

impl<'b> Row<'b> {
    /// Starts a row at the end of `bytes`.
    pub fn new(bytes: &'b mut Vec<u8>) -> Self {
        Self(bytes)
    }

    pub(super) fn fields(self, fields: &Fields) -> Self {
        self.0.extend_from_slice(&fields.0);
        self
    }

    /// Adds a word that needs no quotes.
    #[inline(always)]
    pub fn word(self, word: &'static str) -> Self {
        self.0.extend_from_slice(word.as_bytes());
        self.0.push(b',');
        self
    }

    pub fn number(self, value: impl Integer) -> Self {
        let mut digits = itoa::Buffer::new();
        self.0.extend_from_slice(digits.format(value).as_bytes());
        self.0.push(b',');
        self
    }

    /// Adds a letter and a number, as the name of an object without a name.
    pub fn numbered(self, letter: char, value: impl Integer) -> Self {
        self.0.push(letter as u8);
        self.number(value)
    }

    /// Adds a float in the shortest form that reads back to the same bits. Of two equally near forms it chooses the even one. Whole
    /// numbers have no decimal point, and there is never an exponent.
    pub fn real<F: Float + Display>(self, value: F) -> Self {
        let mut digits = zmij::Buffer::new();
        let shortest = digits.format(value);
        if shortest.ends_with(|last: char| last.is_ascii_digit()) && !shortest.contains('e') {
            let whole = shortest.strip_suffix(".0").unwrap_or(shortest);
            self.0.extend_from_slice(whole.as_bytes());
        } else {
            // Writing to a Vec cannot fail.
            let _ = write!(self.0, "{value}");
        }
        self.0.push(b',');
        self
    }

    pub fn optional(self, value: Option<impl Integer>) -> Self {
        match value {
            Some(value) => self.number(value),
            None => self.text(""),
        }
    }

    pub fn flag(self, value: bool) -> Self {
        self.0.extend_from_slice(if value { b"1," } else { b"0," });
        self
    }

    /// Adds a hash as 16 hexadecimal digits.
    pub fn hash(self, value: u64) -> Self {
        let mut digits = [b','; 17];
        for (place, digit) in digits[..16].iter_mut().enumerate() {
            *digit = b"0123456789abcdef"[(value >> (60 - 4 * place)) as usize & 0xf];
        }
        self.0.extend_from_slice(&digits);
        self
    }

    /// Adds text, with quotes if CSV requires them. Control characters become spaces, so that a row is always one line.
    pub fn text(self, text: &str) -> Self {
        let special = |byte: u8| byte.is_ascii_control() || byte == b',' || byte == b'"';
        // The loop reads all bytes even after a match, so that the compiler can vectorize it.
        if text.bytes().fold(false, |any, byte| any | special(byte)) {
            self.0.push(b'"');
            for byte in text.bytes() {
                match byte {
                    b'"' => self.0.extend_from_slice(b"\"\""),
                    byte if byte.is_ascii_control() => self.0.push(b' '),
                    byte => self.0.push(byte),
                }
            }
            self.0.push(b'"');
        } else {
            self.0.extend_from_slice(text.as_bytes());
        }
        self.0.push(b',');
        self
    }

    /// Ends the row with cached fields, and encodes them again with `fields` only if the key has changed.
    pub(super) fn end_with<K: PartialEq>(
        self,
        tail: &mut CachedFields<K>,
        key: K,
        fields: impl FnOnce(Row<'_>),
    ) {
        if tail.are_of(&key) {
            self.0.extend_from_slice(&tail.bytes);
        } else {
            let start = self.0.len();
            fields(Row(&mut *self.0));
            tail.bytes.clear();
            tail.bytes.extend_from_slice(&self.0[start..]);
            tail.key = Some(key);
        }
    }

    /// Replaces the last comma by the end of the line.
    pub fn end(self) {
        // Each field ends with a comma.
        if let Some(last) = self.0.last_mut() {
            *last = b'\n';
        }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct Fields(Vec<u8>);

impl Fields {
    pub fn of(write: impl for<'r> FnOnce(Row<'r>) -> Row<'r>) -> Self {
        let mut fields = Self::default();
        fields.set(write);
        fields
    }

    pub fn set(&mut self, write: impl for<'r> FnOnce(Row<'r>) -> Row<'r>) {
        self.0.clear();
        write(Row::new(&mut self.0));
    }
}

/// The cached last fields of a row. In most ticks they are the same as in the previous tick.
#[derive(Clone, Debug)]
pub(super) struct CachedFields<K> {
    /// The values of the fields. The same bits give the same fields.
    key: Option<K>,
    bytes: Vec<u8>,
}

impl<K: PartialEq> CachedFields<K> {
    /// Returns whether these are the fields of the key.
    pub fn are_of(&self, key: &K) -> bool {
        self.key.as_ref() == Some(key)
    }
}

impl<K> Default for CachedFields<K> {
    fn default() -> Self {
        Self {
            key: None,
            bytes: Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Debug;
    use std::str::FromStr;

    use proptest::prelude::*;

    use super::*;

    fn real<F: Float + Display>(value: F) -> String {
        let mut bytes = Vec::new();
        Row::new(&mut bytes).real(value).end();
        String::from_utf8(bytes).unwrap().trim_end().to_owned()
    }

    /// Checks that a float is as short as the standard library's form, in the same notation, and reads back to the same bits. The
    /// digits may differ between two equally short and equally near forms: the `f32` 40.0078125 is 40.007812 here, the even one.
    fn assert_like_the_standard_library<F>(value: F)
    where
        F: Float + Display + FromStr<Err: Debug> + PartialEq + Copy,
    {
        let (text, standard) = (real(value), value.to_string());
        let read: F = text.parse().unwrap();
        assert!(read == value, "{text}");
        let shape = |text: &str| text.replace(|char: char| char.is_ascii_digit(), "0");
        assert_eq!(shape(&text), shape(&standard), "{text}, {standard}");
    }

    proptest! {
        /// Covers arbitrary bits and typical values of a log.
        #[test]
        fn floats_are_as_short_as_can_be(
            bits: u64, short: u32, whole in -1e18..1e18_f64, usual in -100.0..100.0_f64,
        ) {
            let (double, single) = (f64::from_bits(bits), f32::from_bits(short));
            let usual = [whole.trunc(), usual, -0.0, 0.0, f64::MAX, f64::MIN_POSITIVE];
            for value in usual.into_iter().chain(double.is_finite().then_some(double)) {
                assert_like_the_standard_library(value);
            }
            for value in usual.map(|value| value as f32).into_iter().chain([single]) {
                if value.is_finite() {
                    assert_like_the_standard_library(value);
                }
            }
        }
    }

    #[test]
    fn non_finite_floats_are_written_like_the_standard_library() {
        assert_eq!(
            [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(real),
            ["NaN", "inf", "-inf"]
        );
    }

    #[test]
    fn fields() {
        let mut bytes = Vec::new();
        Row::new(&mut bytes)
            .number(7)
            .real(0.1_f32)
            .real(1e-7_f64)
            .real(100.0_f64)
            .optional(None::<u32>)
            .optional(Some(3))
            .flag(true)
            .hash(0xab)
            .hash(0xfedc_ba98_7654_3210)
            .text("")
            .text("a \"b\", c\nd")
            .end();
        assert_eq!(
            String::from_utf8(bytes).unwrap(),
            "7,0.1,0.0000001,100,,3,1,00000000000000ab,fedcba9876543210,,\"a \"\"b\"\", c d\"\n"
        );
    }
}

//! Round trips of every message; malformed bytes are rejected without a panic.

use proptest::prelude::*;

use super::*;
use crate::join::{JoinReply, JoinRequest};
use crate::process::ProcessNews;
use crate::team::Broadcast;
use crate::tick::{Report, ToAgent};
use crate::view::View;
use scenario::testkit::drawn;

/// Checks that the inline encoding equals bincode's for every initial buffer size.
fn check_inline<T: Serialize>(value: &T) -> Result<(), TestCaseError> {
    let bincode = bincode::serde::encode_to_vec(value, configuration::<LIMIT_BYTES>()).unwrap();
    let length = bincode.len();
    for room in [0, length / 2, length, length + 9] {
        let mut room = vec![7; room];
        prop_assert_eq!(encode_into(value, &mut room).unwrap(), length);
        prop_assert_eq!(&room[..length], &bincode[..]);
    }
    prop_assert_eq!(encoded_len(value).unwrap(), length);
    Ok(())
}

/// Checks that the message survives a round trip, and that decoding fails with one byte less or more.
fn check<T>(message: &T) -> Result<(), TestCaseError>
where
    T: Serialize + DeserializeOwned + PartialEq + std::fmt::Debug,
{
    check_inline(message)?;
    let mut bytes = encode(message).unwrap();
    prop_assert_eq!(&decode::<T>(&bytes).unwrap(), message);
    for length in 0..bytes.len() {
        let cut = decode::<T>(&bytes[..length]);
        prop_assert!(
            matches!(cut, Err(CodecError::Malformed(_))),
            "{} bytes: {:?}",
            length,
            cut
        );
    }
    bytes.push(0);
    let longer = decode::<T>(&bytes);
    prop_assert!(
        matches!(longer, Err(CodecError::Trailing(1))),
        "{:?}",
        longer
    );
    Ok(())
}

proptest! {
    /// Item by item, a sequence has the same items and is refused for the same bytes as at once.
    #[test]
    fn items_equal_the_decoded_sequence(
        sequence in prop::collection::vec((any::<u16>(), any::<f32>()), 0..9),
        cut in 0..60_usize,
        more in prop::collection::vec(any::<u8>(), 0..3),
    ) {
        const MOST: usize = 6;
        let mut bytes = encode(&sequence).unwrap();
        bytes.truncate(cut);
        bytes.extend(more);
        let whole = decode::<arrayvec::ArrayVec<(u16, f32), MOST>>(&bytes);
        let mut items = vec![(7_u16, 7.0_f32)];
        let result = decode_items(&bytes, MOST, &mut items);
        prop_assert_eq!(result.is_ok(), whole.is_ok());
        prop_assert_eq!(
            items.iter().map(|(count, value)| (*count, value.to_bits())).collect::<Vec<_>>(),
            whole.unwrap_or_default().iter().map(|(count, value)| (*count, value.to_bits())).collect::<Vec<_>>()
        );
    }

    #[test]
    fn messages_survive_a_round_trip(seed: u64) {
        check(&drawn::<ToAgent>(seed))?;
        check(&drawn::<Report>(seed))?;
        check(&drawn::<Broadcast>(seed))?;
        check(&drawn::<JoinRequest>(seed))?;
        check(&drawn::<JoinReply>(seed))?;
        check(&drawn::<ProcessNews>(seed))?;
        check(&drawn::<View>(seed))?;
    }

    /// Numbers of every width, near the limits of each, and all shapes of serde's data model.
    #[test]
    fn the_inline_encoding_of_every_shape_equals_bincode(bits in 0..=127_u32, off in 0..12_u128, text: String, letter: char, real: f64) {
        #[derive(Serialize)]
        enum Shape {
            Unit,
            One(i64),
            Pair(u8, i8),
            Named { map: std::collections::BTreeMap<u32, String>, bytes: [i16; 2] },
        }
        #[derive(Serialize)]
        struct Nothing;
        let big = ((1_u128 << bits) + off).wrapping_sub(6);
        let small = big as u64;
        check_inline(&(big, small, small as u32, small as u16, small as u8))?;
        check_inline(&(small as i64, small as i32, small as i16, small as i8, real, real as f32))?;
        let map = [(small as u32, text.clone())].into();
        let shapes = (Shape::Unit, Shape::One(small as i64), Shape::Pair(1, -1), Shape::Named { map, bytes: [-1, 300] });
        check_inline(&(Nothing, (), letter, Some(text), None::<u8>, shapes, vec![true; bits as usize * 3]))?;
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in any::<Vec<u8>>()) {
        let _ = decode::<ToAgent>(&bytes);
        let _ = decode::<Report>(&bytes);
        let _ = decode::<Broadcast>(&bytes);
        let _ = decode::<JoinRequest>(&bytes);
        let _ = decode::<JoinReply>(&bytes);
        let _ = decode::<ProcessNews>(&bytes);
        let _ = decode::<View>(&bytes);
    }

    /// Replaces one byte of a broadcast, which tests more code than arbitrary bytes.
    #[test]
    fn a_damaged_message_never_panics(seed: u64, place: prop::sample::Index, byte: u8) {
        let mut bytes = encode(&drawn::<Broadcast>(seed)).unwrap();
        *place.get_mut(&mut bytes) = byte;
        let _ = decode::<Broadcast>(&bytes);
    }
}

#[test]
fn too_large_to_send() {
    let text = "x".repeat(LIMIT_BYTES);
    assert!(matches!(encode(&text), Err(CodecError::TooLarge(size, _)) if size > LIMIT_BYTES));
}

#[test]
fn too_large_to_read() {
    let bytes = vec![0; LIMIT_BYTES + 1];
    assert!(matches!(
        decode::<String>(&bytes),
        Err(CodecError::TooLarge(..))
    ));
}

/// The first bytes announce 2^62 elements, and no element follows. The decoder must fail before it allocates memory for
/// them.
#[test]
fn an_announced_length_without_data_is_rejected() {
    let mut bytes = vec![253];
    bytes.extend((1_u64 << 62).to_le_bytes());
    assert!(matches!(
        decode::<Vec<u64>>(&bytes),
        Err(CodecError::Malformed(_))
    ));
    assert!(matches!(
        decode::<String>(&bytes),
        Err(CodecError::Malformed(_))
    ));
}

/// The text of serde has no marks of bincode around it.
#[test]
fn an_error_of_a_value_is_its_text() {
    #[derive(Debug)]
    struct Refused;
    impl<'de> serde::Deserialize<'de> for Refused {
        fn deserialize<D: serde::Deserializer<'de>>(_: D) -> Result<Self, D::Error> {
            Err(serde::de::Error::custom("at most 600 bytes"))
        }
    }
    let error = decode::<Refused>(&[]).unwrap_err();
    assert_eq!(error.to_string(), "malformed message: at most 600 bytes");
}

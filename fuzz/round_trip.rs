//! Properties of any bytes as bus messages. The fuzz target and the test over the corpus in `proto` use them.

use proto::codec::{decode, encode};
use proto::join::{JoinReply, JoinRequest};
use proto::process::ProcessNews;
use proto::team::Broadcast;
use proto::tick::{Report, ToAgent};
use proto::view::View;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Returns the names of the message types that the bytes decode to, as the corpus files begin.
///
/// A decoded message has one encoding, which decodes to the same message.
///
/// # Panics
/// Panics if that encoding is longer than the input or unstable.
#[must_use]
pub fn types_of(bytes: &[u8]) -> Vec<&'static str> {
    let types = [
        ("tick", round_trips::<ToAgent>(bytes)),
        ("report", round_trips::<Report>(bytes)),
        ("broadcast", round_trips::<Broadcast>(bytes)),
        ("join_request", round_trips::<JoinRequest>(bytes)),
        ("join_reply", round_trips::<JoinReply>(bytes)),
        ("process_news", round_trips::<ProcessNews>(bytes)),
        ("view", round_trips::<View>(bytes)),
    ];
    let fitting = types.into_iter().filter(|(_, round_trips)| *round_trips);
    fitting.map(|(name, _)| name).collect()
}

fn round_trips<T: Serialize + DeserializeOwned>(bytes: &[u8]) -> bool {
    let Ok(message) = decode::<T>(bytes) else {
        return false;
    };
    let once = encode(&message).expect("what was decoded can be encoded");
    assert!(
        once.len() <= bytes.len(),
        "no encoding is shorter than this one"
    );
    // Compares bytes, not messages, because NaN does not equal itself.
    let again = encode(&decode::<T>(&once).expect("what was encoded can be decoded"));
    assert_eq!(once, again.expect("the message can be encoded again"));
    true
}

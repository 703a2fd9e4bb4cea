//! What holds for any bytes; part of the fuzz target and of proto's test over the corpus.

use alliance_proto::codec::{decode, encode};
use alliance_proto::join::{JoinReply, JoinRequest};
use alliance_proto::process::ProcessNews;
use alliance_proto::team::Broadcast;
use alliance_proto::tick::{Report, ToAgent};
use alliance_proto::view::View;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Names of the types that these bytes are a message of, as the corpus's files begin. What decodes has one encoding, which
/// decodes to itself.
///
/// # Panics
/// When that is not so.
#[must_use]
pub fn types_of(bytes: &[u8]) -> Vec<&'static str> {
    let types = [
        ("tick", stands::<ToAgent>(bytes)),
        ("report", stands::<Report>(bytes)),
        ("broadcast", stands::<Broadcast>(bytes)),
        ("join_request", stands::<JoinRequest>(bytes)),
        ("join_reply", stands::<JoinReply>(bytes)),
        ("process_news", stands::<ProcessNews>(bytes)),
        ("view", stands::<View>(bytes)),
    ];
    let fitting = types.into_iter().filter(|(_, stands)| *stands);
    fitting.map(|(name, _)| name).collect()
}

fn stands<T: Serialize + DeserializeOwned>(bytes: &[u8]) -> bool {
    let Ok(message) = decode::<T>(bytes) else {
        return false;
    };
    let once = encode(&message).expect("what was decoded can be encoded");
    assert!(
        once.len() <= bytes.len(),
        "no encoding is shorter than this one"
    );
    // Bytes are compared, not messages: not every number equals itself.
    let again = encode(&decode::<T>(&once).expect("what was encoded can be decoded"));
    assert_eq!(once, again.expect("and encoded again"));
    true
}

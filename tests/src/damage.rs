//! The corpora of the fuzz targets, and random damages of messages and texts.

use std::ops::Range;
use std::path::Path;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// A change of bytes at a place.
pub type Damage = fn(&mut Vec<u8>, usize, &mut ChaCha8Rng);

/// The damages of a message.
pub const DAMAGES: [Damage; 4] = [flip, insert, repeat, lengthen];

/// Returns the files of a fuzz target by name: type, hyphen, description.
///
/// The `decode` corpus comes from a real mission plus rare messages, `control` from the examples of docs/CONTROL.md.
///
/// # Panics
/// Panics if there is no such corpus.
#[must_use]
pub fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus");
    let mut files: Vec<_> = std::fs::read_dir(folder.join(target))
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, std::fs::read(entry.path()).unwrap())
        })
        .collect();
    files.sort();
    assert!(!files.is_empty());
    files
}

/// Applies a random number of random damages.
pub fn apply(damages: &[Damage], bytes: &mut Vec<u8>, count: Range<usize>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(count) {
        let place = rng.random_range(0..bytes.len());
        damages[rng.random_range(0..damages.len())](bytes, place, rng);
    }
}

#[allow(clippy::ptr_arg)] // The same signature as the damages that change the length.
pub fn flip(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    bytes[place] ^= 1 << rng.random_range(0..8);
}

pub fn insert(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    bytes.insert(place, rng.random());
}

pub fn repeat(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    let from = rng.random_range(0..=place);
    bytes.extend_from_within(from..=place);
}

/// Overwrites a byte with a prefix of a number that has more than one byte.
#[allow(clippy::ptr_arg)] // The same signature as the other damages.
pub fn lengthen(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    bytes[place] = rng.random_range(250..=255);
}

/// Replaces a few bytes with a JSON token.
pub fn misspell(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    const TOKENS: [&str; 16] = [
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "\"",
        "\\u0000",
        "null",
        "true",
        "-",
        "0",
        "1e39",
        "1e400",
        "9999999999",
        "0.1e-46",
    ];
    let token = TOKENS[rng.random_range(0..TOKENS.len())];
    let until = (place + rng.random_range(0..4)).min(bytes.len());
    bytes.splice(place..until, token.bytes());
}

//! The fuzzer's corpus without the fuzzer: each of its messages, cut at every length, and damaged in many ways.

#![allow(clippy::unwrap_used)] // Also outside the test functions themselves.

use std::path::Path;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

#[path = "../../fuzz/round_trip.rs"]
mod round_trip;

/// Damaged copies of each message.
const DAMAGED: usize = 2000;

/// Messages of a real mission, and by hand such as it has none of, by file name: type, hyphen, what it is.
fn corpus() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus/decode");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, std::fs::read(entry.path()).unwrap())
        })
        .collect();
    files.sort();
    files
}

#[test]
fn every_message_of_the_corpus_is_one_of_its_type() {
    let corpus = corpus();
    assert!(!corpus.is_empty());
    for (name, bytes) in corpus {
        // Findings of the fuzzer are kept under the hashes that it names them by.
        if let Some((expected, _)) = name.split_once('-') {
            let types = round_trip::types_of(&bytes);
            assert!(types.contains(&expected), "{name}: {types:?}");
        }
    }
}

#[test]
fn damaged_messages_are_refused_or_stand() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (_, bytes) in corpus() {
        for length in 0..bytes.len() {
            let _ = round_trip::types_of(&bytes[..length]);
        }
        for _ in 0..DAMAGED {
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                let place = rng.random_range(0..damaged.len());
                match rng.random_range(0..4) {
                    0 => damaged[place] ^= 1 << rng.random_range(0..8),
                    // Lengths and numbers of more than one byte begin with one of these.
                    1 => damaged[place] = rng.random_range(250..=255),
                    2 => damaged.insert(place, rng.random()),
                    _ => {
                        let from = rng.random_range(0..=place);
                        damaged.extend_from_within(from..=place);
                    }
                }
            }
            let _ = round_trip::types_of(&damaged);
        }
    }
}

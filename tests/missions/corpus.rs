//! The fuzzers' corpora without the fuzzers: each of their messages, cut at every length, and damaged in many ways.

use std::path::Path;

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::codec::decode;
use alliance_proto::team::{Broadcast, Content};
use missions::Registry;
use missions::waste::data::WASTE;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

#[path = "../../fuzz/files.rs"]
mod files;
#[path = "../../fuzz/heard.rs"]
mod heard;
#[path = "../../fuzz/requests.rs"]
mod requests;
#[path = "../../fuzz/round_trip.rs"]
mod round_trip;
#[path = "../../fuzz/setups.rs"]
mod setups;

/// Damaged copies of each message.
const DAMAGED: usize = 2000;

/// Messages of a fuzz target by file name: type, hyphen, what it is. For `decode` those of a real mission, and by hand such as
/// it has none of; for `control` the examples of docs/CONTROL.md; for `setup` small ones.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
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

/// Calls this with every message of a corpus, cut at each length and with up to three damages of each of these sorts.
fn damage(
    target: &str,
    damages: &[fn(&mut Vec<u8>, usize, &mut ChaCha8Rng)],
    check: impl Fn(&[u8]),
) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (_, bytes) in corpus(target) {
        for length in 0..bytes.len() {
            check(&bytes[..length]);
        }
        for _ in 0..DAMAGED {
            let mut damaged = bytes.clone();
            for _ in 0..rng.random_range(1..4) {
                let place = rng.random_range(0..damaged.len());
                damages[rng.random_range(0..damages.len())](&mut damaged, place, &mut rng);
            }
            check(&damaged);
        }
    }
}

#[allow(clippy::ptr_arg)] // As the other sorts of damage, which change the length.
fn flip(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    bytes[place] ^= 1 << rng.random_range(0..8);
}

fn insert(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    bytes.insert(place, rng.random());
}

fn repeat(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    let from = rng.random_range(0..=place);
    bytes.extend_from_within(from..=place);
}

/// Lengths and numbers of more than one byte begin with one of these.
#[allow(clippy::ptr_arg)] // As the other sorts of damage.
fn lengthen(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
    bytes[place] = rng.random_range(250..=255);
}

/// What JSON is made of, in a place where it does not belong.
fn misspell(bytes: &mut Vec<u8>, place: usize, rng: &mut ChaCha8Rng) {
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

#[test]
fn every_message_of_the_corpus_is_one_of_its_type() {
    for (name, bytes) in corpus("decode") {
        // Findings of the fuzzer are kept under the hashes that it names them by.
        if let Some((expected, _)) = name.split_once('-') {
            let types = round_trip::types_of(&bytes);
            assert!(types.contains(&expected), "{name}: {types:?}");
        }
    }
    for (name, text) in corpus("control") {
        if let Some((expected, _)) = name.split_once('-') {
            assert_eq!(requests::command_of(&text), Some(expected), "{name}");
        }
    }
    for (name, text) in corpus("log") {
        if let Some((expected, _)) = name.split_once('-') {
            assert_eq!(files::log_of(&text), Some(expected), "{name}");
        }
    }
    type IsRead = fn(&[u8]) -> bool;
    let is_read: [(&str, IsRead); 4] = [
        ("parameters", files::is_parameters),
        ("profile", files::is_profile),
        ("plan", files::is_plan),
        ("journal", files::is_journal),
    ];
    for (target, is_read) in is_read {
        let read = |(name, text): (String, Vec<u8>)| name.contains('-').then(|| is_read(&text));
        assert!(
            corpus(target).into_iter().filter_map(read).all(|read| read),
            "{target}"
        );
    }
    for (name, text) in corpus("setup") {
        if let Some((expected, _)) = name.split_once('-') {
            assert_eq!(setups::kind_of(&text), Some(expected), "{name}");
        }
    }
}

/// What a mission's devices tell, its robots say and do: bytes of its own in ticks, broadcasts and reports. Names begin with the
/// mission's; those of the clean-up, which were first, do not.
#[test]
fn every_mission_has_messages_in_the_corpus() {
    let decode = corpus("decode");
    let heard = corpus("heard");
    for mission in Registry::built_in().vocabulary().missions.iter() {
        let has = |files: &[(String, Vec<u8>)], start: String| {
            assert!(
                files.iter().any(|(name, _)| name.starts_with(&start)),
                "{start}"
            );
        };
        let name = mission.name();
        if *mission == WASTE {
            continue;
        }
        for kind in ["tick", "broadcast", "report"] {
            has(&decode, format!("{kind}-{name}_"));
        }
        has(&heard, format!("{name}-"));
    }
}

#[test]
fn damaged_messages_are_refused_or_stand() {
    damage("decode", &[flip, insert, repeat, lengthen], |bytes| {
        let _ = round_trip::types_of(bytes);
    });
}

#[test]
fn damaged_requests_are_refused_or_stand() {
    damage("control", &[flip, insert, repeat, misspell], |text| {
        let _ = requests::command_of(text);
    });
}

#[test]
fn damaged_setups_and_scenarios_are_refused_or_stand() {
    damage("setup", &[flip, insert, misspell], |text| {
        let _ = setups::kind_of(text);
    });
}

#[test]
fn damaged_logs_are_refused_or_stand() {
    damage("log", &[flip, insert, misspell], |text| {
        let _ = files::log_of(text);
    });
}

#[test]
fn damaged_parameters_and_profiles_are_refused_or_stand() {
    damage("parameters", &[flip, insert, repeat], |text| {
        let _ = files::is_parameters(text);
    });
    damage("profile", &[flip, insert, misspell], |text| {
        let _ = files::is_profile(text);
    });
}

#[test]
fn damaged_files_of_sweeps_are_refused_or_stand() {
    damage("plan", &[flip, insert, misspell], |text| {
        let _ = files::is_plan(text);
    });
    damage("journal", &[flip, insert, misspell], |text| {
        let _ = files::is_journal(text);
    });
}

/// So that no kind of message that allocators have is left out.
#[test]
fn every_kind_of_allocation_message_is_in_the_corpus() {
    let mut kinds = std::collections::BTreeSet::new();
    for (_, bytes) in corpus("heard") {
        let broadcast: Broadcast = decode(&bytes).unwrap();
        if let Content::Allocation(message) = broadcast.body {
            // A kind that is not named here does not compile.
            kinds.insert(match message {
                AllocationMessage::Open(_) => "open".to_owned(),
                AllocationMessage::Ble(_) => "ble".to_owned(),
                AllocationMessage::Murdoch(word) => {
                    let word = format!("{:?}", word.word);
                    format!("murdoch {}", word.split(' ').next().unwrap())
                }
                AllocationMessage::Table(_) => "table".to_owned(),
                AllocationMessage::Deltas(_) => "deltas".to_owned(),
                AllocationMessage::Partition(_) => "partition".to_owned(),
            });
        }
    }
    // Four words of MURDOCH, and one kind of each of the others.
    assert_eq!(kinds.len(), 4 + 5, "{kinds:?}");
}

#[test]
fn whatever_a_teammate_says_a_robot_of_any_allocator_goes_on() {
    for (name, bytes) in corpus("heard") {
        assert!(heard::is_heard(&bytes), "{name}");
    }
    damage("heard", &[flip, insert, repeat, lengthen], |bytes| {
        let _ = heard::is_heard(bytes);
    });
}

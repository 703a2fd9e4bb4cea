//! The corpora of the fuzz targets without a fuzzer: each message whole, cut at many lengths, and damaged.

use alliance_tests::damage::{self, DAMAGES, Damage, corpus, flip, insert, misspell, repeat};
use missions::Registry;
use missions::waste::data::WASTE;
use proto::allocation::AllocationMessage;
use proto::codec::decode;
use proto::team::{Broadcast, BroadcastContent};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

#[path = "../../fuzz/files.rs"]
mod files;
#[path = "../../fuzz/received.rs"]
mod received;
#[path = "../../fuzz/requests.rs"]
mod requests;
#[path = "../../fuzz/round_trip.rs"]
mod round_trip;
#[path = "../../fuzz/setups.rs"]
mod setups;

/// The largest number of damaged copies of each message, and of lengths at which it is cut.
const DAMAGED: usize = 200;
const CUTS: usize = 400;

/// Calls `check` with each message of a corpus, cut at lengths over the whole message, and with up to three random damages.
fn damage(target: &str, damages: &[Damage], check: impl Fn(&[u8])) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for (_, bytes) in corpus(target) {
        for length in (0..bytes.len()).step_by(bytes.len().div_ceil(CUTS).max(1)) {
            check(&bytes[..length]);
        }
        for _ in 0..DAMAGED {
            let mut damaged = bytes.clone();
            damage::apply(damages, &mut damaged, 1..4, &mut rng);
            check(&damaged);
        }
    }
}

/// The name of a file begins with its type. Findings of the fuzzer have a hash as file name.
#[test]
fn every_corpus_file_is_of_its_type() {
    type TypesOf = fn(&[u8]) -> Vec<&'static str>;
    let targets: [(&str, TypesOf); 4] = [
        ("decode", round_trip::types_of),
        ("control", |text| Vec::from_iter(requests::command_of(text))),
        ("log", |text| Vec::from_iter(files::log_of(text))),
        ("setup", |text| Vec::from_iter(setups::kind_of(text))),
    ];
    for (target, types_of) in targets {
        for (name, bytes) in corpus(target) {
            if let Some((expected, _)) = name.split_once('-') {
                let types = types_of(&bytes);
                assert!(types.contains(&expected), "{target}/{name}: {types:?}");
            }
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
        for (name, text) in corpus(target) {
            assert!(!name.contains('-') || is_read(&text), "{target}/{name}");
        }
    }
}

/// Each mission has its own sensor readings, broadcasts and actions in the corpus. File names begin with the
/// mission's name, except those of the waste mission.
#[test]
fn every_mission_has_messages_in_the_corpus() {
    let (decode, received) = (corpus("decode"), corpus("received"));
    let has = |files: &[(String, Vec<u8>)], start: String| {
        let mut names = files.iter().map(|(name, _)| name);
        assert!(names.any(|name| name.starts_with(&start)), "{start}");
    };
    let missions = Registry::built_in().vocabulary().missions;
    for mission in missions.iter().filter(|mission| **mission != WASTE) {
        let name = mission.name();
        for kind in ["tick", "broadcast", "report"] {
            has(&decode, format!("{kind}-{name}_"));
        }
        has(&received, format!("{name}-"));
    }
}

#[test]
fn damaged_messages_requests_and_files_are_refused_or_readable() {
    damage("decode", &DAMAGES, |bytes| {
        let _ = round_trip::types_of(bytes);
    });
    damage("control", &[flip, insert, repeat, misspell], |text| {
        let _ = requests::command_of(text);
    });
    damage("parameters", &[flip, insert, repeat], |text| {
        let _ = files::is_parameters(text);
    });
    let file = |target: &str, read: fn(&[u8])| damage(target, &[flip, insert, misspell], read);
    file("setup", |text| _ = setups::kind_of(text));
    file("log", |text| _ = files::log_of(text));
    file("profile", |text| _ = files::is_profile(text));
    file("plan", |text| _ = files::is_plan(text));
    file("journal", |text| _ = files::is_journal(text));
}

#[test]
fn every_kind_of_allocation_message_is_in_the_corpus() {
    let mut kinds = std::collections::BTreeSet::new();
    for (_, bytes) in corpus("received") {
        let broadcast: Broadcast = decode(&bytes).unwrap();
        if let BroadcastContent::Allocation(message) = broadcast.body {
            // This match must name every kind to compile.
            kinds.insert(match message {
                AllocationMessage::Open(_) => "open".to_owned(),
                AllocationMessage::Ble(_) => "ble".to_owned(),
                AllocationMessage::Murdoch(message) => {
                    let text = format!("{:?}", message.word);
                    format!("murdoch {}", text.split(' ').next().unwrap())
                }
                AllocationMessage::Table(_) => "table".to_owned(),
                AllocationMessage::Deltas(_) => "deltas".to_owned(),
                AllocationMessage::Partition(_) => "partition".to_owned(),
                AllocationMessage::Ssi(_) => "ssi".to_owned(),
                AllocationMessage::Dhba(_) => "dhba".to_owned(),
                AllocationMessage::Impacts(_) => "impacts".to_owned(),
                AllocationMessage::Awareness(_) => "awareness".to_owned(),
            });
        }
    }
    // MURDOCH has four kinds, and there are nine others.
    assert_eq!(kinds.len(), 4 + 9, "{kinds:?}");
}

#[test]
fn a_robot_of_any_allocator_continues_after_any_broadcast() {
    for (name, bytes) in corpus("received") {
        assert!(received::accepts(&bytes), "{name}");
    }
    damage("received", &DAMAGES, |bytes| {
        let _ = received::accepts(bytes);
    });
}

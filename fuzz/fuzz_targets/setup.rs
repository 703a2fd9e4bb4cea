//! Arbitrary text as the setup of a run.json, or as a scenario file.
#![no_main]

#[path = "../setups.rs"]
mod setups;

libfuzzer_sys::fuzz_target!(|text: &[u8]| {
    let _ = setups::kind_of(text);
});

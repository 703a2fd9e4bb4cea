//! Arbitrary bytes as a teammate's broadcast, received by a robot of each allocator.
#![no_main]

#[path = "../received.rs"]
mod received;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = received::accepts(bytes);
});

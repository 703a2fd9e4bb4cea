//! Arbitrary bytes as a teammate's broadcast, received by a robot of each allocator.
#![no_main]

#[path = "../heard.rs"]
mod heard;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = heard::is_heard(bytes);
});

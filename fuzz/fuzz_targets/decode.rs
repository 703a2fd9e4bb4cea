//! Arbitrary bytes as every message of the bus.
#![no_main]

#[path = "../round_trip.rs"]
mod round_trip;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let _ = round_trip::types_of(bytes);
});

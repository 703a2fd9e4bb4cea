//! Arbitrary text as a request on the control topic.
#![no_main]

#[path = "../requests.rs"]
mod requests;

libfuzzer_sys::fuzz_target!(|text: &[u8]| {
    let _ = requests::command_of(text);
});

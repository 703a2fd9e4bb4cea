//! Arbitrary text as the plan of a sweep.
#![no_main]

#[path = "../files.rs"]
#[allow(dead_code)] // Each target uses one function of the file.
mod files;

libfuzzer_sys::fuzz_target!(|text: &[u8]| {
    let _ = files::is_plan(text);
});

//! Arbitrary text as a parameter file.
#![no_main]

#[path = "../files.rs"]
#[allow(dead_code)] // Each target uses one function of the file.
mod files;

libfuzzer_sys::fuzz_target!(|text: &[u8]| {
    let _ = files::is_parameters(text);
});

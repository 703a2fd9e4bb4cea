//! Files of the repository that are generated from Rust types.

use std::path::Path;

/// Compares a file, relative to the repository, with its generated text. With `ALLIANCE_WRITE_TYPES=1` it writes the file.
///
/// # Panics
/// Panics if they differ.
#[track_caller]
pub fn check_generated(file: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(file);
    if std::env::var_os("ALLIANCE_WRITE_TYPES").is_some_and(|value| value == "1") {
        std::fs::write(&path, text).expect("the repository is writable");
    }
    let stored = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        stored == text,
        "{file} is out of date: run this test with ALLIANCE_WRITE_TYPES=1"
    );
}

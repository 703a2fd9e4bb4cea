//! The files of weights that a scenario names.

use std::fs::File;
use std::io::{self, Read};

use scenario::{KeyPath, Problem, Scenario, Weights};

/// Replaces the names of files of weights by the bytes of the files.
///
/// # Errors
/// If a file cannot be read or is too large.
pub fn include_weights(scenario: &mut Scenario) -> Result<(), Problem> {
    scenario.include_weights(|allocator, file| {
        let at = || {
            KeyPath::new(["allocators"])
                .key(allocator)
                .key(Weights::KEY)
        };
        let bytes = read(file).map_err(|error| {
            let what = format!("cannot read '{file}': {error}");
            Problem::at(at(), what, "name a file, relative to the working directory")
        })?;
        if bytes.len() as u64 > Weights::MAX_BYTES {
            let what = format!("'{file}' is larger than {} bytes", Weights::MAX_BYTES);
            return Err(Problem::at(at(), what, "use a smaller network"));
        }
        Ok(bytes)
    })
}

/// Reads a file up to the first byte beyond the largest size.
fn read(file: &str) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(file)?
        .take(Weights::MAX_BYTES + 1)
        .read_to_end(&mut bytes)?;
    Ok(bytes)
}

//! The files in a sweep's folder.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use anyhow::Context;
use tempfile::Builder;

pub const PLAN: &str = "plan.toml";

pub const SCENARIO: &str = "scenario.toml";

pub const FAILURES: &str = "failures";

/// Writes a file atomically: concurrent readers and writers see either the old or the new contents.
///
/// # Errors
/// Returns an error if the file cannot be written; the old file then remains.
pub fn write_atomically(folder: &Path, name: &str, contents: &[u8]) -> anyhow::Result<()> {
    let path = folder.join(name);
    let written = Builder::new()
        .prefix(".new-")
        // The default mode would make the file readable by its owner only.
        .make_in(folder, |path| File::create_new(path))
        .and_then(|mut file| {
            file.write_all(contents)?;
            file.persist(&path).map_err(|error| error.error)?;
            Ok(())
        });
    written.with_context(|| format!("cannot write {}", path.display()))
}

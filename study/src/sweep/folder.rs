//! Files of a sweep's folder.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use anyhow::Context;
use tempfile::Builder;

/// The plan, as it was written.
pub const PLAN: &str = "plan.toml";

/// The scenario that is varied, every default filled in.
pub const SCENARIO: &str = "scenario.toml";

/// A folder in it with the scenarios of failed runs.
pub const FAILURES: &str = "failures";

/// Writes a file as a whole: readers, and other processes that write the same, see the old or the new one, never a part.
///
/// # Errors
/// When it cannot be written; then the old one is still there.
pub fn put(folder: &Path, name: &str, contents: &[u8]) -> anyhow::Result<()> {
    let path = folder.join(name);
    let written = Builder::new()
        .prefix(".new-")
        // By itself it would be readable by its owner only.
        .make_in(folder, |path| File::create_new(path))
        .and_then(|mut file| {
            file.write_all(contents)?;
            file.persist(&path).map_err(|error| error.error)?;
            Ok(())
        });
    written.with_context(|| format!("cannot write {}", path.display()))
}

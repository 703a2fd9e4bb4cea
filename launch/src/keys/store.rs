//! Writes the keys of a team into a folder of their own.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::Path;

use anyhow::{Context, bail};

use super::make::KeyFile;

/// Refuses a folder that is there: keys are not made twice for one team, for the old ones would no longer fit.
///
/// # Errors
/// When something of that name is there.
pub fn refuse_existing(folder: &Path) -> anyhow::Result<()> {
    if folder.symlink_metadata().is_ok() {
        bail!(
            "{}: is there already; remove it first, or name another folder with --out",
            folder.display()
        );
    }
    Ok(())
}

/// Makes the folder with all the files, each for its owner alone: whole or not at all.
///
/// # Errors
/// When it is there already, or the file system refuses.
pub fn write(folder: &Path, files: &[KeyFile]) -> anyhow::Result<()> {
    refuse_existing(folder)?;
    let name = || folder.display().to_string();
    let whole = std::path::absolute(folder).with_context(name)?;
    let (Some(parent), Some(_)) = (whole.parent(), whole.file_name()) else {
        bail!("{}: is no name for a folder", folder.display());
    };
    let beside = tempfile::Builder::new()
        .prefix(".alliance-keys-")
        .permissions(fs::Permissions::from_mode(0o700))
        .tempdir_in(parent)
        .with_context(name)?;
    for file in files {
        let at = || format!("{}/{}", folder.display(), file.name);
        let mut open = OpenOptions::new();
        let open = open.write(true).create_new(true).mode(0o600);
        let mut written = open.open(beside.path().join(&file.name)).with_context(at)?;
        written.write_all(file.text.as_bytes()).with_context(at)?;
    }
    fs::rename(beside.path(), &whole).with_context(name)?;
    // It has another name now: there is nothing left to remove.
    let _ = beside.keep();
    Ok(())
}

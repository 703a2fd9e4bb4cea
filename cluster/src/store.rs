//! The folder of a team's keys.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::os::unix::fs::{OpenOptionsExt, PermissionsExt};
use std::path::Path;

use anyhow::{Context, bail};
use scenario::Problem;

use crate::certificates::KeyFile;

/// Refuses an existing folder. New keys would invalidate the team's old ones.
pub fn refuse_existing(folder: &Path) -> anyhow::Result<()> {
    if folder.symlink_metadata().is_ok() {
        let remedy = "remove it first, or name another folder with --out";
        bail!(Problem::with_source(
            folder.display().to_string(),
            "already exists",
            remedy
        ));
    }
    Ok(())
}

/// Creates the folder with all files, complete or not at all. Only the owner can read them.
pub fn write(folder: &Path, files: &[KeyFile]) -> anyhow::Result<()> {
    refuse_existing(folder)?;
    let name = || folder.display().to_string();
    let absolute = std::path::absolute(folder).with_context(name)?;
    let (Some(parent), Some(_)) = (absolute.parent(), absolute.file_name()) else {
        bail!("{}: is not a valid folder name", folder.display());
    };
    let temporary = tempfile::Builder::new()
        .prefix(".alliance-keys-")
        .permissions(fs::Permissions::from_mode(0o700))
        .tempdir_in(parent)
        .with_context(name)?;
    for file in files {
        let at = || format!("{}/{}", folder.display(), file.name);
        let mut open = OpenOptions::new();
        let open = open.write(true).create_new(true).mode(0o600);
        let mut written = open
            .open(temporary.path().join(&file.name))
            .with_context(at)?;
        written.write_all(file.text.as_bytes()).with_context(at)?;
    }
    fs::rename(temporary.path(), &absolute).with_context(name)?;
    // The temporary folder has been renamed, so it must not be removed.
    let _ = temporary.keep();
    Ok(())
}

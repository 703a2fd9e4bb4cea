//! A file that appears at its path only when it is complete.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use tempfile::{Builder, NamedTempFile};

/// A file under a temporary name in the target folder. An unfinished file is removed. Readers never see a partial file,
/// and an older file remains until the new one is complete.
pub struct NewFile {
    file: NamedTempFile,
    path: PathBuf,
}

impl NewFile {
    /// Creates the temporary file for `path`.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let file = Builder::new()
            .prefix(".alliance-new-")
            // The default mode would allow only the owner to read it.
            .make_in(folder, |path| File::create_new(path))
            .with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self {
            file,
            path: path.to_owned(),
        })
    }

    pub fn writer(&mut self) -> BufWriter<&mut File> {
        BufWriter::new(self.file.as_file_mut())
    }

    /// Moves the file to its path.
    pub fn put_in_place(self) -> anyhow::Result<()> {
        self.file
            .persist(&self.path)
            .map_err(|error| error.error)
            .with_context(|| format!("cannot write {}", self.path.display()))?;
        Ok(())
    }
}

/// Writes a file atomically: concurrent readers and writers see either the old or the new contents.
///
/// # Errors
/// Returns an error if the file cannot be written; the old file then remains.
pub fn write_atomically(path: &Path, contents: &[u8]) -> anyhow::Result<()> {
    let mut file = NewFile::create(path)?;
    let written = file.file.write_all(contents);
    written.with_context(|| format!("cannot write {}", path.display()))?;
    file.put_in_place()
}

/// Creates a folder and its parents, if it does not exist.
pub fn make_folder(folder: &Path) -> anyhow::Result<()> {
    let name = folder.display();
    let cannot = || format!("cannot make {name}; choose another folder with --out");
    fs::create_dir_all(folder).with_context(cannot)
}

//! A file that appears at its path only when it is complete.

use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
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

    /// Writes the contents with a function, and flushes them.
    ///
    /// # Errors
    /// Returns the error of the function, or one line with the path and the cause if the file cannot be written.
    pub fn write(
        &mut self,
        write: impl FnOnce(&mut Output<&mut File>) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut output = Output::new(self.file.as_file_mut(), &self.path);
        let written = write(&mut output).and_then(|()| Ok(output.flush()?));
        written.map_err(without_repetition)
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

/// A buffered writer whose errors name a path, for writers of formats that return only the cause.
pub struct Output<W: Write> {
    writer: BufWriter<W>,
    path: PathBuf,
}

/// The error of an [`Output`]. The cause is no source, so that a chain of errors contains it once.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {cause}", .path.display())]
struct WriteError {
    path: PathBuf,
    cause: io::Error,
}

impl<W: Write> Output<W> {
    pub fn new(writer: W, path: &Path) -> Self {
        Self {
            writer: BufWriter::new(writer),
            path: path.to_owned(),
        }
    }

    fn with_path<T>(&self, done: io::Result<T>) -> io::Result<T> {
        done.map_err(|cause| {
            let path = self.path.clone();
            io::Error::new(cause.kind(), WriteError { path, cause })
        })
    }
}

impl<W: Write> Write for Output<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.writer.write(bytes);
        self.with_path(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        let flushed = self.writer.flush();
        self.with_path(flushed)
    }
}

impl<W: Write + Seek> Seek for Output<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let place = self.writer.seek(to);
        self.with_path(place)
    }
}

/// Returns only the error of an [`Output`] if it is among the causes of an error. Writers of formats wrap and repeat it.
pub fn without_repetition(error: anyhow::Error) -> anyhow::Error {
    let found = error.chain().find_map(|cause| {
        let of_output = cause.downcast_ref::<io::Error>()?.get_ref()?;
        let of_output = of_output.downcast_ref::<WriteError>()?;
        Some(anyhow!("{of_output}"))
    });
    found.unwrap_or(error)
}

/// Writes a file atomically: concurrent readers and writers see either the old or the new contents.
///
/// # Errors
/// Returns an error if the file cannot be written; the old file then remains.
pub fn write_atomically(path: &Path, contents: &[u8]) -> anyhow::Result<()> {
    let mut file = NewFile::create(path)?;
    file.write(|output| Ok(output.write_all(contents)?))?;
    file.put_in_place()
}

/// Creates a folder and its parents, if it does not exist.
pub fn make_folder(folder: &Path) -> anyhow::Result<()> {
    let name = folder.display();
    let cannot = || format!("cannot make {name}; choose another folder with --out");
    fs::create_dir_all(folder).with_context(cannot)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the error of a write. Every write to this device fails as on a full disk.
    fn write_to_full() -> io::Error {
        let device = File::options().write(true).open("/dev/full").unwrap();
        let mut output = Output::new(device, Path::new("out/file"));
        let written = output.write_all(b"text").and_then(|()| output.flush());
        written.unwrap_err()
    }

    /// Writers of formats wrap the cause in several errors, or repeat it.
    #[test]
    fn a_full_disk_gives_one_line_with_the_path_and_the_cause() {
        let line = "cannot write out/file: No space left on device (os error 28)";
        let plain = anyhow::Error::from(write_to_full());
        let of_film = anyhow::Error::from(gif::EncodingError::Io(write_to_full()));
        let of_table = parquet::errors::ParquetError::from(write_to_full());
        let of_table = anyhow::Error::from(of_table).context("the table");
        for error in [plain, of_film, of_table] {
            assert_eq!(format!("{:#}", without_repetition(error)), line);
        }
        let other = without_repetition(anyhow!("no such tick").context("run"));
        assert_eq!(format!("{other:#}"), "run: no such tick");
    }

    /// The contents may fit into the buffer of the writer, so that only the flush can fail.
    #[test]
    fn a_file_that_cannot_be_flushed_is_not_put_in_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_atomically(&path, b"old").unwrap();
        let mut file = NewFile::create(&path).unwrap();
        // A file without the right to write fails like a full disk.
        *file.file.as_file_mut() = File::open(&path).unwrap();
        let error = file.write(|output| Ok(output.write_all(b"new")?));
        let error = format!("{:#}", error.unwrap_err());
        let start = format!("cannot write {}: ", path.display());
        assert!(error.starts_with(&start), "{error}");
        drop(file);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(folder.path().read_dir().unwrap().count(), 1);
    }
}

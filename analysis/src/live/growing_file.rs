//! A text file that another process appends to.

use std::fs::File;
use std::io::{ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use anyhow::Context;

/// A file with the position up to which it has been read.
pub struct GrowingFile {
    path: PathBuf,
    /// The position after the last complete line that was returned.
    position: u64,
}

impl GrowingFile {
    pub fn new(path: PathBuf) -> Self {
        Self { path, position: 0 }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the complete lines since the last call; none while the file does not exist.
    pub fn new_lines(&mut self) -> anyhow::Result<Vec<u8>> {
        let lines = self
            .read()
            .with_context(|| self.path.display().to_string())?;
        self.position += lines.len() as u64;
        Ok(lines)
    }

    fn read(&self) -> std::io::Result<Vec<u8>> {
        let mut file = match File::open(&self.path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            Err(error) => return Err(error),
        };
        file.seek(SeekFrom::Start(self.position))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let end = bytes.iter().rposition(|byte| *byte == b'\n');
        bytes.truncate(end.map_or(0, |end| end + 1));
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn an_incomplete_line_is_read_later() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("rows.csv");
        let mut file = GrowingFile::new(path.clone());
        assert_eq!(file.new_lines().unwrap(), b"");
        let mut written = File::create(&path).unwrap();
        for (added, expected) in [
            ("a\nb", "a\n"),
            ("", ""),
            ("c\n\nd", "bc\n\n"),
            ("\n", "d\n"),
        ] {
            written.write_all(added.as_bytes()).unwrap();
            assert_eq!(file.new_lines().unwrap(), expected.as_bytes());
        }
    }
}

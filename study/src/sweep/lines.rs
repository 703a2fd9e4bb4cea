//! A file of lines that say what has been done so far: JSON, each written in one piece, with a checksum.
//!
//! A process that is killed leaves at most a part of a last line, which is dropped.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::Serialize;
use xxhash_rust::xxh3::xxh3_64;

/// Such a file that is being written. It is locked as long as it is open.
pub struct Lines {
    file: File,
    path: PathBuf,
}

impl Lines {
    /// Opens it, and gives what it holds but for a torn last line; begins it if it is new.
    ///
    /// # Errors
    /// When another process writes it, or it cannot be written.
    pub fn open(path: PathBuf) -> anyhow::Result<(Self, Vec<u8>)> {
        let cannot = || format!("cannot write {}", path.display());
        let mut file = OpenOptions::new()
            .read(true)
            .append(true)
            .create(true)
            .open(&path)
            .with_context(cannot)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => bail!(
                "{} is being written by another process; wait for its end, or name another folder with --out",
                path.display()
            ),
            Err(TryLockError::Error(error)) => return Err(error).with_context(cannot),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).with_context(cannot)?;
        let whole = whole_lines(&bytes).len();
        if whole < bytes.len() {
            file.set_len(whole as u64).with_context(cannot)?;
            file.seek(std::io::SeekFrom::End(0)).with_context(cannot)?;
            bytes.truncate(whole);
        }
        Ok((Self { file, path }, bytes))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a line, in one piece, so that a kill leaves all of it, a part of it, or nothing.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn add(&mut self, line: &impl Serialize) -> anyhow::Result<()> {
        let mut text = seal(&serde_json::to_string(line)?);
        text.push('\n');
        self.file
            .write_all(text.as_bytes())
            .with_context(|| format!("cannot write {}", self.path.display()))
    }
}

/// Before and behind the checksum of a line, which is 16 hexadecimal digits.
const SUM: (&str, &str) = (",\"sum\":\"", "\"}");

/// A table in JSON with one more entry, the checksum of the text without it.
pub(super) fn seal(text: &str) -> String {
    let sum = xxh3_64(text.as_bytes());
    let open = text.strip_suffix('}').unwrap_or(text);
    format!("{open}{}{sum:016x}{}", SUM.0, SUM.1)
}

/// The text that was sealed, or one from before there were seals; `None` if it is not what was written.
fn unseal(line: &str) -> Option<String> {
    let sealed = line
        .strip_suffix(SUM.1)
        .and_then(|line| line.rsplit_once(SUM.0));
    match sealed {
        None => Some(line.to_owned()),
        Some((open, _)) => {
            let text = format!("{open}}}");
            (seal(&text) == line).then_some(text)
        }
    }
}

/// The text of a line, if nobody has changed it.
///
/// # Errors
/// Its number, and what is wrong with it.
pub fn intact(number: usize, line: &[u8]) -> Result<String, (usize, String)> {
    str::from_utf8(line)
        .ok()
        .and_then(unseal)
        .ok_or_else(|| (number, "it is not as it was written".to_owned()))
}

/// Lines with their numbers, from 1; those that are empty and what follows the last end of a line left out.
pub fn numbered(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let lines = whole_lines(bytes).split(|byte| *byte == b'\n').enumerate();
    lines
        .map(|(place, line)| (place + 1, line))
        .filter(|(_, line)| !line.is_empty())
}

/// All but a torn last line.
fn whole_lines(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    &bytes[..end.map_or(0, |end| end + 1)]
}

//! A file of JSON lines, each written at once and with a checksum.
//!
//! A killed process leaves at most one incomplete last line, which the reader drops.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde::Serialize;
use serde::de::DeserializeOwned;
use xxhash_rust::xxh3::xxh3_64;

/// A file of lines that is open for writing. The file stays locked while it is open.
pub struct LineFile {
    file: File,
    path: PathBuf,
}

impl LineFile {
    /// Opens or creates the file. Returns its contents without an incomplete last line, which is removed from the file.
    ///
    /// # Errors
    /// Returns an error if another process writes the file, or it cannot be written.
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

    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Appends a line with one write, so that a kill leaves all of it, a part of it, or nothing.
    pub fn add(&mut self, line: &impl Serialize) -> anyhow::Result<()> {
        let mut text = seal(&serde_json::to_string(line)?);
        text.push('\n');
        self.file
            .write_all(text.as_bytes())
            .with_context(|| format!("cannot write {}", self.path.display()))
    }
}

/// The text before and after the checksum of a line, which has 16 hexadecimal digits.
const SUM: (&str, &str) = (",\"sum\":\"", "\"}");

/// Adds the checksum of a JSON object's text as its last entry.
pub(super) fn seal(text: &str) -> String {
    let sum = xxh3_64(text.as_bytes());
    let open = text.strip_suffix('}').unwrap_or(text);
    format!("{open}{}{sum:016x}{}", SUM.0, SUM.1)
}

/// Returns the text without its checksum, or a text without checksum as it is. Returns `None` if the checksum does not match.
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

/// Parses a line whose checksum matches. `refusal` precedes the problem of an invalid line.
///
/// # Errors
/// Returns the line number and the problem in one line.
pub fn parse_line<T: DeserializeOwned>(
    (number, line): (usize, &[u8]),
    refusal: &str,
) -> Result<T, (usize, String)> {
    let Some(text) = str::from_utf8(line).ok().and_then(unseal) else {
        let what = "the line was changed after it was written";
        return Err((number, what.to_owned()));
    };
    serde_json::from_str(&text).map_err(|error| {
        // serde's messages quote the input.
        let what = format!("{refusal}{error}").replace(char::is_control, " ");
        (number, what)
    })
}

/// Returns the lines with their numbers, from 1. Empty lines and an incomplete last line are omitted.
pub fn numbered_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    let lines = whole_lines(bytes).split(|byte| *byte == b'\n').enumerate();
    lines
        .map(|(place, line)| (place + 1, line))
        .filter(|(_, line)| !line.is_empty())
}

/// Returns the input without an incomplete last line.
fn whole_lines(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    &bytes[..end.map_or(0, |end| end + 1)]
}

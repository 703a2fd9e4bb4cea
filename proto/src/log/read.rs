//! Reads a run's folder back, as far as it is whole.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::ids::Tick;
use crate::scenario::Vocabulary;
use crate::time::SimTime;
use xxhash_rust::xxh3::Xxh3;

use super::foreign::{self, ForeignAnswer};
use super::input::InputLine;
use super::level::LogLevel;
use super::memory::{Document, Memory};
use super::rows::{TableRow, parse_hash};
use super::run_file::{RunFile, RunOutcome};
use super::section::{RUN_SECTION, WORLD};
use super::table::Table;

/// A folder that cannot be read as a run.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system refuses.
    #[error("cannot read {}: {error}", path.display())]
    Read {
        /// What.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A file that is not what its name says.
    #[error("{}: {reason}", path.display())]
    Malformed {
        /// Which.
        path: PathBuf,
        /// Where and why.
        reason: String,
    },
}

/// The last word of ticks.csv about a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seal {
    /// The tick.
    pub tick: Tick,
    /// Its simulated time.
    pub now: SimTime,
    /// Hash of the run up to and including it.
    pub hash: u64,
}

/// A run's log up to the last tick that is whole in every table.
///
/// A run that ended well is whole to its end: `last` then has the hash that run.json states.
#[derive(Debug)]
pub struct RunLog {
    /// run.json.
    pub run: RunFile,
    /// Last whole tick; `None` when there is none, and at [`LogLevel::Off`], which seals nothing.
    pub last: Option<Seal>,
    /// The table that is whole for fewer ticks than ticks.csv tells of, and so ends the log; where there are several, the one that ends first.
    pub torn: Option<Table>,
    folder: PathBuf,
    /// What is whole of each table; an entry for every one.
    tables: BTreeMap<Table, Vec<u8>>,
}

impl RunLog {
    /// Reads the log in a run's folder.
    ///
    /// # Errors
    /// [`ReadError`] when run.json is missing or malformed, or a file exists but cannot be read. Torn, damaged and missing
    /// tables are no error: the log is then shorter.
    pub fn open(folder: &Path, vocabulary: &Vocabulary) -> Result<Self, ReadError> {
        let path = folder.join(Document::Run.file_name());
        let text = fs::read(&path).map_err(|error| ReadError::Read {
            path: path.clone(),
            error,
        })?;
        let run = RunFile::parse(&text, vocabulary)
            .map_err(|reason| ReadError::Malformed { path, reason })?;

        let mut tables = BTreeMap::new();
        for table in Table::ALL.into_iter().filter(|table| run.log.keeps(*table)) {
            let path = folder.join(table.file_name());
            match fs::read(&path) {
                Ok(bytes) => {
                    tables.insert(table, bytes);
                }
                Err(error) if error.kind() == io::ErrorKind::NotFound => {}
                Err(error) => return Err(ReadError::Read { path, error }),
            }
        }
        Ok(Self::from_tables(folder, run, tables))
    }

    /// The log that a recorder has left in memory.
    ///
    /// # Errors
    /// [`ReadError::Malformed`] when it has no run.json.
    pub fn from_memory(memory: &Memory, vocabulary: &Vocabulary) -> Result<Self, ReadError> {
        let text = memory.documents.get(&Document::Run);
        let text = text.map_or("", String::as_str).as_bytes();
        let run = RunFile::parse(text, vocabulary).map_err(|reason| ReadError::Malformed {
            path: PathBuf::from(Document::Run.file_name()),
            reason,
        })?;
        Ok(Self::from_tables(Path::new(""), run, memory.tables.clone()))
    }

    /// The log that is in `tables`; `folder` is where errors say it is.
    #[must_use]
    pub fn from_tables(folder: &Path, run: RunFile, mut tables: BTreeMap<Table, Vec<u8>>) -> Self {
        for table in Table::ALL {
            tables.entry(table).or_default();
        }
        let (last, torn) = if run.log == LogLevel::Off {
            for (table, bytes) in &mut tables {
                bytes.truncate(whole_rows(*table, bytes).map(<[u8]>::len).sum());
            }
            (None, None)
        } else {
            cut(&mut tables)
        };
        Self {
            run,
            last,
            torn,
            folder: folder.to_owned(),
            tables,
        }
    }

    /// The bytes of a table, header line included, as far as it is whole.
    #[must_use]
    pub fn table(&self, table: Table) -> &[u8] {
        &self.tables[&table]
    }

    /// The rows of a table; none of a table that the log's level leaves out.
    ///
    /// # Errors
    /// [`ReadError::Malformed`] for a row that is not of this table.
    pub fn rows<R: TableRow>(&self) -> Result<Vec<R>, ReadError> {
        self.each_row().collect()
    }

    /// The same, one row after the other: a long run has millions.
    pub fn each_row<R: TableRow>(&self) -> impl Iterator<Item = Result<R, ReadError>> {
        csv::Reader::from_reader(self.tables[&R::TABLE].as_slice())
            .into_deserialize()
            .map(|row| row.map_err(|error| self.malformed(R::TABLE, &error)))
    }

    /// The inputs, in order.
    ///
    /// # Errors
    /// [`ReadError::Malformed`] for a line that is not an input.
    pub fn inputs(&self) -> Result<Vec<InputLine>, ReadError> {
        whole_lines(&self.tables[&Table::Inputs])
            .map(serde_json::from_slice)
            .collect::<Result<_, _>>()
            .map_err(|error| self.malformed(Table::Inputs, &error))
    }

    /// The answers of robots whose minds are programs of their own, by tick and robot.
    ///
    /// # Errors
    /// [`ReadError::Malformed`] for what is no answer.
    pub fn foreign(&self) -> Result<Vec<ForeignAnswer>, ReadError> {
        if self.torn == Some(Table::Foreign) && self.run.outcome != RunOutcome::Running {
            let whole = self.last.map_or(0, |seal| seal.tick + 1);
            let ticks = self.run.result.ticks;
            return Err(ReadError::Malformed {
                path: self.folder.join(Table::Foreign.file_name()),
                reason: format!(
                    "it is missing, cut or damaged: its answers are whole for {whole} of {ticks} ticks"
                ),
            });
        }
        foreign::read(&self.tables[&Table::Foreign])
            .map_err(|error| self.malformed(Table::Foreign, &error))
    }

    fn malformed(&self, table: Table, reason: &dyn std::error::Error) -> ReadError {
        ReadError::Malformed {
            path: self.folder.join(table.file_name()),
            // A name or number that is none may have anything in it.
            reason: reason.to_string().replace(char::is_control, " "),
        }
    }
}

/// Everything that one seal says.
struct SealRows {
    seal: Seal,
    /// Length of ticks.csv with the seal, bytes.
    end: usize,
    /// Hashes of the tables that had grown.
    tables: BTreeMap<String, u64>,
}

/// Cuts every table where the last tick ends that is whole in all of them, and returns that tick's seal, and the table that ends it
/// before ticks.csv does.
fn cut(tables: &mut BTreeMap<Table, Vec<u8>>) -> (Option<Seal>, Option<Table>) {
    let seals = seals(&tables[&Table::Ticks]);
    let ends: BTreeMap<Table, Vec<usize>> = tables
        .iter()
        .map(|(&table, bytes)| match table {
            Table::Ticks => (table, seals.iter().map(|seal| seal.end).collect()),
            _ => (table, table_ends(table, bytes, &seals)),
        })
        .collect();
    let first = ends.iter().min_by_key(|(_, ends)| ends.len());
    let (first, whole) = first.map_or((None, 0), |(table, ends)| (Some(*table), ends.len()));
    let torn = first.filter(|_| whole < seals.len());
    for (table, bytes) in tables {
        let end = match whole.checked_sub(1) {
            Some(last) => ends[table][last],
            None => header_length(*table, bytes),
        };
        bytes.truncate(end);
    }
    let last = whole.checked_sub(1).and_then(|last| seals.get(last));
    (last.map(|last| last.seal), torn)
}

/// Length of a table's header line, if it has a whole one.
fn header_length(table: Table, bytes: &[u8]) -> usize {
    match table.header() {
        Some(header) if bytes.starts_with(header.as_bytes()) => header.len(),
        Some(_) => 0,
        None => whole_lines(bytes).next().map_or(0, <[u8]>::len),
    }
}

/// The seals of ticks.csv up to its first torn or malformed row.
fn seals(bytes: &[u8]) -> Vec<SealRows> {
    let mut seals = Vec::new();
    let mut end = header_length(Table::Ticks, bytes);
    if end == 0 {
        return seals;
    }
    let lines = whole_lines(bytes).skip(1);
    let mut hashes = BTreeMap::new();
    for line in lines {
        let Some((seal, robot, section)) = tick_row(line) else {
            break;
        };
        end += line.len();
        if robot == WORLD && section == RUN_SECTION {
            let tables = std::mem::take(&mut hashes);
            seals.push(SealRows { seal, end, tables });
        } else if robot == WORLD {
            hashes.insert(section.to_owned(), seal.hash);
        }
    }
    seals
}

/// Splits a row of ticks.csv, none of whose fields is ever quoted.
fn tick_row(line: &[u8]) -> Option<(Seal, &str, &str)> {
    let mut fields = str::from_utf8(line).ok()?.trim_end().split(',');
    let mut next = || fields.next();
    let (now, tick, robot, section, hash) = (next()?, next()?, next()?, next()?, next()?);
    let seal = Seal {
        tick: tick.parse().ok()?,
        now: SimTime(now.parse().ok()?),
        hash: parse_hash(hash)?,
    };
    next().is_none().then_some((seal, robot, section))
}

/// Where each seal ends in a table, for as many seals as the table is whole.
fn table_ends(table: Table, bytes: &[u8], seals: &[SealRows]) -> Vec<usize> {
    let mut rows = whole_rows(table, bytes);
    let mut hash = Xxh3::new();
    let mut end = 0;
    let mut ends = Vec::new();
    for seal in seals {
        if let Some(&wanted) = seal.tables.get(table.file_name()) {
            loop {
                let Some(row) = rows.next() else {
                    return ends;
                };
                hash.update(row);
                end += row.len();
                if hash.digest() == wanted {
                    break;
                }
            }
        }
        ends.push(end);
    }
    ends
}

/// What a table consists of, its header line first, without a torn last one.
fn whole_rows(table: Table, bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let (lines, frames) = match table {
        Table::Foreign => (&[][..], bytes),
        _ => (bytes, &[][..]),
    };
    whole_lines(lines).chain(foreign::whole_frames(frames))
}

/// The lines of a file with their line ends, without a torn last one.
fn whole_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes
        .split_inclusive(|&byte| byte == b'\n')
        .filter(|line| line.ends_with(b"\n"))
}

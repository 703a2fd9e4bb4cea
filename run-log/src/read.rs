//! Reader of a run folder, up to its last complete tick.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use scenario::Vocabulary;
use scenario::ids::Tick;
use scenario::time::SimTime;
use xxhash_rust::xxh3::Xxh3;

use super::column::parse_hash;
use super::external::{self, ExternalAnswer};
use super::input::InputLine;
use super::level::LogLevel;
use super::memory::{Document, MemoryLog};
use super::read_error::{ReadError, malformed, no_run};
use super::read_rows::{RowSource, Rows};
use super::rows::TableRow;
use super::run_file::{RunFile, RunOutcome};
use super::section::{RUN_SECTION, WORLD_ROBOT};
use super::table::Table;

/// The last row of ticks.csv for a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seal {
    pub tick: Tick,
    pub now: SimTime,
    /// The hash of the run up to and including the tick.
    pub hash: u64,
}

/// Missing, changed or added rows in the log of a run that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the log is damaged: {file} agrees with its seals for {whole} of the {ticks} ticks in run.json"
)]
pub struct Damage {
    pub file: &'static str,
    /// The number of complete ticks.
    pub whole: u64,
    /// The number of ticks of the run.
    pub ticks: u64,
}

/// A run's log up to the last tick that is complete in every table.
///
/// The log of a run that ended normally is complete. The hash of `last` then equals the hash in run.json.
#[derive(Debug)]
pub struct RunLog {
    pub run: RunFile,
    /// The last complete tick. `None` if there is no such tick, and at [`LogLevel::Off`], which writes no seals.
    pub last: Option<Seal>,
    /// The table that ends before ticks.csv and therefore limits the log. If there are several, the one that ends
    /// first.
    pub torn: Option<Table>,
    /// The tables whose files continue after the last complete tick, and files of tables that the log level excludes.
    /// Readers of this type do not see these bytes. In a run that has not ended, later rows of any table are normal.
    pub excess: Vec<Table>,
    /// The size of the tables of every tick, bytes, if [`RunLog::open_within`] left them out.
    pub unread: Option<u64>,
    /// The text of run.json.
    run_json: Vec<u8>,
    folder: PathBuf,
    /// The complete part of every table.
    tables: BTreeMap<Table, Vec<u8>>,
    /// The rest of each table that was cut off.
    rests: BTreeMap<Table, Vec<u8>>,
    /// The times of the sealed ticks up to `last`.
    times: Vec<SimTime>,
}

impl RunLog {
    /// Reads the log of a run folder. Incomplete, damaged and missing tables only shorten it.
    ///
    /// # Errors
    /// Returns a [`ReadError`] if run.json is missing or malformed, or if an existing file cannot be read.
    pub fn open(folder: &Path, vocabulary: &Vocabulary) -> Result<Self, ReadError> {
        Self::open_within(folder, vocabulary, u64::MAX)
    }

    /// Reads the log like [`RunLog::open`]. If the tables that a summary does not have exceed `bytes_max` together, it
    /// leaves them out: they may not fit into memory.
    ///
    /// # Errors
    /// Returns the errors of [`RunLog::open`].
    pub fn open_within(
        folder: &Path,
        vocabulary: &Vocabulary,
        bytes_max: u64,
    ) -> Result<Self, ReadError> {
        let path = folder.join(Document::Run.file_name());
        let text = fs::read(&path).map_err(|error| no_run(folder, &path, error))?;
        let run = RunFile::parse(&text, vocabulary)
            .map_err(|reason| ReadError::Malformed { path, reason })?;

        let of_every_tick = |table: Table| run.log.keeps(table) && !LogLevel::Summary.keeps(table);
        let bytes = Table::ALL.into_iter().filter(|table| of_every_tick(*table));
        let bytes = bytes.filter_map(|table| folder.join(table.file_name()).metadata().ok());
        let bytes: u64 = bytes.map(|file| file.len()).sum();
        let unread = (bytes > bytes_max && run.log.has_every_tick()).then_some(bytes);
        let mut tables = BTreeMap::new();
        let mut excluded = Vec::new();
        // ticks.csv is written last and read first, so that the other tables of a live run are never behind it.
        for table in Table::ALL.into_iter().rev() {
            let path = folder.join(table.file_name());
            if !run.log.keeps(table) {
                if path.exists() {
                    excluded.push(table);
                }
                continue;
            }
            if unread.is_some() && of_every_tick(table) {
                continue;
            }
            match fs::read(&path) {
                Ok(bytes) => {
                    tables.insert(table, bytes);
                }
                Err(error) if error.kind() == io::ErrorKind::NotFound => {
                    tables.insert(table, Vec::new());
                }
                Err(error) => return Err(ReadError::Read { path, error }),
            }
        }
        let mut log = Self::from_read_tables(folder, run, tables);
        log.unread = unread;
        log.excess.append(&mut excluded);
        log.run_json = text;
        Ok(log)
    }

    /// Reads the log that a recorder has left in memory.
    ///
    /// # Errors
    /// Returns [`ReadError::Malformed`] if the log has no run.json.
    pub fn from_memory(memory: &MemoryLog, vocabulary: &Vocabulary) -> Result<Self, ReadError> {
        let text = memory.documents.get(&Document::Run);
        let text = text.map_or("", String::as_str).as_bytes();
        let run = RunFile::parse(text, vocabulary).map_err(|reason| ReadError::Malformed {
            path: PathBuf::from(Document::Run.file_name()),
            reason,
        })?;
        let mut log = Self::from_tables(Path::new(""), run, memory.tables.clone());
        log.run_json = text.to_vec();
        Ok(log)
    }

    /// Creates a log from the contents of its tables. Error messages name `folder` as the location.
    #[must_use]
    pub fn from_tables(folder: &Path, run: RunFile, mut tables: BTreeMap<Table, Vec<u8>>) -> Self {
        for table in Table::ALL {
            tables.entry(table).or_default();
        }
        Self::from_read_tables(folder, run, tables)
    }

    /// Creates a log from the contents of the tables that were read. The others are empty, and not compared with their
    /// seals.
    fn from_read_tables(folder: &Path, run: RunFile, mut tables: BTreeMap<Table, Vec<u8>>) -> Self {
        let lengths = |tables: &BTreeMap<Table, Vec<u8>>| -> Vec<(Table, usize)> {
            let lengths = tables.iter().map(|(table, bytes)| (*table, bytes.len()));
            lengths.collect()
        };
        let before = lengths(&tables);
        let is_running = run.outcome == RunOutcome::Running;
        let Cut {
            seals,
            torn,
            later,
            rests,
        } = if run.log == LogLevel::Off {
            for (table, bytes) in &mut tables {
                bytes.truncate(whole_rows(*table, bytes).map(<[u8]>::len).sum());
            }
            Cut::default()
        } else {
            cut(&mut tables, run.log, is_running)
        };
        let last = seals.last().copied();
        let mut times: Vec<SimTime> = seals.into_iter().map(|seal| seal.now).collect();
        // The last tick can be sealed again.
        times.dedup();
        let pairs = before.into_iter().zip(lengths(&tables));
        let excess = pairs.filter(|(before, after)| before != after);
        let excess = excess.map(|((table, _), _)| table);
        let excess = excess.filter(|table| !(is_running && later.contains(table)));
        let excess = excess.collect();
        for table in Table::ALL {
            tables.entry(table).or_default();
        }
        Self {
            run_json: run.to_json().into_bytes(),
            run,
            last,
            torn,
            excess,
            unread: None,
            folder: folder.to_owned(),
            tables,
            rests,
            times,
        }
    }

    /// Returns run.json as it was written, also with keys that [`RunFile`] does not have.
    #[must_use]
    pub fn run_json(&self) -> serde_json::Value {
        // The text was parsed before.
        serde_json::from_slice(&self.run_json).unwrap_or_default()
    }

    /// Returns the complete part of a table as it was written, including the header line. [`RunLog::full_table`] also has
    /// the rows that a compact log does not write.
    #[must_use]
    pub fn table(&self, table: Table) -> &[u8] {
        &self.tables[&table]
    }

    /// Returns a table with the rest that was cut off, also damaged rows.
    #[must_use]
    pub fn whole_table(&self, table: Table) -> Vec<u8> {
        let rest = self.rests.get(&table).map_or(&[][..], Vec::as_slice);
        [self.table(table), rest].concat()
    }

    /// Returns whether the log contains every value of every tick, and it was read.
    #[must_use]
    pub fn has_every_tick(&self) -> bool {
        self.run.log.has_every_tick() && self.unread.is_none()
    }

    /// Returns the rows of a table; none for a table that the log level omits.
    pub fn rows<R: TableRow>(&self) -> Result<Vec<R>, ReadError> {
        self.each_row().collect()
    }

    /// Iterates over the rows of a table. A long run has millions of rows, too many for memory. The rows of a compact log
    /// are the same as those of a full log.
    #[must_use]
    pub fn each_row<R: TableRow>(&self) -> Rows<'_, R> {
        let source = RowSource {
            run: &self.run,
            folder: &self.folder,
            bytes: self.table(R::TABLE),
            times: &self.times,
        };
        Rows::new(source)
    }

    /// Returns the inputs in order. Those of a damaged log of an ended run go on after the last complete tick, up to
    /// their own damage, so that a replay repeats the run.
    pub fn inputs(&self) -> Result<Vec<InputLine>, ReadError> {
        whole_lines(&self.tables[&Table::Inputs])
            .map(serde_json::from_slice)
            .collect::<Result<_, _>>()
            .map_err(|error| malformed(&self.folder, Table::Inputs, &error))
    }

    /// Returns the answers of external controllers, by tick and robot.
    pub fn external_answers(&self) -> Result<Vec<ExternalAnswer>, ReadError> {
        if self.torn == Some(Table::External) && self.run.outcome != RunOutcome::Running {
            let whole = self.last.map_or(0, |seal| seal.tick + 1);
            let ticks = self.run.result.ticks;
            return Err(ReadError::Malformed {
                path: self.folder.join(Table::External.file_name()),
                reason: format!(
                    "the file is missing, truncated or damaged: it has complete answers for {whole} of {ticks} ticks"
                ),
            });
        }
        external::read(&self.tables[&Table::External])
            .map_err(|error| malformed(&self.folder, Table::External, &error))
    }

    /// Returns the damage of the log of a run that has ended. Such a log contains each of its ticks, and nothing else.
    #[must_use]
    pub fn damage(&self) -> Option<Damage> {
        let ticks = self.run.result.ticks;
        let whole = self.last.map_or(0, |seal| seal.tick + 1);
        let is_whole = self.torn.is_none() && whole == ticks && self.excess.is_empty();
        if self.run.outcome == RunOutcome::Running || self.run.log == LogLevel::Off || is_whole {
            return None;
        }
        let table = self.torn.or_else(|| self.excess.first().copied());
        Some(Damage {
            file: table.unwrap_or(Table::Ticks).file_name(),
            whole,
            ticks,
        })
    }
}

/// The rows of ticks.csv that belong to one seal.
struct SealRows {
    seal: Seal,
    /// The length of ticks.csv up to and including the seal, bytes.
    end: usize,
    /// The hashes of the tables that grew since the previous seal.
    tables: BTreeMap<String, u64>,
}

/// The part of a log up to its last complete tick.
#[derive(Default)]
struct Cut {
    /// The seals up to the last complete tick.
    seals: Vec<Seal>,
    /// The table that ends before ticks.csv, if there is one.
    torn: Option<Table>,
    /// The tables of which the removed part begins after the last complete tick.
    later: Vec<Table>,
    /// The removed part of each table.
    rests: BTreeMap<Table, Vec<u8>>,
}

/// Truncates all tables after the last tick that is complete in each. Without them, a replay of an ended run would have
/// other inputs and answers, so these are only truncated after their own last complete tick.
fn cut(tables: &mut BTreeMap<Table, Vec<u8>>, level: LogLevel, is_running: bool) -> Cut {
    let seals = seals(&tables[&Table::Ticks], level);
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
    let last = whole.checked_sub(1).map(|last| seals[last].seal.now);
    let (mut later, mut rests) = (Vec::new(), BTreeMap::new());
    for (&table, bytes) in tables {
        let is_repeated = !is_running && matches!(table, Table::Inputs | Table::External);
        let own = ends[&table].last().filter(|_| is_repeated).copied();
        let end = own.unwrap_or_else(|| match whole.checked_sub(1) {
            Some(last) => ends[&table][last],
            None => header_length(table, bytes, level),
        });
        if begins_after(table, &bytes[end..], last) {
            later.push(table);
        }
        rests.insert(table, bytes.split_off(end));
    }
    let whole = seals.into_iter().take(whole);
    Cut {
        seals: whole.map(|rows| rows.seal).collect(),
        torn,
        later,
        rests,
    }
}

/// Returns whether the first whole row of this part of a table is of a time after `last`, ms.
fn begins_after(table: Table, part: &[u8], last: Option<SimTime>) -> bool {
    // Inputs and answers can belong to later ticks, and messages in flight to earlier ones.
    if matches!(table, Table::Inputs | Table::External | Table::Messages) {
        return true;
    }
    let lines = whole_lines(part).filter_map(|line| str::from_utf8(line).ok());
    let mut times = lines.filter_map(|line| line.split(',').next());
    // A table without rows of complete ticks begins with its header here.
    let first = times.find_map(|time| time.parse().ok());
    first.is_none_or(|first| last.is_none_or(|last| SimTime(first) > last))
}

/// Returns the length of a table's header line, or 0 if the line is incomplete.
fn header_length(table: Table, bytes: &[u8], level: LogLevel) -> usize {
    match table.header_at(level) {
        Some(header) if bytes.starts_with(header.as_bytes()) => header.len(),
        Some(_) => 0,
        None => whole_lines(bytes).next().map_or(0, <[u8]>::len),
    }
}

/// Returns the seals of ticks.csv up to the first incomplete or malformed row. A compact log has a seal for each tick,
/// and its seals end before the first missing one.
fn seals(bytes: &[u8], level: LogLevel) -> Vec<SealRows> {
    let mut seals: Vec<SealRows> = Vec::new();
    let mut end = header_length(Table::Ticks, bytes, level);
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
        if robot == WORLD_ROBOT && section == RUN_SECTION {
            let before = seals.last().map(|rows| rows.seal);
            if level == LogLevel::Compact && !seal.follows(before) {
                break;
            }
            let tables = std::mem::take(&mut hashes);
            seals.push(SealRows { seal, end, tables });
        } else if robot == WORLD_ROBOT {
            hashes.insert(section.to_owned(), seal.hash);
        }
    }
    seals
}

impl Seal {
    /// Returns whether no tick is missing between the seals. The last tick can be sealed again.
    fn follows(&self, before: Option<Self>) -> bool {
        match before {
            None => self.tick == 0,
            Some(before) if before.tick == self.tick => before.now == self.now,
            Some(before) => before.tick + 1 == self.tick && before.now < self.now,
        }
    }
}

/// Splits a row of ticks.csv. Its fields never contain quotes.
fn tick_row(line: &[u8]) -> Option<(Seal, &str, &str)> {
    let mut fields = str::from_utf8(line).ok()?.strip_suffix('\n')?.split(',');
    let mut next = || fields.next();
    let (now, tick, robot, section, hash) = (next()?, next()?, next()?, next()?, next()?);
    let seal = Seal {
        tick: tick.parse().ok()?,
        now: SimTime(now.parse().ok()?),
        hash: parse_hash(hash)?,
    };
    next().is_none().then_some((seal, robot, section))
}

/// Returns the end of each seal's data in a table, for the seals up to which the table is complete.
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

/// Returns the header line and the complete rows or frames of a table.
fn whole_rows(table: Table, bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let (lines, frames) = match table {
        Table::External => (&[][..], bytes),
        _ => (bytes, &[][..]),
    };
    whole_lines(lines).chain(external::whole_frames(frames))
}

/// Returns the complete lines of a file with their line ends.
fn whole_lines(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    bytes
        .split_inclusive(|&byte| byte == b'\n')
        .filter(|line| line.ends_with(b"\n"))
}

//! The encoded but unwritten part of each table, and the seals between ticks.

use crate::{LogLevel, RUN_SECTION, Table};
use prefetch::prefetch;
use scenario::mission::columns::Column;
use scenario::mission::registry::Mission;
use xxhash_rust::xxh3::Xxh3;

use super::RecordError;
use super::repeated::RowCache;
use super::row::{Fields, Row};
use super::sink::Sink;

#[derive(Clone)]
pub(super) struct Pages {
    level: LogLevel,
    /// The columns of mission.csv after the time.
    mission_columns: &'static [Column],
    /// The unwritten part of each table, in the order of [`Table::ALL`].
    tables: [Page; Table::ALL.len()],
    /// The hash of each table from its first byte on, in the same order; empty if the log has no seals.
    hashes: Vec<Xxh3>,
    /// The number of unwritten bytes of all tables. Each tick reads it, and a sum over the tables reads a cache line of each.
    waiting: usize,
}

/// The unwritten part of a table and the state of the whole table.
#[derive(Clone, Default)]
struct Page {
    bytes: Vec<u8>,
    grown: bool,
    begun: bool,
}

impl Pages {
    pub fn new(level: LogLevel, mission: Mission) -> Self {
        let mut pages = Self {
            level,
            mission_columns: mission.vocabulary().columns,
            tables: Default::default(),
            hashes: if level.keeps(Table::Ticks) {
                vec![Xxh3::default(); Table::ALL.len()]
            } else {
                Vec::new()
            },
            waiting: 0,
        };
        for table in Table::ALL.into_iter().filter(|table| !table.is_optional()) {
            pages.begin(table);
        }
        pages
    }

    /// Requests the memory that a tick of a run without tables reads, see [`prefetch`](mod@prefetch).
    #[inline]
    pub fn prefetch(&self) {
        prefetch(&self.level);
        prefetch(&self.waiting);
    }

    /// Adds the header line of a table, once.
    fn begin(&mut self, table: Table) {
        let begun = &mut self.tables[table as usize].begun;
        if std::mem::replace(begun, true) {
            return;
        }
        let columns = self.mission_columns;
        let header = table.header_at(self.level);
        self.add(table, |bytes| match header {
            Some(header) => bytes.extend_from_slice(header.as_bytes()),
            None => {
                let columns = columns.iter().map(|column| column.name);
                let columns = ["t_ms"].into_iter().chain(columns);
                columns
                    .fold(Row::new(bytes), |row, name| row.text(name))
                    .end();
            }
        });
    }

    /// Adds rows to a table that exists only if it has rows.
    pub fn add_optional(&mut self, table: Table, rows: impl FnOnce(&mut Vec<u8>)) {
        if self.level.keeps(table) {
            self.begin(table);
            self.add(table, rows);
        }
    }

    /// Adds rows to a table if the log level includes it.
    pub fn add(&mut self, table: Table, rows: impl FnOnce(&mut Vec<u8>)) {
        if self.level.keeps(table) {
            let page = &mut self.tables[table as usize];
            let start = page.bytes.len();
            rows(&mut page.bytes);
            let added = &page.bytes[start..];
            if let Some(hash) = self.hashes.get_mut(table as usize) {
                hash.update(added);
            }
            page.grown |= !added.is_empty();
            self.waiting += added.len();
        }
    }

    /// Adds a hash as a row of ticks.csv.
    #[inline(always)]
    pub fn add_hash(&mut self, tick: &Fields, robot: &Fields, section: &'static str, hash: u64) {
        self.add(Table::Ticks, |rows| {
            let row = Row::new(rows).fields(tick).fields(robot);
            row.word(section).hash(hash).end();
        });
    }

    /// Adds a seal that marks the tick as complete in every table. `run` is the hash of the run so far.
    pub fn seal(&mut self, repeated: &RowCache, run: u64) {
        let (tick, world) = (&repeated.tick, &repeated.world);
        for table in Table::ALL
            .into_iter()
            .filter(|table| *table != Table::Ticks)
        {
            let page = &mut self.tables[table as usize];
            if std::mem::take(&mut page.grown)
                && let Some(hash) = self.hashes.get(table as usize)
            {
                let hash = hash.digest();
                self.add_hash(tick, world, table.file_name(), hash);
            }
        }
        self.add_hash(tick, world, RUN_SECTION, run);
    }

    pub fn waiting(&self) -> usize {
        self.waiting
    }

    /// Writes all encoded bytes to the sink, ticks.csv last.
    ///
    /// # Errors
    /// Returns errors of the sink. The tables after the failed one are not written.
    pub fn write_to(&mut self, sink: &mut dyn Sink) -> Result<(), RecordError> {
        for (table, page) in Table::ALL.into_iter().zip(&mut self.tables) {
            if !page.bytes.is_empty() {
                sink.append(table, &page.bytes)?;
                self.waiting -= page.bytes.len();
                page.bytes.clear();
            }
        }
        Ok(())
    }
}

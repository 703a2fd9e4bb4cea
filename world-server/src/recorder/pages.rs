//! What is encoded of each table but not yet written, and the seals that go between the ticks.

use alliance_proto::log::{LogLevel, RUN_SECTION, Table};
use alliance_proto::mission::columns::Column;
use alliance_proto::mission::known::Mission;
use xxhash_rust::xxh3::Xxh3;

use super::RecordError;
use super::repeated::Repeated;
use super::row::{Fields, Row};
use super::sink::Sink;

/// The tables of a run.
pub(super) struct Pages {
    level: LogLevel,
    /// Those of mission.csv after the time.
    mission_columns: &'static [Column],
    /// In the order of [`Table::ALL`].
    tables: [Page; Table::ALL.len()],
}

/// The end of a table.
#[derive(Default)]
struct Page {
    /// What is not written yet.
    bytes: Vec<u8>,
    /// Hash of the table from its first byte on.
    hash: Xxh3,
    /// Whether something came after the last seal.
    grown: bool,
    /// Whether the header line is there.
    begun: bool,
}

impl Pages {
    /// Tables with nothing but header lines.
    pub fn new(level: LogLevel, mission: Mission) -> Self {
        let mut pages = Self {
            level,
            mission_columns: mission.terms().columns,
            tables: Default::default(),
        };
        for table in Table::ALL.into_iter().filter(|table| !table.is_optional()) {
            pages.begin(table);
        }
        pages
    }

    /// Writes the header line of a table.
    fn begin(&mut self, table: Table) {
        let begun = &mut self.tables[table as usize].begun;
        if std::mem::replace(begun, true) {
            return;
        }
        let columns = self.mission_columns;
        self.add(table, |bytes| match table.header() {
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

    /// Adds rows to a table that is there only if it has rows.
    pub fn add_optional(&mut self, table: Table, rows: impl FnOnce(&mut Vec<u8>)) {
        self.begin(table);
        self.add(table, rows);
    }

    /// Adds rows to a table, if the level keeps it.
    pub fn add(&mut self, table: Table, rows: impl FnOnce(&mut Vec<u8>)) {
        if self.level.keeps(table) {
            let page = &mut self.tables[table as usize];
            let start = page.bytes.len();
            rows(&mut page.bytes);
            page.hash.update(&page.bytes[start..]);
            page.grown |= page.bytes.len() > start;
        }
    }

    /// Adds a row to ticks.csv.
    #[inline(always)]
    pub fn add_hash(&mut self, tick: &Fields, robot: &Fields, section: &'static str, hash: u64) {
        self.add(Table::Ticks, |rows| {
            let row = Row::new(rows).fields(tick).fields(robot);
            row.word(section).hash(hash).end();
        });
    }

    /// Declares the tick whole in every table; `run` is the hash of the run so far.
    pub fn seal(&mut self, repeated: &Repeated, run: u64) {
        let (tick, world) = (&repeated.tick, &repeated.world);
        for table in Table::ALL
            .into_iter()
            .filter(|table| *table != Table::Ticks)
        {
            let page = &mut self.tables[table as usize];
            if std::mem::take(&mut page.grown) {
                let hash = page.hash.digest();
                self.add_hash(tick, world, table.file_name(), hash);
            }
        }
        self.add_hash(tick, world, RUN_SECTION, run);
    }

    /// Bytes that wait to be written.
    pub fn waiting(&self) -> usize {
        self.tables.iter().map(|page| page.bytes.len()).sum()
    }

    /// Hands what waits to the sink, ticks.csv last.
    ///
    /// # Errors
    /// Those of the sink; the tables after the one that failed are not written.
    pub fn write_to(&mut self, sink: &mut dyn Sink) -> Result<(), RecordError> {
        for (table, page) in Table::ALL.into_iter().zip(&mut self.tables) {
            if !page.bytes.is_empty() {
                sink.append(table, &page.bytes)?;
                page.bytes.clear();
            }
        }
        Ok(())
    }
}

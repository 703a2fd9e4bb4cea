//! The documents of a log, and a log that is kept in memory.

use std::collections::BTreeMap;

use super::table::Table;

/// A file that is written as a whole and can be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Document {
    /// The description and results of the run: [`super::RunFile`].
    Run,
    /// Machine-dependent data: process ids, ports, wall-clock times, rejected messages.
    Host,
}

impl Document {
    /// Returns the file name in the run folder.
    #[must_use]
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Run => "run.json",
            Self::Host => "host.json",
        }
    }
}

/// A log in memory, for runs that are only compared.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MemoryLog {
    /// The contents of the tables so far.
    pub tables: BTreeMap<Table, Vec<u8>>,
    pub documents: BTreeMap<Document, String>,
}

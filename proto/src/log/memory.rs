//! The files of a log that are written as a whole, and a log without files.

use std::collections::BTreeMap;

use super::table::Table;

/// A file that is written as a whole, and may be written again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Document {
    /// The run: [`super::RunFile`].
    Run,
    /// What belongs to this machine and this hour: process ids, ports, wall-clock times, refused messages.
    Host,
}

impl Document {
    /// Name in the run's folder.
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
pub struct Memory {
    /// Contents of the tables written so far.
    pub tables: BTreeMap<Table, Vec<u8>>,
    /// The documents.
    pub documents: BTreeMap<Document, String>,
}

//! The log of a run: encoding, and files in [`Folder`].
//!
//! The readings and reports of each robot are hashed section by section when its report arrives ([`Answers`]). After
//! every tick the simulation passes a [`TickRecord`] to the [`Recorder`]. Its encoder adds the tick to the hash of the
//! run and adds rows to the tables of the [`LogLevel`]. The recorder writes them out in large pieces. For a full or
//! compact log of separate processes this happens in the [`BackgroundRecorder`]. [`RunLog`](crate::RunLog) reads a
//! folder back.
//!
//! **Seals.** ticks.csv is written last and marks the valid part of the log. Besides the hash of each
//! [`Section`](crate::Section), a sealed tick has a row for each table that has grown. The row belongs to the
//! robot `world`; its section is the table's file name, and its hash covers the table's bytes so far, including the header.
//! The last row of the tick has the section `run` and the hash of the run so far. A reader of a killed process's log thus
//! finds the last tick up to which every table is complete. [`LogLevel::Full`] and [`LogLevel::Compact`] seal each
//! tick. A compact log has no hashes of sections. [`LogLevel::Summary`] seals the first tick of each second of simulated
//! time and the last tick of the run.

mod allocation_messages;
mod answers;
mod background;
mod changed_rows;
mod encode;
mod encoder;
mod events;
mod hash;
mod in_flight;
mod names;
mod pages;
mod record;
mod repeated;
mod row;
mod section_hash;
mod sink;
mod tally;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use crate::{BranchOrigin, Document, LogLevel, RunFile, RunOutcome};
use prefetch::Layer;
use proto::codec::CodecError;
use proto::event::EventLine;
use proto::tick::Outcome;
use scenario::Setup;
use scenario::ids::Tick;

use encoder::Encoder;

pub use answers::{Answer, Answers, Deliveries};
pub use background::BackgroundRecorder;
pub use events::EventCollector;
pub use record::{BodyRecord, Event, EventKind, FaultEvent, FaultHits, TickRecord};
pub(crate) use row::Row;
pub use section_hash::SectionHash;
pub use sink::{Folder, Sink};
pub use tally::Ending;

const FLUSH_BYTES: usize = 64 * 1024;

#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    #[error("cannot write {}: {error}", path.display())]
    Write { path: PathBuf, error: io::Error },
    #[error("{} already holds a run", .0.display())]
    FolderInUse(PathBuf),
    /// A consequence of an earlier failed write. Rows after the torn one would not be valid.
    #[error("the log is incomplete after a failed write")]
    Broken,
    #[error("cannot start a thread for the log: {0}")]
    Thread(io::Error),
    /// An answer of an external controller that foreign.bin cannot contain.
    #[error("foreign.bin: the answer of {robot} in tick {tick}: {error}")]
    Answer {
        robot: String,
        tick: Tick,
        error: CodecError,
    },
}

impl RecordError {
    fn write(path: &Path, error: io::Error) -> Self {
        Self::Write {
            path: path.to_owned(),
            error,
        }
    }
}

pub trait Record {
    /// Adds a tick. Ticks arrive in order, each exactly once.
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError>;
}

pub struct Recorder<S> {
    encoder: Encoder,
    sink: S,
    broken: bool,
}

impl<S: Sink> Recorder<S> {
    /// Starts a log: writes run.json with the outcome "running", and the header lines of the tables.
    pub fn new(setup: &Setup, level: LogLevel, sink: S) -> Result<Self, RecordError> {
        Self::with_controller_versions(setup, level, &BTreeMap::new(), sink)
    }

    /// Starts a log like [`Recorder::new`], with the known versions of external controllers by name.
    pub fn with_controller_versions(
        setup: &Setup,
        level: LogLevel,
        versions: &BTreeMap<String, String>,
        sink: S,
    ) -> Result<Self, RecordError> {
        let mut recorder = Self {
            encoder: Encoder::new(setup, level, versions),
            sink,
            broken: false,
        };
        // Written first, because a folder without run.json is not readable.
        recorder.write_run(RunOutcome::Running, Ending::default())?;
        recorder.flush()?;
        Ok(recorder)
    }

    /// Returns a copy with the same state and another sink, if the level is [`LogLevel::Off`], else `None`.
    #[must_use]
    pub fn copied<T: Sink>(&self, sink: T) -> Option<Recorder<T>> {
        Some(Recorder {
            encoder: self.encoder.without_tables()?,
            sink,
            broken: self.broken,
        })
    }

    /// Requests the memory of a layer, see [`prefetch`](mod@prefetch).
    #[inline]
    pub fn prefetch(&self, layer: Layer) {
        self.encoder.prefetch(layer);
    }

    /// Marks the run as a branch, before its first tick.
    pub fn set_branch(&mut self, origin: BranchOrigin) -> Result<(), RecordError> {
        self.encoder.set_branch(origin);
        self.write_run(RunOutcome::Running, Ending::default())?;
        Ok(())
    }

    /// Writes everything encoded so far to the sink, ticks.csv last.
    ///
    /// # Errors
    /// Returns errors of the sink, and [`RecordError::Broken`] after that.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        if self.broken {
            return Err(RecordError::Broken);
        }
        let written = self.encoder.write_to(&mut self.sink);
        self.broken = written.is_err();
        written
    }

    /// Returns the hash of the run so far, 16 hexadecimal digits. It covers all sections of all ticks at any [`LogLevel`].
    #[must_use]
    pub fn hash(&self) -> String {
        self.encoder.hash()
    }

    /// Writes host.json: data that a repetition of the run does not reproduce.
    pub fn write_host(&mut self, host: &serde_json::Value) -> Result<(), RecordError> {
        self.sink.replace(Document::Host, &format!("{host:#}\n"))
    }

    /// Ends the log: writes the remaining rows, including messages in flight, and the final run.json, which it returns. If messages
    /// in flight follow the last seal, the last tick is sealed again.
    pub fn finish(&mut self, outcome: Outcome, ending: Ending) -> Result<RunFile, RecordError> {
        self.encoder.finish();
        self.flush()?;
        self.write_run(RunOutcome::Ended(outcome), ending)
    }

    /// Returns the rows of events.csv since the last call, at any [`LogLevel`]. The first call returns none.
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.encoder.take_events()
    }

    #[must_use]
    pub fn sink(&self) -> &S {
        &self.sink
    }

    #[must_use]
    pub fn into_sink(self) -> S {
        self.sink
    }

    fn write_run(&mut self, outcome: RunOutcome, ending: Ending) -> Result<RunFile, RecordError> {
        let run = self.encoder.run_file(outcome, ending);
        self.sink.replace(Document::Run, &run.to_json())?;
        Ok(run)
    }
}

impl<S: Sink> Record for Recorder<S> {
    /// Records a tick, and calls [`Recorder::flush`] when enough bytes are buffered.
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        if let Err(error) = self.encoder.add(record) {
            self.broken = true;
            return Err(error);
        }
        if self.encoder.waiting() >= FLUSH_BYTES {
            self.flush()?;
        }
        Ok(())
    }
}

//! The log of a run (DESIGN §8): encoding here, files in [`Folder`] alone.
//!
//! What a robot senses and does is hashed section by section when its report comes ([`Answers`]). After every tick the
//! simulation hands a [`TickRecord`] to the [`Recorder`]. Its encoder adds the tick to the hash of the run and rows to the tables that the
//! [`LogLevel`] keeps, and it writes them out in large pieces; a full log of a run by processes is made in the [`Background`].
//! [`RunLog`](alliance_proto::log::RunLog) reads a folder back.
//!
//! **Seals.** ticks.csv is written last and tells what counts. Beside the hash of each [`Section`](alliance_proto::log::Section) it holds, of the robot
//! `world`, for each table that has grown a row with the table's file name as its section and the hash of the table's bytes
//! up to here, header included; and then a row with the section `run` and the hash of the run so far, which ends the
//! tick. So whatever a killed process leaves behind, a reader finds the last tick up to which every table is whole.
//! At [`LogLevel::Full`] each tick is sealed; at [`LogLevel::Summary`] the first one of each second of simulated time and
//! the last of the run.

mod answers;
mod background;
mod encode;
mod encoder;
mod hash;
mod names;
mod on_their_way;
mod pages;
mod record;
mod repeated;
mod row;
mod sink;
mod tally;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use alliance_proto::event::EventLine;
use alliance_proto::log::{Document, LogLevel, RunFile, RunOutcome};
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Outcome;

use encoder::Encoder;

pub use answers::{Answer, Answers, Deliveries};
pub use background::Background;
pub use record::{BodyRecord, Event, EventKind, FaultEvent, TickRecord};
pub use sink::{Folder, Sink};
pub use tally::Ending;

/// Buffered bytes that make the recorder write.
const FLUSH_BYTES: usize = 64 * 1024;

/// A log that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The operating system refuses.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// What.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The folder is taken.
    #[error("{} already holds a run", .0.display())]
    Occupied(PathBuf),
    /// An earlier write failed. More rows after the torn one would only look like a log.
    #[error("the log ended at a write that failed")]
    Broken,
    /// The operating system has no thread for it.
    #[error("no thread for the log: {0}")]
    Thread(io::Error),
}

impl RecordError {
    fn write(path: &Path, error: io::Error) -> Self {
        Self::Write {
            path: path.to_owned(),
            error,
        }
    }
}

/// Takes what happened in each tick.
pub trait Record {
    /// Adds a tick; ticks come in order, each once.
    ///
    /// # Errors
    /// When the log cannot be written.
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError>;
}

/// Writes the log of one run.
pub struct Recorder<S> {
    encoder: Encoder,
    sink: S,
    broken: bool,
}

impl<S: Sink> Recorder<S> {
    /// Begins a log: run.json with the outcome "running", and the tables' header lines.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(setup: &Setup, level: LogLevel, sink: S) -> Result<Self, RecordError> {
        Self::telling(setup, level, &BTreeMap::new(), sink)
    }

    /// The same, with the versions of minds that are programs of their own, by name, where they are known.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn telling(
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
        // First: without run.json a folder is not readable.
        recorder.write_run(RunOutcome::Running, Ending::default())?;
        recorder.flush()?;
        Ok(recorder)
    }

    /// Hands everything encoded so far to the sink, ticks.csv last.
    ///
    /// # Errors
    /// Those of the sink, and [`RecordError::Broken`] ever after.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        if self.broken {
            return Err(RecordError::Broken);
        }
        let written = self.encoder.write_to(&mut self.sink);
        self.broken = written.is_err();
        written
    }

    /// Hash of the run so far, 16 hexadecimal digits; it covers every section of every tick, at any [`LogLevel`].
    #[must_use]
    pub fn hash(&self) -> String {
        self.encoder.hash()
    }

    /// Writes host.json: what no repetition of the run would give again.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn write_host(&mut self, host: &serde_json::Value) -> Result<(), RecordError> {
        self.sink.replace(Document::Host, &format!("{host:#}\n"))
    }

    /// Ends the log: writes what is left, messages on their way among it, and the final run.json, and returns that. Where
    /// the last tick has its seal already and such messages follow, it is sealed again.
    ///
    /// # Errors
    /// Those of [`Recorder::flush`] and of the sink.
    pub fn finish(&mut self, outcome: Outcome, ending: Ending) -> Result<RunFile, RecordError> {
        self.encoder.finish();
        self.flush()?;
        self.write_run(RunOutcome::Ended(outcome), ending)
    }

    /// The rows of events.csv since this was called last, at any [`LogLevel`]; none the first time.
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.encoder.take_events()
    }

    /// Where the log goes.
    #[must_use]
    pub fn sink(&self) -> &S {
        &self.sink
    }

    /// Where the log went.
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
    /// Writes, as [`Recorder::flush`] does, when enough has gathered.
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        self.encoder.add(record);
        if self.encoder.waiting() >= FLUSH_BYTES {
            self.flush()?;
        }
        Ok(())
    }
}

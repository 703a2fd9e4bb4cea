//! The log of a run (DESIGN §8): encoding here, files in [`Folder`] alone.
//!
//! What a robot senses and does is hashed section by section when its report comes ([`Answers`]). After every tick the
//! simulation hands a [`TickRecord`] to the [`Recorder`]. It adds the tick to the hash of the run and rows to the tables that the
//! [`LogLevel`] keeps, and writes them out in large pieces; a full log of a run by processes is made in the [`Background`].
//! [`RunLog`](alliance_proto::log::RunLog) reads a folder back.
//!
//! **Seals.** ticks.csv is written last and tells what counts. Beside the hash of each [`Section`] it holds, of the robot
//! `world`, for each table that has grown a row with the table's file name as its section and the hash of the table's bytes
//! up to here, header included; and then a row with the section `run` and the hash of the run so far, which ends the
//! tick. So whatever a killed process leaves behind, a reader finds the last tick up to which every table is whole.
//! At [`LogLevel::Full`] each tick is sealed; at [`LogLevel::Summary`] the first one of each second of simulated time and
//! the last of the run.

mod answers;
mod background;
mod encode;
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
use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::log::foreign::ForeignWriter;
use alliance_proto::log::{Document, LogLevel, MindFile, RunFile, RunOutcome, Section, Table};
use alliance_proto::scenario::Setup;
use alliance_proto::tick::Outcome;
use alliance_proto::time::SimTime;

use alliance_proto::mission::Value;

use hash::{RunHash, SectionHash};
use names::Names;
use on_their_way::OnTheirWay;
use pages::Pages;
use repeated::Repeated;
use tally::Tally;

pub use answers::{Answer, Answers, Deliveries};
pub use background::Background;
pub use record::{BodyRecord, Event, EventKind, FaultEvent, TickRecord};
pub use sink::{Folder, Sink};
pub use tally::Ending;

/// Buffered bytes that make the recorder write.
const FLUSH_BYTES: usize = 64 * 1024;

/// Simulated time between two seals of [`LogLevel::Summary`], ms.
const SUMMARY_SEAL_MS: u64 = 1000;

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
    setup: Setup,
    level: LogLevel,
    names: Names,
    repeated: Repeated,
    sink: S,
    pages: Pages,
    hash: RunHash,
    section: SectionHash,
    tally: Tally,
    /// Of foreign.bin; there once somebody has a mind of its own.
    foreign: Option<Box<ForeignWriter>>,
    /// What is told of the minds that are programs of their own, by name.
    minds: BTreeMap<String, MindFile>,
    /// Messages whose rows are still to come.
    on_their_way: OnTheirWay,
    /// What the last row of mission.csv says.
    mission: Option<Vec<Value>>,
    /// For somebody who looks on, see [`Recorder::take_events`].
    told: Option<Vec<EventLine>>,
    /// Latest tick.
    latest: Option<(Tick, SimTime)>,
    /// Latest tick with a seal.
    sealed: Option<(Tick, SimTime)>,
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
        let names = Names::of(setup);
        let mut recorder = Self {
            setup: setup.clone(),
            level,
            repeated: Repeated::new(&names),
            names,
            sink,
            pages: Pages::new(level, setup.catalog.mission),
            hash: RunHash::default(),
            section: SectionHash::default(),
            tally: Tally::new(setup),
            foreign: None,
            minds: (setup.scenario.minds().into_iter())
                .map(|name| {
                    let version = versions.get(name).cloned();
                    (name.to_owned(), MindFile { version })
                })
                .collect(),
            on_their_way: OnTheirWay::default(),
            mission: None,
            told: None,
            latest: None,
            sealed: None,
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
        let written = self.pages.write_to(&mut self.sink);
        self.broken = written.is_err();
        written
    }

    /// Hash of the run so far, 16 hexadecimal digits; it covers every section of every tick, at any [`LogLevel`].
    #[must_use]
    pub fn hash(&self) -> String {
        format!("{:016x}", self.hash.so_far())
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
        let left = self.on_their_way.end();
        if !left.is_empty() {
            let (names, repeated) = (&self.names, &mut self.repeated);
            self.pages.add(Table::Messages, |rows| {
                encode::pending(names, repeated, &left, rows);
            });
        }
        if self.sealed != self.latest || !left.is_empty() {
            self.seal();
        }
        self.flush()?;
        self.write_run(RunOutcome::Ended(outcome), ending)
    }

    /// The rows of events.csv since this was called last, at any [`LogLevel`]; none the first time.
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.told.replace(Vec::new()).unwrap_or_default()
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
        let Ending {
            unscripted,
            faults,
            figures,
        } = ending;
        let run = RunFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            log: self.level,
            hash: matches!(outcome, RunOutcome::Ended(_)).then(|| self.hash()),
            outcome,
            unscripted,
            faults,
            minds: self.minds.clone(),
            result: self.tally.figures(figures),
            setup: self.setup.clone(),
        };
        let text = serde_json::to_string_pretty(&run)
            // Every key is a string and the destination is memory, so nothing is left to fail.
            .expect("run.json can be encoded");
        self.sink.replace(Document::Run, &(text + "\n"))?;
        Ok(run)
    }

    fn hash_tick(&mut self, record: &TickRecord<'_>) {
        self.hash.tick(record.tick);
        if !record.inputs.is_empty() {
            let hash = self.section.inputs(record.inputs);
            self.add_section(None, Section::Inputs, hash);
        }
        for answer in record.counted() {
            let robot = Some(answer.report.robot);
            answer.for_each_section(|section, hash| self.add_section(robot, section, hash));
        }
        if !record.events.is_empty() {
            let hash = self.section.events(record.events);
            self.add_section(None, Section::Events, hash);
        }
        let hash = self.section.state(record.bodies, record.mission_state);
        self.add_section(None, Section::State, hash);
        self.hash.end_tick();
    }

    /// Inlined, so that the lengths of the sections' names are known.
    #[inline(always)]
    fn add_section(&mut self, robot: Option<RobotId>, section: Section, hash: u64) {
        self.hash.section(robot, section, hash);
        if self.level == LogLevel::Full {
            let repeated = &self.repeated;
            let robot = robot.map_or(&repeated.world, |robot| repeated.robot(robot));
            self.pages
                .add_hash(&repeated.tick, robot, section.as_str(), hash);
        }
    }

    /// The answers of foreign minds: nothing else gives them again.
    #[inline(never)]
    fn keep_foreign(&mut self, record: &TickRecord<'_>) {
        let is_foreign = |answer: &&Answer| record.foreign[answer.report.robot.index()];
        for answer in record.counted().filter(is_foreign) {
            let report = &answer.report;
            let own = record.said.iter().filter(|it| it.sender == report.robot);
            let writer = self.foreign.get_or_insert_default();
            self.pages.add_optional(Table::Foreign, |bytes| {
                writer.add(report, own, bytes);
            });
        }
    }

    fn seal_is_due(&self, now: SimTime) -> bool {
        match self.level {
            LogLevel::Full => true,
            LogLevel::Summary => self
                .sealed
                .is_none_or(|(_, last)| last.0 / SUMMARY_SEAL_MS != now.0 / SUMMARY_SEAL_MS),
            LogLevel::Off => false,
        }
    }

    /// Declares the latest tick whole in every table.
    fn seal(&mut self) {
        if let Some(latest) = self.latest {
            self.pages.seal(&self.repeated, self.hash.so_far());
            self.sealed = Some(latest);
        }
    }
}

impl<S: Sink> Record for Recorder<S> {
    /// Writes, as [`Recorder::flush`] does, when enough has gathered.
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        if self.level.keeps(Table::Ticks) {
            self.repeated.begin(record.tick, record.now);
        }
        self.hash_tick(record);
        self.tally.add(record);
        self.latest = Some((record.tick, record.now));

        let (names, repeated, pages) = (&self.names, &mut self.repeated, &mut self.pages);
        pages.add(Table::Motivations, |rows| {
            encode::motivations(names, repeated, record, rows)
        });
        if record
            .counted()
            .any(|answer| !answer.report.allocation.is_empty())
        {
            pages.add_optional(Table::Allocation, |rows| {
                encode::allocation(names, repeated, record, rows)
            });
        }
        pages.add(Table::Messages, |rows| {
            encode::messages(names, repeated, &mut self.on_their_way, record, rows)
        });
        pages.add(Table::Events, |rows| {
            encode::event_rows(&encode::events(names, record), rows);
        });
        if let Some(told) = &mut self.told {
            told.append(&mut encode::events(names, record));
        }
        pages.add(Table::Poses, |rows| {
            encode::poses(names, repeated, record, rows)
        });
        if !record.targets.is_empty() {
            pages.add_optional(Table::Targets, |rows| {
                encode::targets(repeated, record, rows)
            });
        }
        pages.add(Table::Inputs, |lines| encode::inputs(record, lines));
        if !record.foreign.is_empty() {
            self.keep_foreign(record);
        }
        let pages = &mut self.pages;
        if self.level.keeps(Table::Mission) && self.mission.as_deref() != Some(record.mission) {
            let written = self.mission.get_or_insert_default();
            written.clear();
            written.extend_from_slice(record.mission);
            pages.add(Table::Mission, |rows| encode::mission(record, rows));
        }
        if self.seal_is_due(record.now) {
            self.seal();
        }
        if self.pages.waiting() >= FLUSH_BYTES {
            self.flush()?;
        }
        Ok(())
    }
}

//! What stands in the log of a run, row by row: made here, written elsewhere. It knows no sink, so that it is compiled once, where it is
//! optimized, whoever writes what it makes.

use std::collections::BTreeMap;

use alliance_proto::event::EventLine;
use alliance_proto::ids::{RobotId, Tick};
use alliance_proto::log::foreign::ForeignWriter;
use alliance_proto::log::{LogLevel, MindFile, RunFile, RunOutcome, Section, Table};
use alliance_proto::mission::Value;
use alliance_proto::scenario::Setup;
use alliance_proto::time::SimTime;

use super::encode;
use super::hash::{RunHash, SectionHash};
use super::names::Names;
use super::on_their_way::OnTheirWay;
use super::pages::Pages;
use super::record::TickRecord;
use super::repeated::Repeated;
use super::tally::{Ending, Tally};
use super::{Answer, RecordError, Sink};

/// Simulated time between two seals of [`LogLevel::Summary`], ms.
const SUMMARY_SEAL_MS: u64 = 1000;

/// The log of one run as it comes to be.
pub(super) struct Encoder {
    setup: Setup,
    level: LogLevel,
    names: Names,
    repeated: Repeated,
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
    /// For somebody who looks on, see [`Encoder::take_events`].
    told: Option<Vec<EventLine>>,
    /// Latest tick.
    latest: Option<(Tick, SimTime)>,
    /// Latest tick with a seal.
    sealed: Option<(Tick, SimTime)>,
}

impl Encoder {
    /// Tables with header lines alone.
    pub fn new(setup: &Setup, level: LogLevel, versions: &BTreeMap<String, String>) -> Self {
        let names = Names::of(setup);
        Self {
            setup: setup.clone(),
            level,
            repeated: Repeated::new(&names),
            names,
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
        }
    }

    /// What is run.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// How much of it is kept.
    pub fn level(&self) -> LogLevel {
        self.level
    }

    /// See [`Recorder::hash`](super::Recorder::hash).
    pub fn hash(&self) -> String {
        format!("{:016x}", self.hash.so_far())
    }

    /// See [`Recorder::take_events`](super::Recorder::take_events).
    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.told.replace(Vec::new()).unwrap_or_default()
    }

    /// Bytes that wait to be written.
    pub fn waiting(&self) -> usize {
        self.pages.waiting()
    }

    /// Hands them over, ticks.csv last.
    pub fn write_to(&mut self, sink: &mut dyn Sink) -> Result<(), RecordError> {
        self.pages.write_to(sink)
    }

    /// No tick comes any more: adds what is left, and a seal for it.
    pub fn finish(&mut self) {
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
    }

    /// What run.json says.
    pub fn run_file(&self, outcome: RunOutcome, ending: Ending) -> RunFile {
        let Ending {
            unscripted,
            faults,
            figures,
        } = ending;
        RunFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            log: self.level,
            hash: matches!(outcome, RunOutcome::Ended(_)).then(|| self.hash()),
            outcome,
            unscripted,
            faults,
            minds: self.minds.clone(),
            result: self.tally.figures(figures),
            setup: self.setup.clone(),
        }
    }

    /// Adds a tick.
    pub fn add(&mut self, record: &TickRecord<'_>) {
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

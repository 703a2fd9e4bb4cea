//! The encoder of a run's log, row by row. It does not depend on the sink's type, so that it is compiled once, in this
//! optimized crate.

use std::collections::BTreeMap;

use crate::compact::MotivationRule;
use crate::external::ExternalWriter;
use crate::{BranchOrigin, ControllerFile, LogLevel, RunFile, RunOutcome, Section, Table};
use prefetch::{Layer, prefetch};
use proto::event::EventLine;
use proto::program_build;
use scenario::Setup;
use scenario::ids::{RobotId, Tick};
use scenario::mission::FigureValue;
use scenario::time::SimTime;

use super::allocation_messages;
use super::changed_rows::ChangedRows;
use super::encode;
use super::hash::RunHash;
use super::in_flight::InFlight;
use super::names::Names;
use super::pages::Pages;
use super::record::TickRecord;
use super::repeated::RowCache;
use super::section_hash::SectionHash;
use super::tally::{Ending, Tally};
use super::{Answer, RecordError, Sink};

/// Simulated time between two seals of [`LogLevel::Summary`], ms.
const SUMMARY_SEAL_MS: u64 = 1000;

pub(super) struct Encoder {
    setup: Setup,
    level: LogLevel,
    names: Names,
    repeated: RowCache,
    /// The rows of the latest tick, for a compact log.
    changed: Option<ChangedRows>,
    pages: Pages,
    hash: RunHash,
    section: SectionHash,
    tally: Tally,
    /// The writer of foreign.bin; created with the first answer of an external controller.
    external: Option<Box<ExternalWriter>>,
    controllers: BTreeMap<String, ControllerFile>,
    branch: Option<BranchOrigin>,
    /// Messages in flight, whose rows follow later.
    on_their_way: InFlight,
    /// The values of the last row of mission.csv.
    mission: Option<Vec<FigureValue>>,
    /// Events for an observer, see [`Encoder::take_events`]; `None` until the first call.
    events: Option<Vec<EventLine>>,
    latest: Option<(Tick, SimTime)>,
    sealed: Option<(Tick, SimTime)>,
}

impl Encoder {
    pub fn new(setup: &Setup, level: LogLevel, versions: &BTreeMap<String, String>) -> Self {
        let names = Names::of(setup);
        Self {
            setup: setup.clone(),
            level,
            repeated: RowCache::new(&names, level),
            changed: (level == LogLevel::Compact)
                .then(|| ChangedRows::new(MotivationRule::new(setup), names.robots().count())),
            names,
            pages: Pages::new(level, setup.catalog.mission),
            hash: RunHash::default(),
            section: SectionHash::default(),
            tally: Tally::new(setup),
            external: None,
            controllers: (setup.scenario.external_controllers().into_iter())
                .map(|name| {
                    let version = versions.get(name).cloned();
                    (name.to_owned(), ControllerFile { version })
                })
                .collect(),
            branch: None,
            on_their_way: InFlight::default(),
            mission: None,
            events: None,
            latest: None,
            sealed: None,
        }
    }

    /// Returns a copy with the same state if the run has no tables, else `None`: a table exists once.
    pub fn without_tables(&self) -> Option<Self> {
        (self.level == LogLevel::Off).then(|| Self {
            setup: self.setup.clone(),
            level: self.level,
            names: self.names.clone(),
            repeated: self.repeated.clone(),
            changed: self.changed.clone(),
            pages: self.pages.clone(),
            hash: self.hash.clone(),
            section: SectionHash::default(),
            tally: self.tally.clone(),
            external: None,
            controllers: self.controllers.clone(),
            branch: self.branch.clone(),
            on_their_way: self.on_their_way.clone(),
            mission: self.mission.clone(),
            events: self.events.clone(),
            latest: self.latest,
            sealed: self.sealed,
        })
    }

    /// Requests the memory of a layer of a run without tables, see [`prefetch`](mod@prefetch).
    #[inline]
    pub fn prefetch(&self, layer: Layer) {
        match layer {
            Layer::Fields => {
                prefetch(&self.level);
                self.pages.prefetch();
                prefetch(&self.hash);
                prefetch(&self.section);
                prefetch(&self.tally);
                prefetch(&self.events);
                prefetch(&self.latest);
                prefetch(&self.sealed);
            }
            Layer::Lists => {
                self.hash.prefetch();
                self.section.prefetch();
                self.tally.prefetch();
            }
            Layer::Elements | Layer::Contents => {}
        }
    }

    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    pub fn level(&self) -> LogLevel {
        self.level
    }

    pub fn set_branch(&mut self, origin: BranchOrigin) {
        self.branch = Some(origin);
    }

    pub fn hash(&self) -> String {
        format!("{:016x}", self.hash.so_far())
    }

    pub fn take_events(&mut self) -> Vec<EventLine> {
        self.events.replace(Vec::new()).unwrap_or_default()
    }

    pub fn waiting(&self) -> usize {
        self.pages.waiting()
    }

    pub fn write_to(&mut self, sink: &mut dyn Sink) -> Result<(), RecordError> {
        self.pages.write_to(sink)
    }

    pub fn finish(&mut self) {
        let in_flight = self.on_their_way.take_all();
        if !in_flight.is_empty() {
            let (names, repeated) = (&self.names, &mut self.repeated);
            self.pages.add(Table::Messages, |rows| {
                encode::pending(names, repeated, &in_flight, rows);
            });
        }
        if self.sealed != self.latest || !in_flight.is_empty() {
            self.seal();
        }
    }

    pub fn run_file(&self, outcome: RunOutcome, ending: Ending) -> RunFile {
        let Ending {
            unscripted,
            faults,
            figures,
            agent_builds,
        } = ending;
        RunFile {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            build: program_build::get().to_owned(),
            agent_builds,
            log: self.level,
            hash: matches!(outcome, RunOutcome::Ended(_)).then(|| self.hash()),
            outcome,
            branch: self.branch.clone(),
            unscripted,
            faults,
            controllers: self.controllers.clone(),
            result: self.tally.figures(figures),
            setup: self.setup.clone(),
        }
    }

    /// Adds a tick.
    ///
    /// # Errors
    /// Returns [`RecordError::Answer`]. The log is then incomplete.
    pub fn add(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        if self.level.keeps(Table::Ticks) {
            self.repeated.begin(record.tick, record.now);
        }
        self.hash_tick(record);
        self.tally.add(record);
        self.latest = Some((record.tick, record.now));

        let (names, repeated, pages) = (&self.names, &mut self.repeated, &mut self.pages);
        let changed = &mut self.changed;
        pages.add(Table::Motivations, |rows| match changed {
            Some(changed) => encode::changed_motivations(names, repeated, changed, record, rows),
            None => encode::motivations(names, repeated, record, rows),
        });
        let had_allocation = changed.as_ref().is_some_and(ChangedRows::has_allocation);
        let mut counted = record.counted();
        if had_allocation || counted.any(|answer| !answer.report.allocation.is_empty()) {
            pages.add_optional(Table::Allocation, |rows| match changed {
                Some(changed) => encode::changed_allocation(names, repeated, changed, record, rows),
                None => encode::allocation(names, repeated, record, rows),
            });
        }
        if !record.allocation_messages.is_empty() {
            pages.add_optional(Table::AllocationMessages, |rows| {
                allocation_messages::encode(names, record, rows)
            });
        }
        pages.add(Table::Messages, |rows| {
            encode::messages(names, repeated, &mut self.on_their_way, record, rows)
        });
        if record.senders().next().is_some() {
            pages.add_optional(Table::Sent, |rows| encode::sent(repeated, record, rows));
        }
        if !record.hits.is_empty() {
            pages.add_optional(Table::Hits, |rows| encode::hits(repeated, record, rows));
        }
        pages.add(Table::Events, |rows| {
            encode::event_rows(&encode::events(names, record), rows);
        });
        if let Some(events) = &mut self.events {
            events.append(&mut encode::events(names, record));
        }
        pages.add(Table::Poses, |rows| match changed {
            Some(changed) => encode::changed_poses(names, repeated, changed, record, rows),
            None => encode::poses(names, repeated, record, rows),
        });
        if !record.targets.is_empty() {
            pages.add_optional(Table::Targets, |rows| {
                encode::targets(repeated, record, rows)
            });
        }
        pages.add(Table::Inputs, |lines| encode::inputs(record, lines));
        if !record.external.is_empty() {
            self.store_external(record)?;
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
        Ok(())
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

    /// Adds a section to the hash. Inlined, so that the lengths of the section names are constants.
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

    /// Stores the answers of external controllers, which a replay cannot compute.
    #[inline(never)]
    fn store_external(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        let is_external = |answer: &&Answer| record.external[answer.report.robot.index()];
        for answer in record.counted().filter(is_external) {
            let report = &answer.report;
            let broadcasts = record
                .broadcasts
                .iter()
                .filter(|broadcast| broadcast.sender == report.robot);
            let writer = self.external.get_or_insert_default();
            let mut added = Ok(());
            self.pages.add_optional(Table::External, |bytes| {
                added = writer.add(report, broadcasts, bytes);
            });
            added.map_err(|error| RecordError::Answer {
                robot: self.names.robot(report.robot).to_owned(),
                tick: record.tick,
                error,
            })?;
        }
        Ok(())
    }

    fn seal_is_due(&self, now: SimTime) -> bool {
        match self.level {
            LogLevel::Full | LogLevel::Compact => true,
            LogLevel::Summary => self
                .sealed
                .is_none_or(|(_, last)| last.0 / SUMMARY_SEAL_MS != now.0 / SUMMARY_SEAL_MS),
            LogLevel::Off => false,
        }
    }

    /// Adds a seal: up to the latest tick, every table is complete.
    fn seal(&mut self) {
        if let Some(latest) = self.latest {
            self.pages.seal(&self.repeated, self.hash.so_far());
            self.sealed = Some(latest);
        }
    }
}

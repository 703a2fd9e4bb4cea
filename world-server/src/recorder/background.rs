//! A recorder on a thread of its own: the run goes on to its next tick while rows of the last ones are made and written.
//!
//! Ticks go over in batches, for a thread that is woken for every tick would cost more than it saves, and what makes rows runs
//! fastest many times in a row. The queue is bounded: where the disk does not keep up, the run waits for it. Nothing is lost but by
//! a killed process, of which a log without this thread loses what it has not written, too.

use std::mem;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use alliance_proto::event::EventLine;
use alliance_proto::ids::Tick;
use alliance_proto::tick::{Report, TickMessage};
use alliance_proto::time::SimTime;
use alliance_proto::view::ItemCounts;

use super::encode::{self, Names};
use super::{BodyRecord, Event, Record, RecordError, Recorder, Sink, TickRecord};
use crate::input::Input;

/// Ticks that go over together.
const BATCH: usize = 32;

/// Batches that may wait.
const WAITING: usize = 8;

/// Writes the log of one run from its own thread.
pub struct Background<S> {
    names: Names,
    /// Events of the latest tick.
    news: Vec<EventLine>,
    /// Ticks that have not gone over yet.
    batch: Vec<Kept>,
    thread: Option<Thread<S>>,
}

struct Thread<S> {
    ticks: SyncSender<Vec<Kept>>,
    handle: JoinHandle<Result<Recorder<S>, RecordError>>,
}

impl<S: Sink + Send + 'static> Background<S> {
    /// Lets that recorder work on its own.
    ///
    /// # Errors
    /// [`RecordError::Thread`] when the system has no thread.
    pub fn new(recorder: Recorder<S>) -> Result<Self, RecordError> {
        let names = Names::of(&recorder.setup);
        let (ticks, queue) = sync_channel(WAITING);
        let handle = thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(move || write(recorder, &queue))
            .map_err(RecordError::Thread)?;
        Ok(Self {
            names,
            news: Vec::new(),
            batch: Vec::with_capacity(BATCH),
            thread: Some(Thread { ticks, handle }),
        })
    }

    /// The events of the latest tick, as they will stand in events.csv.
    pub fn take_news(&mut self) -> Vec<EventLine> {
        mem::take(&mut self.news)
    }

    /// Has everything written that was recorded so far, soon.
    ///
    /// # Errors
    /// Those of the recorder, for what was recorded before; and [`RecordError::Broken`] ever after.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        let Some(thread) = &self.thread else {
            return Err(RecordError::Broken);
        };
        let batch = mem::replace(&mut self.batch, Vec::with_capacity(BATCH));
        match thread.ticks.send(batch) {
            Ok(()) => Ok(()),
            // The thread has ended: it says why.
            Err(_) => self.finish().and(Err(RecordError::Broken)),
        }
    }

    /// Gives the recorder back once it has everything.
    ///
    /// # Errors
    /// Those of the recorder, unless [`Background::flush`] has told them; then [`RecordError::Broken`].
    pub fn finish(&mut self) -> Result<Recorder<S>, RecordError> {
        let thread = self.thread.take().ok_or(RecordError::Broken)?;
        // If the thread has ended, there is a reason, which comes next.
        let _ = thread.ticks.send(mem::take(&mut self.batch));
        drop(thread.ticks);
        // A panic in it has ended the process.
        thread.handle.join().unwrap_or(Err(RecordError::Broken))
    }
}

impl<S: Sink + Send + 'static> Record for Background<S> {
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        self.news = encode::events(&self.names, record);
        self.batch.push(Kept::of(record));
        if self.batch.len() < BATCH {
            return Ok(());
        }
        self.flush()
    }
}

/// Records batches as they come, and writes after each that has not filled up: nobody knows when the next one comes.
fn write<S: Sink>(
    mut recorder: Recorder<S>,
    queue: &Receiver<Vec<Kept>>,
) -> Result<Recorder<S>, RecordError> {
    for batch in queue {
        for tick in &batch {
            recorder.record(&tick.as_record())?;
        }
        if batch.len() < BATCH {
            recorder.flush()?;
        }
    }
    Ok(recorder)
}

/// A [`TickRecord`] that lasts.
struct Kept {
    tick: Tick,
    now: SimTime,
    inputs: Vec<Input>,
    bodies: Vec<BodyRecord>,
    sent: Vec<TickMessage>,
    reports: Vec<Option<Report>>,
    events: Vec<Event>,
    items: ItemCounts,
    last_report: Option<SimTime>,
}

impl Kept {
    fn of(record: &TickRecord<'_>) -> Self {
        Self {
            tick: record.tick,
            now: record.now,
            inputs: record.inputs.to_vec(),
            bodies: record.bodies.to_vec(),
            sent: record.sent.to_vec(),
            reports: record.reports.to_vec(),
            events: record.events.to_vec(),
            items: record.items,
            last_report: record.last_report,
        }
    }

    fn as_record(&self) -> TickRecord<'_> {
        TickRecord {
            tick: self.tick,
            now: self.now,
            inputs: &self.inputs,
            bodies: &self.bodies,
            sent: &self.sent,
            reports: &self.reports,
            events: &self.events,
            items: self.items,
            last_report: self.last_report,
        }
    }
}

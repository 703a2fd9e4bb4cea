//! A recorder on a separate thread, so that the run continues while rows of earlier ticks are encoded and written. Only full
//! and compact logs use the thread; the other levels are too small to profit.
//!
//! Ticks are handed over in batches, because waking the thread for each tick is slow. The queue is bounded: if the disk is too
//! slow, the run waits. Only a killed process loses rows, as it does without the thread.

use std::mem;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use crate::Input;
use proto::event::EventLine;
use proto::team::Broadcast;
use scenario::ids::Tick;
use scenario::time::SimTime;

use super::encode;
use super::names::Names;
use super::{
    Answer, BodyRecord, Event, FaultHits, Record, RecordError, Recorder, Sink, TickRecord,
};
use scenario::mission::{FigureValue, Target};

const BATCH_TICKS: usize = 64;

/// The maximum number of robot steps in a batch. They fit into the second-level cache and occupy a core only for a short time.
const BATCH_STEPS: usize = 192;

/// The maximum numbers of batches and of robot steps in the queue. The steps of a large team need much memory.
const WAITING: usize = 8;
const WAITING_STEPS: usize = 4_096;

/// The writer of a run's log, on a separate thread if that is faster.
pub struct BackgroundRecorder<S> {
    names: Names,
    /// The events of the latest tick.
    news: Vec<EventLine>,
    /// Ticks that have not been handed over, and the number of ticks in a batch.
    waiting: Vec<OwnedRecord>,
    batch: usize,
    /// The recorder or its thread; `None` after a failure or after `finish`.
    work: Option<Work<S>>,
}

enum Work<S> {
    Here(Box<Recorder<S>>),
    Thread {
        queue: SyncSender<Batch>,
        handle: JoinHandle<Result<Recorder<S>, RecordError>>,
    },
}

struct Batch {
    ticks: Vec<OwnedRecord>,
    /// `true` if it is unknown when the next batch follows.
    then_flush: bool,
}

impl<S: Sink + Send + 'static> BackgroundRecorder<S> {
    /// Starts a recorder, on a separate thread for a full or compact log if `is_threaded`.
    ///
    /// # Errors
    /// Returns [`RecordError::Thread`].
    pub fn new(recorder: Recorder<S>, is_threaded: bool) -> Result<Self, RecordError> {
        let names = Names::of(recorder.encoder.setup());
        let robots = recorder.encoder.setup().scenario.robots.len();
        let work = if is_threaded && recorder.encoder.level().has_every_tick() {
            let waiting = (WAITING_STEPS / robots.max(1)).clamp(1, WAITING);
            let (queue, batches) = sync_channel(waiting);
            let handle = thread::Builder::new()
                .name("recorder".to_owned())
                .spawn(move || write(recorder, &batches))
                .map_err(RecordError::Thread)?;
            Work::Thread { queue, handle }
        } else {
            Work::Here(Box::new(recorder))
        };
        Ok(Self {
            names,
            news: Vec::new(),
            waiting: Vec::new(),
            batch: (BATCH_STEPS / robots.max(1)).clamp(1, BATCH_TICKS),
            work: Some(work),
        })
    }

    /// Returns the events of the latest tick as rows of events.csv.
    pub fn take_events(&mut self) -> Vec<EventLine> {
        mem::take(&mut self.news)
    }

    /// Requests that everything recorded so far is written soon.
    ///
    /// # Errors
    /// Returns errors of the recorder for earlier ticks, and [`RecordError::Broken`] after that.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        match &mut self.work {
            Some(Work::Here(recorder)) => recorder.flush(),
            Some(Work::Thread { .. }) => self.hand_over(true),
            None => Err(RecordError::Broken),
        }
    }

    fn hand_over(&mut self, then_flush: bool) -> Result<(), RecordError> {
        let Some(Work::Thread { queue, .. }) = &self.work else {
            return Err(RecordError::Broken);
        };
        let ticks = mem::replace(&mut self.waiting, Vec::with_capacity(self.batch));
        match queue.send(Batch { ticks, then_flush }) {
            Ok(()) => Ok(()),
            // The thread has ended. `finish` returns its error.
            Err(_) => self.finish().and(Err(RecordError::Broken)),
        }
    }

    /// Returns the recorder after it has recorded everything.
    ///
    /// # Errors
    /// Returns errors of the recorder, or [`RecordError::Broken`] if [`BackgroundRecorder::flush`] has already returned them.
    pub fn finish(&mut self) -> Result<Recorder<S>, RecordError> {
        match self.work.take().ok_or(RecordError::Broken)? {
            Work::Here(recorder) => Ok(*recorder),
            Work::Thread { queue, handle } => {
                // If the thread has ended, `join` returns the reason.
                let _ = queue.send(Batch {
                    ticks: mem::take(&mut self.waiting),
                    then_flush: false,
                });
                drop(queue);
                // A panic of the thread has already ended the process.
                handle.join().unwrap_or(Err(RecordError::Broken))
            }
        }
    }
}

impl<S: Sink + Send + 'static> Record for BackgroundRecorder<S> {
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        self.news = encode::events(&self.names, record);
        match &mut self.work {
            Some(Work::Here(recorder)) => recorder.record(record),
            Some(Work::Thread { .. }) => {
                self.waiting.push(OwnedRecord::of(record));
                if self.waiting.len() < self.batch {
                    return Ok(());
                }
                self.hand_over(false)
            }
            None => Err(RecordError::Broken),
        }
    }
}

fn write<S: Sink>(
    mut recorder: Recorder<S>,
    batches: &Receiver<Batch>,
) -> Result<Recorder<S>, RecordError> {
    for batch in batches {
        for tick in &batch.ticks {
            recorder.record(&tick.as_record())?;
        }
        if batch.then_flush {
            recorder.flush()?;
        }
    }
    Ok(recorder)
}

struct OwnedRecord {
    tick: Tick,
    now: SimTime,
    inputs: Vec<Input>,
    bodies: Vec<BodyRecord>,
    answers: Vec<Answer>,
    external: Vec<bool>,
    broadcasts: Vec<Broadcast>,
    allocation_messages: Vec<Broadcast>,
    events: Vec<Event>,
    hits: Vec<FaultHits>,
    mission: Vec<FigureValue>,
    targets: Vec<Target>,
    mission_state: u64,
}

impl OwnedRecord {
    fn of(record: &TickRecord<'_>) -> Self {
        Self {
            tick: record.tick,
            now: record.now,
            inputs: record.inputs.to_vec(),
            bodies: record.bodies.to_vec(),
            answers: record.answers.to_vec(),
            external: record.external.to_vec(),
            broadcasts: record.broadcasts.to_vec(),
            allocation_messages: record.allocation_messages.to_vec(),
            events: record.events.to_vec(),
            hits: record.hits.to_vec(),
            mission: record.mission.to_vec(),
            targets: record.targets.to_vec(),
            mission_state: record.mission_state,
        }
    }

    fn as_record(&self) -> TickRecord<'_> {
        TickRecord {
            tick: self.tick,
            now: self.now,
            inputs: &self.inputs,
            bodies: &self.bodies,
            answers: &self.answers,
            external: &self.external,
            broadcasts: &self.broadcasts,
            allocation_messages: &self.allocation_messages,
            events: &self.events,
            hits: &self.hits,
            mission: &self.mission,
            targets: &self.targets,
            mission_state: self.mission_state,
        }
    }
}

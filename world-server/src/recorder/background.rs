//! A recorder on a thread of its own: the run goes on to its next tick while rows of the last ones are made and written. That is
//! for a full log; of others there is so little to make that to hand it over would cost more.
//!
//! Ticks go over in batches, for a thread that is woken for every tick would cost more than it saves, and what makes rows runs
//! fastest many times in a row. The queue is bounded: where the disk does not keep up, the run waits for it. Nothing is lost but by
//! a killed process, of which a log without this thread loses what it has not written, too.

use std::mem;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use alliance_proto::event::EventLine;
use alliance_proto::ids::Tick;
use alliance_proto::log::{Input, LogLevel};
use alliance_proto::team::Broadcast;
use alliance_proto::time::SimTime;

use super::encode;
use super::names::Names;
use super::{Answer, BodyRecord, Event, Record, RecordError, Recorder, Sink, TickRecord};
use alliance_proto::mission::{Target, Value};

/// Most ticks that go over together.
const BATCH_TICKS: usize = 64;

/// Most steps of robots that go over together: a core's second-level cache holds them, and nobody waits long for the core.
const BATCH_STEPS: usize = 192;

/// Batches that may wait.
const WAITING: usize = 8;

/// Writes the log of one run, from its own thread where that pays.
pub struct Background<S> {
    names: Names,
    /// Events of the latest tick.
    news: Vec<EventLine>,
    /// Ticks that have not gone over yet, and how many go over together.
    waiting: Vec<Kept>,
    batch: usize,
    /// `None` once it has failed or been given back.
    work: Option<Work<S>>,
}

/// Where rows are made.
enum Work<S> {
    Here(Box<Recorder<S>>),
    Thread {
        queue: SyncSender<Batch>,
        handle: JoinHandle<Result<Recorder<S>, RecordError>>,
    },
}

/// What goes over at once.
struct Batch {
    ticks: Vec<Kept>,
    /// Nobody knows when the next one comes.
    then_flush: bool,
}

impl<S: Sink + Send + 'static> Background<S> {
    /// Lets that recorder work on its own.
    ///
    /// # Errors
    /// [`RecordError::Thread`] when the system has no thread.
    pub fn new(recorder: Recorder<S>) -> Result<Self, RecordError> {
        let names = Names::of(recorder.encoder.setup());
        let robots = recorder.encoder.setup().scenario.robots.len();
        let work = if recorder.encoder.level() == LogLevel::Full {
            let (queue, batches) = sync_channel(WAITING);
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

    /// The events of the latest tick, as they will stand in events.csv.
    pub fn take_news(&mut self) -> Vec<EventLine> {
        mem::take(&mut self.news)
    }

    /// Has everything written that was recorded so far, soon.
    ///
    /// # Errors
    /// Those of the recorder, for what was recorded before; and [`RecordError::Broken`] ever after.
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
            // The thread has ended: it says why.
            Err(_) => self.finish().and(Err(RecordError::Broken)),
        }
    }

    /// Gives the recorder back once it has everything.
    ///
    /// # Errors
    /// Those of the recorder, unless [`Background::flush`] has told them; then [`RecordError::Broken`].
    pub fn finish(&mut self) -> Result<Recorder<S>, RecordError> {
        match self.work.take().ok_or(RecordError::Broken)? {
            Work::Here(recorder) => Ok(*recorder),
            Work::Thread { queue, handle } => {
                // If the thread has ended, there is a reason, which comes next.
                let _ = queue.send(Batch {
                    ticks: mem::take(&mut self.waiting),
                    then_flush: false,
                });
                drop(queue);
                // A panic in it has ended the process.
                handle.join().unwrap_or(Err(RecordError::Broken))
            }
        }
    }
}

impl<S: Sink + Send + 'static> Record for Background<S> {
    fn record(&mut self, record: &TickRecord<'_>) -> Result<(), RecordError> {
        self.news = encode::events(&self.names, record);
        match &mut self.work {
            Some(Work::Here(recorder)) => recorder.record(record),
            Some(Work::Thread { .. }) => {
                self.waiting.push(Kept::of(record));
                if self.waiting.len() < self.batch {
                    return Ok(());
                }
                self.hand_over(false)
            }
            None => Err(RecordError::Broken),
        }
    }
}

/// Records batches as they come.
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

/// A [`TickRecord`] that lasts.
struct Kept {
    tick: Tick,
    now: SimTime,
    inputs: Vec<Input>,
    bodies: Vec<BodyRecord>,
    answers: Vec<Answer>,
    foreign: Vec<bool>,
    said: Vec<Broadcast>,
    events: Vec<Event>,
    mission: Vec<Value>,
    targets: Vec<Target>,
    mission_state: u64,
}

impl Kept {
    fn of(record: &TickRecord<'_>) -> Self {
        Self {
            tick: record.tick,
            now: record.now,
            inputs: record.inputs.to_vec(),
            bodies: record.bodies.to_vec(),
            answers: record.answers.to_vec(),
            foreign: record.foreign.to_vec(),
            said: record.said.to_vec(),
            events: record.events.to_vec(),
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
            foreign: &self.foreign,
            said: &self.said,
            events: &self.events,
            mission: &self.mission,
            targets: &self.targets,
            mission_state: self.mission_state,
        }
    }
}

//! Worker threads for the parts of a batch. They wait between steps, because starting a thread takes as long as a step
//! of a small batch.

use std::io;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use in_process::look_for;
use pyo3::prelude::*;

use super::interrupt::Interrupt;
use super::part::BatchPart;
use crate::errors::alliance_error;

/// The time between two checks for Ctrl-C of a waiting thread.
pub const BETWEEN_CHECKS: Duration = Duration::from_millis(20);

/// The number of looks for a message before a thread sleeps. They take about 200 µs, as long as several steps of a small
/// batch, because to wake a sleeping thread takes as long as such a step.
const LOOKS: u32 = 400;

/// The work on each part of a batch.
pub type Work = Arc<dyn Fn(&mut BatchPart) -> PyResult<()> + Send + Sync>;

/// The worker threads: one for each part of a batch except the first.
#[derive(Default)]
pub struct Threads {
    workers: Vec<Worker>,
    /// The process id of the owner of the threads.
    process: u32,
}

/// A thread that ends when its sender is dropped.
struct Worker {
    work: SyncSender<Work>,
    done: Receiver<PyResult<()>>,
}

impl Threads {
    /// Executes the work on each part, and returns when all parts are done. The calling thread executes the first part.
    ///
    /// # Errors
    /// Returns the error of the first part that has one.
    pub fn on_each(
        &mut self,
        parts: &[Arc<Mutex<BatchPart>>],
        work: &Work,
        interrupt: &Interrupt,
    ) -> PyResult<()> {
        let [first, others @ ..] = parts else {
            return Ok(());
        };
        // A panic in the work drops the threads together with their pending results.
        let mut threads = std::mem::take(&mut self.workers);
        let process = std::process::id();
        if threads.len() != others.len() || self.process != process {
            // A forked process has none of the threads of its parent.
            let started: io::Result<Vec<Worker>> = others.iter().map(Worker::start).collect();
            threads = started.map_err(|error| {
                let count = parts.len();
                alliance_error(format!(
                    "threads: cannot start {count} threads: {error}; use fewer"
                ))
            })?;
            self.process = process;
        }
        for worker in &threads {
            // A thread that has ended is detected below.
            let _ = worker.work.send(Arc::clone(work));
        }
        let mut done = work(&mut lock(first));
        for worker in &threads {
            done = done.and(worker.result(interrupt));
        }
        self.workers = threads;
        done
    }
}

impl Worker {
    /// Waits for the result of the work. Ctrl-C ends the work, not the wait.
    fn result(&self, interrupt: &Interrupt) -> PyResult<()> {
        if let Some(result) = look_for(LOOKS, || self.done.try_recv().ok()) {
            return result;
        }
        let mut interrupted = Ok(());
        loop {
            match self.done.recv_timeout(BETWEEN_CHECKS) {
                Ok(result) => return interrupted.and(result),
                Err(RecvTimeoutError::Timeout) => interrupted = interrupted.and(interrupt.check()),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(alliance_error("a thread of the batch has panicked"));
                }
            }
        }
    }

    fn start(part: &Arc<Mutex<BatchPart>>) -> io::Result<Self> {
        let part = Arc::clone(part);
        let (work, queue) = mpsc::sync_channel::<Work>(1);
        let (results, done) = mpsc::sync_channel(1);
        thread::Builder::new().spawn(move || {
            let next = || look_for(LOOKS, || queue.try_recv().ok()).or_else(|| queue.recv().ok());
            while let Some(work) = next() {
                let result = work(&mut lock(&part));
                if results.send(result).is_err() {
                    return;
                }
            }
        })?;
        Ok(Self { work, done })
    }
}

/// Locks a part. A poisoned lock is accepted: the run keeps its state from before the panic.
pub fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

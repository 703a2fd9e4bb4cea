//! Threads that work on the parts of a batch, each on its own, whenever all are told to. They wait in between: to begin a thread takes as
//! long as a step of a small batch.

use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use pyo3::prelude::*;

use super::part::Part;
use crate::errors::failed;

/// What is done with each part.
pub type Work = Arc<dyn Fn(&mut Part) -> PyResult<()> + Send + Sync>;

/// A thread for each part of a batch but the first.
#[derive(Default)]
pub struct Threads {
    others: Vec<Other>,
    /// Whose threads they are.
    process: u32,
}

/// A thread that ends when nobody can tell it anything any more.
struct Other {
    work: SyncSender<Work>,
    done: Receiver<PyResult<()>>,
}

impl Threads {
    /// Does that with each part, with the first one in this thread. When it returns all is done.
    ///
    /// # Errors
    /// Those of the work: of the first part that has one.
    pub fn on_each(&mut self, parts: &[Arc<Mutex<Part>>], work: &Work) -> PyResult<()> {
        let [own, others @ ..] = parts else {
            return Ok(());
        };
        // Where the work panics they are gone, and what they have not told yet with them.
        let mut threads = std::mem::take(&mut self.others);
        let process = std::process::id();
        if threads.len() != others.len() || self.process != process {
            // A process that was forked has none of the threads of the other one.
            threads = others.iter().map(Other::begin).collect();
            self.process = process;
        }
        for other in &threads {
            // One that has ended is missed below.
            let _ = other.work.send(Arc::clone(work));
        }
        let mut done = work(&mut lock(own));
        for other in &threads {
            let ended = |_| Err(failed("a thread of the batch has panicked"));
            done = done.and(other.done.recv().unwrap_or_else(ended));
        }
        self.others = threads;
        done
    }
}

impl Other {
    fn begin(part: &Arc<Mutex<Part>>) -> Self {
        let part = Arc::clone(part);
        let (work, told) = mpsc::sync_channel::<Work>(1);
        let (tell, done) = mpsc::sync_channel(1);
        thread::spawn(move || {
            for work in told {
                let result = work(&mut lock(&part));
                if tell.send(result).is_err() {
                    return;
                }
            }
        });
        Self { work, done }
    }
}

/// What a panic has left is used no less: the run is as it was then.
pub fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

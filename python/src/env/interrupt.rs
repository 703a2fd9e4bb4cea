//! Ctrl-C during a call of a batch. Python runs the handlers of signals only between its own instructions, and a step can
//! take hours.

use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// The number of ticks between two checks of a thread, which is some milliseconds.
const TICKS_PER_CHECK: u32 = 4096;

/// The stop signal for the threads of a batch.
#[derive(Default)]
pub struct Interrupt {
    is_set: AtomicBool,
}

impl Interrupt {
    /// Runs the handlers of pending signals. Call it in the thread that called the batch.
    ///
    /// # Errors
    /// Returns the exception of a handler, such as `KeyboardInterrupt`. It stops the other threads.
    pub fn check(&self) -> PyResult<()> {
        let checked = Python::attach(|py| py.check_signals());
        if checked.is_err() {
            self.is_set.store(true, Ordering::Relaxed);
        }
        checked
    }

    pub fn clear(&self) {
        self.is_set.store(false, Ordering::Relaxed);
    }
}

/// The count of one thread's ticks until its next check.
pub struct Watch {
    ticks: u32,
    /// True in a thread of the batch, which has no signals.
    is_worker: bool,
}

impl Watch {
    pub fn new(is_worker: bool) -> Self {
        Self {
            ticks: 0,
            is_worker,
        }
    }

    /// Counts work that takes as long as some ticks, and checks for Ctrl-C from time to time.
    #[inline]
    pub fn count(&mut self, ticks: u32, interrupt: &Interrupt) -> PyResult<()> {
        self.ticks += ticks;
        if self.ticks < TICKS_PER_CHECK {
            return Ok(());
        }
        self.ticks = 0;
        if !self.is_worker {
            return interrupt.check();
        }
        if interrupt.is_set.load(Ordering::Relaxed) {
            return Err(PyKeyboardInterrupt::new_err(()));
        }
        Ok(())
    }
}

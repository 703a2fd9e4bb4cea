//! The random numbers of a controller.

use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;
use robot_agent::allocator::RandomDraws;

/// The random numbers of a robot's allocator for the current step.
#[pyclass(frozen, module = "alliance_sim")]
pub struct Stream(Mutex<StepState>);

struct StepState {
    draws: Option<RandomDraws>,
    /// The generator, created for the first number.
    stream: Option<ChaCha8Rng>,
    drawn: u32,
}

impl Stream {
    /// The largest number of 64-bit values in a step.
    const MOST: u32 = 2048;

    pub fn new() -> Self {
        Self(Mutex::new(StepState {
            draws: None,
            stream: None,
            drawn: 0,
        }))
    }

    /// Starts a new step.
    pub fn begin(&self, draws: RandomDraws) {
        let mut step = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *step = StepState {
            draws: Some(draws),
            stream: None,
            drawn: 0,
        };
    }
}

#[pymethods]
impl Stream {
    /// Restarts the current step with the same numbers.
    fn begin_again(&self) {
        let mut step = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (step.stream, step.drawn) = (None, 0);
    }

    fn next_u64(&self) -> PyResult<u64> {
        let mut step = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(draws) = step.draws else {
            let why = "random numbers are available only within a step";
            return Err(PyRuntimeError::new_err(why));
        };
        step.drawn += 1;
        if step.drawn > Self::MOST {
            let why = format!("a step has at most {} random numbers", Self::MOST);
            return Err(PyRuntimeError::new_err(why));
        }
        let stream = step.stream.get_or_insert_with(|| draws.stream());
        Ok(stream.next_u64())
    }
}

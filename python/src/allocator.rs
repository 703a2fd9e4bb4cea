//! An allocator written in Python. The engine creates heartbeats and state changes, and undoes steps, as for all other
//! allocators.

use std::sync::Arc;

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use robot_agent::allocator::{Allocator, Decision, Input, SelfState};
use scenario::ids::BehaviorId;
use scenario::time::SimTime;

use crate::controller::{ClassData, ControllerObject};
use crate::rows::rows;
use crate::set::Set;

/// The allocator of one robot.
#[derive(Clone, Debug)]
pub struct PythonAllocator {
    object: ControllerObject,
    /// The time of the last activation or deactivation of each set; empty before the first step.
    since: Vec<SimTime>,
}

impl Allocator for PythonAllocator {
    type Config = Arc<ClassData>;

    fn new(me: &SelfState, common: &Arc<ClassData>) -> Self {
        Self {
            object: ControllerObject::new(me.robot, &me.behaviors, common),
            since: Vec::new(),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let object = &self.object;
        if object.has_failed() {
            decision.active = None;
            return;
        }
        if self.since.is_empty() {
            self.since = vec![input.now; object.sets.len()];
        }
        let before = decision.active;
        Python::attach(|py| {
            let stepped = self.try_step(py, input, decision);
            let tick = input.now.0 / object.common.setup.scenario.step_ms;
            if object.store_error(py, tick, stepped).is_none() {
                decision.active = None;
                decision.say.clear();
                decision.rows.clear();
            }
        });
        if decision.active != before {
            for (set, since) in self.object.sets.iter().zip(&mut self.since) {
                if Some(set.id) == before || Some(set.id) == decision.active {
                    *since = input.now;
                }
            }
        }
    }
}

impl PythonAllocator {
    fn try_step(&self, py: Python<'_>, input: &Input<'_>, decision: &mut Decision) -> PyResult<()> {
        let active = decision.active;
        let arguments = |received| {
            let sets = self.object.sets.iter().zip(&self.since).zip(input.choices);
            let sets = sets.map(|((set, since), choice)| {
                let is_active = active == Some(set.id);
                let way = ((input.place)(set.task), (input.travel_s)(set.task));
                let set = Set::new(Arc::clone(set), *choice, way, is_active, *since);
                Bound::new(py, set)
            });
            let sets = PyList::new(py, sets.collect::<PyResult<Vec<_>>>()?)?;
            (input.now.as_secs_f64(), received, sets).into_pyobject(py)
        };
        self.object.set_attribute(
            py,
            intern!(py, "position"),
            input.position.map(<(f32, f32)>::from),
        )?;
        self.object
            .set_attribute(py, intern!(py, "heading"), input.heading_rad)?;
        self.object
            .set_attribute(py, intern!(py, "energy"), input.energy_j)?;
        self.object
            .set_attribute(py, intern!(py, "laden"), input.is_laden)?;
        let stepped = self
            .object
            .step(py, input.draws, arguments, input.received)?;
        let Some((controller, chosen)) = stepped else {
            return Ok(());
        };
        decision.active = chosen_set(&chosen, input)?;
        decision.say = self.object.take_messages(&controller)?;
        self.take_bids(&controller, input, decision)
    }

    /// Moves the bids of the Python object to the log rows.
    fn take_bids(
        &self,
        controller: &Bound<'_, PyAny>,
        input: &Input<'_>,
        decision: &mut Decision,
    ) -> PyResult<()> {
        let bids = controller.getattr(intern!(controller.py(), "_bids"))?;
        let bids = bids.cast::<PyDict>()?;
        let mut values: Vec<(BehaviorId, f64)> = Vec::new();
        for (set, bid) in bids.iter() {
            let (set, bid) = (BehaviorId(set.extract()?), bid.extract()?);
            if !input.choices.iter().any(|choice| choice.behavior == set) {
                return Err(PyValueError::new_err(format!(
                    "bid: there is no set with the id {}; use a set of this step",
                    set.0
                )));
            }
            values.push((set, bid));
        }
        bids.clear();
        rows(self.object.me, input, decision, |set| {
            let mut values = values.iter();
            values.find(|(other, _)| *other == set).map(|(_, bid)| *bid)
        });
        Ok(())
    }
}

/// Returns the set that a step has chosen.
fn chosen_set(chosen: &Bound<'_, PyAny>, input: &Input<'_>) -> PyResult<Option<BehaviorId>> {
    if chosen.is_none() {
        return Ok(None);
    }
    let Ok(set) = chosen.cast::<Set>() else {
        let class_name = chosen.get_type().name()?;
        return Err(PyTypeError::new_err(format!(
            "step returned {class_name}; it must return one of its sets or None"
        )));
    };
    let behavior = set.get().behavior();
    let mut choices = input.choices.iter();
    match choices.find(|choice| choice.behavior == behavior) {
        Some(choice) if choice.applicable => Ok(Some(behavior)),
        Some(_) => Err(PyValueError::new_err(format!(
            "step returned {}, which is not applicable; it must return an applicable set or None",
            set.repr()?
        ))),
        None => Err(PyValueError::new_err(format!(
            "step returned {}, which is not one of its sets",
            set.repr()?
        ))),
    }
}

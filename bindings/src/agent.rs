//! A whole mind that is written in Python: it gets what the robot senses and hears, and returns what it does.
//!
//! To the engine it is a mission's mind, of which at most one behavior is applicable, the one that it says it is doing, and an allocator
//! that obeys: so heartbeats and state changes are made for it as for all others.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::mission::Lore;
use alliance_proto::mission::items::{Gripper, ItemsDeed};
use alliance_proto::mission::{Bytes, Deed};
use alliance_proto::readings::Actuation;
use alliance_proto::scenario::Setup;
use alliance_proto::team::Broadcast;
use alliance_proto::telemetry::{Note, NoteKind};
use alliance_proto::time::SimTime;
use glam::Vec2;
use missions::{observe, service};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use robot_agent::allocator::{
    Allocator, Choice, Decision, Draws, Framed, Input, Me, Mind, OwnBehavior, Prepared, RouteCost,
};
use robot_agent::mission::{Action, AgentMission, Moment, Perception};

use crate::mind::{Common, Object};
use crate::readings;
use crate::rows::rows;

/// What a robot's mind says in a step, on its way from the one part of it to the other.
type Words = Arc<Mutex<Vec<AllocationMessage>>>;

/// Those of a class in a run.
#[derive(Debug)]
pub struct Agents {
    common: Arc<Common>,
    words: Mutex<BTreeMap<RobotId, Words>>,
}

impl Agents {
    pub fn new(common: Arc<Common>) -> Self {
        Self {
            common,
            words: Mutex::default(),
        }
    }

    fn words_of(&self, robot: RobotId) -> Words {
        let words = lock(&self.words).entry(robot).or_default().clone();
        lock(&words).clear();
        words
    }
}

impl Prepared for Agents {
    fn mind(&self, me: Me, _: &Setup) -> Box<dyn Mind> {
        let words = self.words_of(me.robot);
        Box::new(Framed::<Obedient>::new(me, &words))
    }

    fn mission(&self, robot: RobotId, setup: &Setup) -> Option<Box<dyn AgentMission>> {
        let behaviors = OwnBehavior::all_of(robot, setup);
        Some(Box::new(Whole {
            object: Object::new(robot, &behaviors, &self.common),
            behaviors: behaviors.into(),
            words: self.words_of(robot),
            position: None,
            is_laden: false,
            done: Done::default(),
        }))
    }
}

/// A panic ends the process, so a poisoned lock is never seen.
fn lock<T>(place: &Mutex<T>) -> MutexGuard<'_, T> {
    place.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The allocator of a mind that decides by itself.
#[derive(Clone, Debug)]
struct Obedient {
    me: RobotId,
    words: Words,
}

impl Allocator for Obedient {
    type Config = Words;

    fn new(me: &Me, words: &Words) -> Self {
        Self {
            me: me.robot,
            words: Arc::clone(words),
        }
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let mut choices = input.choices.iter();
        let doing = choices.find(|choice| choice.applicable);
        decision.active = doing.map(|choice| choice.behavior);
        decision.say.append(&mut lock(&self.words));
        if decision.active.is_some() {
            rows(self.me, input, decision, |_| None);
        }
    }
}

/// One robot's mind.
#[derive(Clone, Debug)]
struct Whole {
    object: Object,
    behaviors: Arc<[OwnBehavior]>,
    words: Words,
    position: Option<Vec2>,
    is_laden: bool,
    done: Done,
}

/// What came of a step.
#[derive(Clone, Debug, Default)]
struct Done {
    actuation: Actuation,
    doing: Option<BehaviorId>,
    progressed: Option<TaskId>,
}

/// `alliance_agent.Deed`.
#[derive(FromPyObject)]
struct Told {
    speed: f32,
    turn: f32,
    gripper: String,
    report: bool,
    work: Option<u16>,
    read: Option<u32>,
    watch: bool,
    doing: Option<String>,
    progress: bool,
}

impl RouteCost for Whole {
    fn seconds(&self, _: &[TaskId], _: TaskId) -> Option<f64> {
        None
    }
}

impl AgentMission for Whole {
    fn perceive(
        &mut self,
        moment: &Moment<'_>,
        heard: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.position = moment.readings.pose.map(|pose| pose.position);
        self.is_laden = moment.readings.mission.items().holding == Some(true);
        let tick = moment.now.0 / self.object.common.setup.scenario.step_ms;
        self.done = if self.object.has_failed() {
            Done::default()
        } else {
            Python::attach(|py| {
                let stepped = self.try_step(py, moment, tick, heard);
                self.object.or_note(py, tick, stepped).unwrap_or_default()
            })
        };
        let is_done = |own: &OwnBehavior| self.done.doing == Some(own.id);
        perception
            .applicable
            .extend(self.behaviors.iter().map(is_done));
        if let Some(task) = self.done.progressed {
            let catalog = &self.object.common.setup.catalog;
            perception.progressed.push(task);
            perception.notes.push(Note {
                kind: NoteKind::Progress,
                detail: catalog.task_name(task).to_owned(),
            });
        }
    }

    fn choices(&self, _: &Moment<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        for (own, &applicable) in self.behaviors.iter().zip(applicable) {
            choices.push(Choice {
                behavior: own.id,
                task: own.task,
                round: SimTime::ZERO,
                applicable,
                cost_s: None,
                reward: 1.0,
                priority: own.priority,
                max_robots: own.max_robots,
            });
        }
    }

    fn act(&mut self, _: &Moment<'_>, _: Option<BehaviorId>, action: &mut Action) {
        action.actuation = self.done.actuation;
    }

    fn lore(&self, lore: &mut Lore) {
        *lore = Lore::Nothing;
    }

    fn position(&self) -> Option<Vec2> {
        self.position
    }

    fn is_laden(&self) -> bool {
        self.is_laden
    }

    fn checkpoint(&self) -> Box<dyn AgentMission> {
        Box::new(self.clone())
    }
}

impl Whole {
    fn try_step(
        &self,
        py: Python<'_>,
        moment: &Moment<'_>,
        tick: u64,
        heard: &[Arc<Broadcast>],
    ) -> PyResult<Done> {
        let setup = &self.object.common.setup;
        let draws = Draws::of(setup.seed, self.object.me, tick);
        let given = |heard| {
            let readings = readings::to_python(py, moment.readings, setup)?;
            (moment.now.as_secs_f64(), readings, heard).into_pyobject(py)
        };
        let Some((mind, deed)) = self.object.step(py, draws, given, heard)? else {
            return Ok(Done::default());
        };
        let class = py.import(intern!(py, "alliance_agent._minds"))?;
        if !deed.is_instance(&class.getattr(intern!(py, "Deed"))?)? {
            let what = deed.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "step returned {what}; it must return a Deed"
            )));
        }
        let done = self.done_of(&deed.extract()?, moment)?;
        mind.call_method1(intern!(py, "_speak"), (deed.getattr(intern!(py, "say"))?,))?;
        *lock(&self.words) = self.object.take_words(&mind)?;
        Ok(done)
    }

    fn done_of(&self, told: &Told, moment: &Moment<'_>) -> PyResult<Done> {
        let wrong = |text: String| Err(PyValueError::new_err(text));
        for (name, value) in [("speed", told.speed), ("turn", told.turn)] {
            if !value.is_finite() {
                return wrong(format!("Deed: {name} is {value}, which is no number"));
            }
        }
        let doing = match &told.doing {
            None => None,
            Some(name) => {
                let mut own = self.object.own.iter();
                let Some(set) = own.find(|own| own.name == *name) else {
                    let own: Vec<&str> = self.object.own.iter().map(|own| &*own.name).collect();
                    return wrong(format!(
                        "Deed: doing '{name}', which is none of its sets; these are {}",
                        own.join(", ")
                    ));
                };
                Some(set)
            }
        };
        if told.progress && doing.is_none() {
            return wrong("Deed: progress with what? State what it is doing".to_owned());
        }
        Ok(Done {
            actuation: Actuation {
                speed_m_s: told.speed,
                turn_rad_s: told.turn,
                deed: self.deed_of(told, moment)?,
            },
            doing: doing.map(|set| set.id),
            progressed: doing.filter(|_| told.progress).map(|set| set.task),
        })
    }

    /// What it does beside driving, as its mission has it.
    fn deed_of(&self, told: &Told, moment: &Moment<'_>) -> PyResult<Deed> {
        let gripper = match told.gripper.as_str() {
            "keep" => Gripper::Keep,
            "pick" => Gripper::Pick,
            "drop" => Gripper::Drop,
            other => {
                return Err(PyValueError::new_err(format!(
                    "Deed: gripper is '{other}'; use 'keep', 'pick' or 'drop'"
                )));
            }
        };
        let open = |bytes: Result<Bytes<_>, _>| match bytes {
            Ok(bytes) => Ok(Deed::Open(bytes)),
            Err(error) => Err(PyValueError::new_err(format!("Deed: {error}"))),
        };
        match self.object.common.setup.catalog.mission.name() {
            "waste" => Ok(ItemsDeed {
                gripper,
                report: told.report,
            }
            .into()),
            // Whose device is dead has not looked.
            "observe" if told.watch && readings::sees_targets(moment.readings) => {
                open(Bytes::encode(&observe::bus::Watch))
            }
            "service" => open(Bytes::encode(&service::bus::Deed {
                work: told.work,
                read: told.read,
            })),
            _ => Ok(Deed::Nothing),
        }
    }
}

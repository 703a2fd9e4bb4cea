//! A mission's controller with its own types, for missions that have no typed messages on the bus.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::sync::Arc;

use glam::Vec2;
use proto::codec;
use proto::mission::{Action, Bytes, MAX_KNOWLEDGE_BYTES, Payload, SensorReading, SharedKnowledge};
use proto::readings::Readings;
use proto::team::{Broadcast, BroadcastContent, Bulletin, BulletinKind, BulletinSubject};
use scenario::Setup;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use serde::Serialize;
use serde::de::DeserializeOwned;
use smallvec::SmallVec;

use super::{AgentMission, ControllerInput, Perception, SharedMission, StepOutput};
use crate::allocator::{Choice, OwnBehavior, RouteCost};

/// The number of broadcasts in one step that need no allocation.
const AT_ONCE: usize = 8;

/// An [`AgentMission`] with its own types, which documents each method. [`ControllerAdapter`] adapts it.
///
/// ```
/// use scenario::testkit::{DRILL, default_setup};
/// use robot_agent::agent::{Agent, TeamConfig};
/// use robot_agent::registry::AgentRegistry;
/// use robot_agent::mission::prelude::*;
/// use serde::{Deserialize, Serialize};
///
/// /// Rings a bell ten times for its task. Heartbeats contain the count.
/// #[derive(Clone, Debug)]
/// struct Ringer {
///     rung: u32,
/// }
///
/// #[derive(Serialize, Deserialize)]
/// struct Ring;
///
/// impl TypedController for Ringer {
///     type SensorReading = bool;
///     type Action = Ring;
///     type SharedKnowledge = u32;
///     type Bulletin = ();
///
///     fn new(_: RobotId, _: &Setup) -> Self {
///         Self { rung: 0 }
///     }
///
///     fn perceive(&mut self, input: &TypedStepInput<Self>, _: &[ReceivedBroadcast<Self>], perception: &mut Perception) {
///         perception.applicable.extend(input.behaviors.iter().map(|_| self.rung < 10));
///     }
///
///     fn act(
///         &mut self,
///         input: &TypedStepInput<Self>,
///         active: Option<BehaviorId>,
///         _: &mut StepOutput,
///     ) -> Option<Ring> {
///         input.task_of(active)?;
///         self.rung += 1;
///         Some(Ring)
///     }
///
///     fn shared_knowledge(&self) -> u32 {
///         self.rung
///     }
/// }
///
/// // The drill is a mission for tests, which supplies the tasks and behaviors.
/// let registry = AgentRegistry::built_in().with_mission(MissionController::new::<Ringer>(DRILL));
/// let setup = default_setup(1);
/// let team = TeamConfig::new(&setup.for_robots(), &registry)?;
/// let blue = Agent::new(RobotId(0), 1, &setup.for_robots(), &team);
/// # Ok::<(), robot_agent::allocator::ConfigError>(())
/// ```
pub trait TypedController: Clone + Debug + Send + 'static {
    /// The readings of the mission's devices, as the world's part of the mission encodes them.
    type SensorReading: DeserializeOwned + Default + Clone + Debug + Send;

    /// The action of a robot beside driving, at most [`MAX_ACTION_BYTES`](proto::mission::MAX_ACTION_BYTES) bytes on the
    /// bus.
    type Action: Serialize;

    /// The shared knowledge that every heartbeat repeats, at most [`MAX_KNOWLEDGE_BYTES`] bytes on the bus.
    type SharedKnowledge: Serialize + DeserializeOwned;

    /// The content of an immediate broadcast, at most [`MAX_KNOWLEDGE_BYTES`] bytes on the bus.
    type Bulletin: Serialize + DeserializeOwned;

    /// Creates the controller of a robot at the start of an incarnation.
    fn new(robot: RobotId, setup: &Setup) -> Self;

    /// Merges readings and broadcasts into the state, see [`AgentMission::perceive`].
    fn perceive(
        &mut self,
        input: &TypedStepInput<'_, Self>,
        received: &[ReceivedBroadcast<'_, Self>],
        perception: &mut Perception,
    );

    /// Adds one choice per behavior, see [`AgentMission::choices`]. By default all units have the same reward, the
    /// cost is [`seconds`](TypedController::seconds), and the round is [`round`](TypedController::round).
    fn choices(
        &self,
        input: &TypedStepInput<'_, Self>,
        applicable: &[bool],
        choices: &mut Vec<Choice>,
    ) {
        for (behavior, &applicable) in input.behaviors.iter().zip(applicable) {
            choices.push(Choice {
                behavior: behavior.id,
                task: behavior.task,
                round: self.round(input, behavior.task),
                applicable,
                cost_s: self.seconds(self.position(input.position), &[], behavior.task),
                reward: 1.0,
                priority: behavior.priority,
                max_robots: behavior.max_robots,
            });
        }
    }

    /// Returns the start of the task's current round, see [`Choice::round`]. By default a task is due only once.
    fn round(&self, input: &TypedStepInput<'_, Self>, task: TaskId) -> SimTime {
        let _ = (input, task);
        SimTime::ZERO
    }

    /// Computes the action of the active behavior, see [`AgentMission::act`]. [`bulletin`] creates bulletins.
    fn act(
        &mut self,
        input: &TypedStepInput<'_, Self>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) -> Option<Self::Action>;

    /// Returns the shared knowledge for the heartbeat, see [`AgentMission::shared_knowledge`].
    fn shared_knowledge(&self) -> Self::SharedKnowledge;

    /// Returns the estimated position, see [`AgentMission::position`]. By default the reading of the position sensor.
    fn position(&self, sensed: Option<Vec2>) -> Option<Vec2> {
        sensed
    }

    /// Returns whether the robot carries an object of its task, see [`AgentMission::is_laden`].
    fn is_laden(&self) -> bool {
        false
    }

    /// Returns the cost of a task from the robot's position `_from`, see [`RouteCost::seconds`].
    fn seconds(&self, _from: Option<Vec2>, _after: &[TaskId], _task: TaskId) -> Option<f64> {
        None
    }
}

/// The inputs of a step beside broadcasts.
#[derive(Debug)]
pub struct TypedStepInput<'a, M: TypedController> {
    pub now: SimTime,
    pub readings: &'a Readings,
    /// The reading of the position sensor, m.
    pub position: Option<Vec2>,
    /// The readings of the mission's devices; the default without readings.
    pub reading: &'a M::SensorReading,
    /// The robot's behaviors, in the order of `Catalog::behaviors_of`.
    pub behaviors: &'a [OwnBehavior],
}

impl<M: TypedController> TypedStepInput<'_, M> {
    /// Returns the task of the active behavior.
    #[must_use]
    pub fn task_of(&self, active: Option<BehaviorId>) -> Option<TaskId> {
        let behavior = self
            .behaviors
            .iter()
            .find(|behavior| Some(behavior.id) == active);
        behavior.map(|behavior| behavior.task)
    }
}

/// A received broadcast. Without content of this mission it has neither shared knowledge nor a bulletin.
#[derive(Debug)]
pub struct ReceivedBroadcast<'a, M: TypedController> {
    /// The entire broadcast, with sender, time and allocator state.
    pub broadcast: &'a Broadcast,
    /// The shared knowledge of the sender.
    pub shared_knowledge: Option<M::SharedKnowledge>,
    /// The content of an immediate broadcast.
    pub bulletin: Option<M::Bulletin>,
}

impl<'a, M: TypedController> ReceivedBroadcast<'a, M> {
    fn from_broadcast(broadcast: &'a Broadcast) -> Self {
        let (shared_knowledge, bulletin) = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => match &heartbeat.shared_knowledge {
                SharedKnowledge::Open(bytes) => (codec::decode(bytes).ok(), None),
                _ => (None, None),
            },
            BroadcastContent::Bulletin(bulletin) => match &bulletin.payload {
                Payload::Open(bytes) => (None, codec::decode(bytes).ok()),
                _ => (None, None),
            },
            BroadcastContent::Allocation(_) => (None, None),
        };
        Self {
            broadcast,
            shared_knowledge,
            bulletin,
        }
    }
}

/// Creates a bulletin with a payload of the mission's own type.
///
/// # Panics
/// Panics if the payload exceeds [`MAX_KNOWLEDGE_BYTES`] bytes.
pub fn bulletin<T: Serialize>(
    kind: BulletinKind,
    about: Option<BulletinSubject>,
    content: &T,
) -> Bulletin {
    let mut bytes = Vec::new();
    encode("the content of a bulletin", content, &mut bytes);
    Bulletin {
        kind,
        about,
        payload: Payload::Open(bytes),
    }
}

fn encode<T: Serialize>(subject: &str, value: &T, bytes: &mut Vec<u8>) {
    bytes.resize(MAX_KNOWLEDGE_BYTES, 0);
    match codec::encode_to_slice(value, bytes) {
        Ok(length) if length <= MAX_KNOWLEDGE_BYTES => bytes.truncate(length),
        Ok(length) => {
            panic!(
                "{subject} takes {length} bytes; at most {MAX_KNOWLEDGE_BYTES} bytes are allowed"
            )
        }
        Err(error) => panic!("{subject}: {error}"),
    }
}

/// An adapter from a [`TypedController`] to an [`AgentMission`].
#[derive(Clone, Debug)]
pub struct ControllerAdapter<M: TypedController> {
    controller: M,
    reading: M::SensorReading,
    position: Option<Vec2>,
    behaviors: Arc<[OwnBehavior]>,
}

impl<M: TypedController> ControllerAdapter<M> {
    /// Wraps the controller of a robot, before its first readings.
    #[must_use]
    pub fn new(controller: M, robot: RobotId, setup: &Setup) -> Self {
        Self {
            controller,
            reading: M::SensorReading::default(),
            position: None,
            behaviors: OwnBehavior::of_robot(robot, setup).into(),
        }
    }
}

impl<'a, M: TypedController> TypedStepInput<'a, M> {
    fn new(
        input: &ControllerInput<'a>,
        sensed: &'a M::SensorReading,
        own: &'a [OwnBehavior],
    ) -> Self {
        Self {
            now: input.now,
            readings: input.readings,
            position: input.readings.pose.map(|pose| pose.position),
            reading: sensed,
            behaviors: own,
        }
    }
}

/// The shared part of a mission whose robots share no data.
pub(super) struct NoSharedData<M>(PhantomData<fn() -> M>);

impl<M> NoSharedData<M> {
    pub fn new() -> Self {
        Self(PhantomData)
    }
}

impl<M> Debug for NoSharedData<M> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Each")
    }
}

impl<M: TypedController> SharedMission for NoSharedData<M> {
    fn create_controller(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission> {
        Box::new(ControllerAdapter::new(M::new(robot, setup), robot, setup))
    }
}

impl<M: TypedController> RouteCost for ControllerAdapter<M> {
    fn seconds(&self, after: &[TaskId], task: TaskId) -> Option<f64> {
        self.controller.seconds(self.position(), after, task)
    }
}

impl<M: TypedController> AgentMission for ControllerAdapter<M> {
    fn perceive(
        &mut self,
        input: &ControllerInput<'_>,
        received: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.reading = match &input.readings.mission {
            SensorReading::Open(bytes) => bytes.decode().unwrap_or_default(),
            _ => M::SensorReading::default(),
        };
        let received: SmallVec<[ReceivedBroadcast<'_, M>; AT_ONCE]> = received
            .iter()
            .map(|broadcast| ReceivedBroadcast::from_broadcast(broadcast))
            .collect();
        let input = TypedStepInput::new(input, &self.reading, &self.behaviors);
        self.position = input.position;
        self.controller.perceive(&input, &received, perception);
    }

    fn choices(&self, input: &ControllerInput<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        let input = TypedStepInput::new(input, &self.reading, &self.behaviors);
        self.controller.choices(&input, applicable, choices);
    }

    /// # Panics
    /// Panics if the encoded action is too large.
    fn act(
        &mut self,
        input: &ControllerInput<'_>,
        active: Option<BehaviorId>,
        output: &mut StepOutput,
    ) {
        let input = TypedStepInput::new(input, &self.reading, &self.behaviors);
        if let Some(action) = self.controller.act(&input, active, output) {
            output.actuation.action = match Bytes::encode(&action) {
                Ok(bytes) => Action::Open(bytes),
                Err(error) => panic!("the action of a robot for its mission: {error}"),
            };
        }
    }

    fn shared_knowledge(&self, knowledge: &mut SharedKnowledge) {
        let mut bytes = match std::mem::take(knowledge) {
            SharedKnowledge::Open(bytes) => bytes,
            _ => Vec::new(),
        };
        encode(
            "the shared knowledge of a robot",
            &self.controller.shared_knowledge(),
            &mut bytes,
        );
        *knowledge = SharedKnowledge::Open(bytes);
    }

    fn position(&self) -> Option<Vec2> {
        self.controller.position(self.position)
    }

    fn is_laden(&self) -> bool {
        self.controller.is_laden()
    }

    fn checkpoint(&self) -> Box<dyn AgentMission> {
        Box::new(self.clone())
    }
}

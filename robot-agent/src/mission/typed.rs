//! A mission's mind in types of its own, for missions that have no typed place on the bus.

use std::fmt::Debug;
use std::marker::PhantomData;
use std::sync::Arc;

use alliance_proto::codec;
use alliance_proto::ids::{BehaviorId, RobotId, TaskId};
use alliance_proto::mission::{Bytes, Deed, LORE_MAX, Lore, Payload, Sensed};
use alliance_proto::readings::Readings;
use alliance_proto::scenario::Setup;
use alliance_proto::team::{About, Broadcast, Bulletin, BulletinKind, Content};
use alliance_proto::time::SimTime;
use glam::Vec2;
use serde::Serialize;
use serde::de::DeserializeOwned;
use smallvec::SmallVec;

use super::{Action, AgentMission, Moment, Perception, SharedMission};
use crate::allocator::{Choice, OwnBehavior, RouteCost};

/// An [`AgentMission`] in types of its own: see there what each method is for. [`Typed`] makes it one.
///
/// ```
/// use alliance_proto::testkit::{DRILL, default_setup};
/// use robot_agent::agent::{Agent, TeamConfig};
/// use robot_agent::allocator::AgentRegistry;
/// use robot_agent::mission::prelude::*;
/// use serde::{Deserialize, Serialize};
///
/// /// Rings a bell whenever it has nothing better to do than its task; heartbeats say how often it has.
/// #[derive(Clone, Debug)]
/// struct Ringer {
///     rung: u32,
/// }
///
/// #[derive(Serialize, Deserialize)]
/// struct Ring;
///
/// impl TypedMind for Ringer {
///     type Sensed = bool;
///     type Deed = Ring;
///     type Lore = u32;
///     type Bulletin = ();
///
///     fn new(_: RobotId, _: &Setup) -> Self {
///         Self { rung: 0 }
///     }
///
///     fn perceive(&mut self, moment: &TypedMoment<Self>, _: &[Heard<Self>], perception: &mut Perception) {
///         perception.applicable.extend(moment.own.iter().map(|_| self.rung < 10));
///     }
///
///     fn act(
///         &mut self,
///         moment: &TypedMoment<Self>,
///         active: Option<BehaviorId>,
///         _: &mut Action,
///     ) -> Option<Ring> {
///         moment.task_of(active)?;
///         self.rung += 1;
///         Some(Ring)
///     }
///
///     fn lore(&self) -> u32 {
///         self.rung
///     }
/// }
///
/// // With the words of the drill, a mission for tests.
/// let registry = AgentRegistry::built_in().mission(MissionMind::of::<Ringer>(DRILL));
/// let setup = default_setup(1);
/// let team = TeamConfig::of(&setup.briefing(), &registry)?;
/// let blue = Agent::new(RobotId(0), 1, &setup.briefing(), &team);
/// # Ok::<(), robot_agent::allocator::ConfigError>(())
/// ```
pub trait TypedMind: Clone + Debug + Send + 'static {
    /// What its devices tell, as the mission's world side has it.
    type Sensed: DeserializeOwned + Default + Clone + Debug + Send;

    /// What a robot does beside driving: [`DEED_MAX`](alliance_proto::mission::DEED_MAX) bytes on the bus at most.
    type Deed: Serialize;

    /// What heartbeats repeat: [`LORE_MAX`] bytes on the bus at most.
    type Lore: Serialize + DeserializeOwned;

    /// What is told at once: [`LORE_MAX`] bytes on the bus at most.
    type Bulletin: Serialize + DeserializeOwned;

    /// A robot at the start of an incarnation: it has sensed and heard nothing yet.
    fn new(robot: RobotId, setup: &Setup) -> Self;

    /// See [`AgentMission::perceive`].
    fn perceive(
        &mut self,
        moment: &TypedMoment<'_, Self>,
        heard: &[Heard<'_, Self>],
        perception: &mut Perception,
    );

    /// See [`AgentMission::choices`]. As it stands here, a unit of each task is worth the same, costs what
    /// [`seconds`](TypedMind::seconds) says, and is due since [`round`](TypedMind::round).
    fn choices(
        &self,
        moment: &TypedMoment<'_, Self>,
        applicable: &[bool],
        choices: &mut Vec<Choice>,
    ) {
        for (own, &applicable) in moment.own.iter().zip(applicable) {
            choices.push(Choice {
                behavior: own.id,
                task: own.task,
                round: self.round(moment, own.task),
                applicable,
                cost_s: self.seconds(self.position(moment.position), &[], own.task),
                reward: 1.0,
                priority: own.priority,
                max_robots: own.max_robots,
            });
        }
    }

    /// See [`Choice::round`]. Where it is not said, a task is never due again.
    fn round(&self, moment: &TypedMoment<'_, Self>, task: TaskId) -> SimTime {
        let _ = (moment, task);
        SimTime::ZERO
    }

    /// See [`AgentMission::act`]. What is returned is the deed; bulletins are made by [`bulletin`].
    fn act(
        &mut self,
        moment: &TypedMoment<'_, Self>,
        active: Option<BehaviorId>,
        action: &mut Action,
    ) -> Option<Self::Deed>;

    /// See [`AgentMission::lore`].
    fn lore(&self) -> Self::Lore;

    /// See [`AgentMission::position`]. Where its position sensor says, where it is not said.
    fn position(&self, sensed: Option<Vec2>) -> Option<Vec2> {
        sensed
    }

    /// See [`AgentMission::is_laden`].
    fn is_laden(&self) -> bool {
        false
    }

    /// See [`RouteCost::seconds`]. `from` is where the robot is.
    fn seconds(&self, _from: Option<Vec2>, _after: &[TaskId], _task: TaskId) -> Option<f64> {
        None
    }
}

/// What a step is made from, beside what is heard.
#[derive(Debug)]
pub struct TypedMoment<'a, M: TypedMind> {
    /// Time of the step.
    pub now: SimTime,
    /// What the robot senses.
    pub readings: &'a Readings,
    /// Where its position sensor says that it is, m.
    pub position: Option<Vec2>,
    /// What the mission's devices tell; the default if they tell nothing.
    pub sensed: &'a M::Sensed,
    /// The robot's behaviors, in the order of `Catalog::behaviors_of`.
    pub own: &'a [OwnBehavior],
}

impl<M: TypedMind> TypedMoment<'_, M> {
    /// The task of the behavior that is active, if one is.
    #[must_use]
    pub fn task_of(&self, active: Option<BehaviorId>) -> Option<TaskId> {
        let own = self.own.iter().find(|own| Some(own.id) == active);
        own.map(|own| own.task)
    }
}

/// A broadcast that is heard. One that says nothing of this mission's has neither lore nor bulletin.
#[derive(Debug)]
pub struct Heard<'a, M: TypedMind> {
    /// All of it: who sends it, when, and what its allocator does.
    pub broadcast: &'a Broadcast,
    /// What its sender knows.
    pub lore: Option<M::Lore>,
    /// What its sender tells at once.
    pub bulletin: Option<M::Bulletin>,
}

impl<'a, M: TypedMind> Heard<'a, M> {
    fn of(broadcast: &'a Broadcast) -> Self {
        let (lore, bulletin) = match &broadcast.body {
            Content::Heartbeat(heartbeat) => match &heartbeat.lore {
                Lore::Open(bytes) => (codec::decode(bytes).ok(), None),
                _ => (None, None),
            },
            Content::Bulletin(bulletin) => match &bulletin.payload {
                Payload::Open(bytes) => (None, codec::decode(bytes).ok()),
                _ => (None, None),
            },
            Content::Allocation(_) => (None, None),
        };
        Self {
            broadcast,
            lore,
            bulletin,
        }
    }
}

/// A bulletin of an open mission.
///
/// # Panics
/// If it is larger than it may be.
pub fn bulletin<T: Serialize>(kind: BulletinKind, about: Option<About>, told: &T) -> Bulletin {
    let mut bytes = Vec::new();
    encode("what a mission tells", told, &mut bytes);
    Bulletin {
        kind,
        about,
        payload: Payload::Open(bytes),
    }
}

/// Writes an encoding, in the memory of an old one.
fn encode<T: Serialize>(what: &str, value: &T, bytes: &mut Vec<u8>) {
    bytes.resize(LORE_MAX, 0);
    match codec::encode_to_slice(value, bytes) {
        Ok(length) if length <= LORE_MAX => bytes.truncate(length),
        Ok(length) => panic!("{what} takes {length} bytes, {LORE_MAX} at most may be sent"),
        Err(error) => panic!("{what}: {error}"),
    }
}

/// A [`TypedMind`] as the agent takes it.
#[derive(Clone, Debug)]
pub struct Typed<M: TypedMind> {
    mind: M,
    sensed: M::Sensed,
    position: Option<Vec2>,
    own: Arc<[OwnBehavior]>,
}

impl<M: TypedMind> Typed<M> {
    /// That mind of a robot, which has sensed nothing yet.
    #[must_use]
    pub fn new(mind: M, robot: RobotId, setup: &Setup) -> Self {
        Self {
            mind,
            sensed: M::Sensed::default(),
            position: None,
            own: OwnBehavior::all_of(robot, setup).into(),
        }
    }
}

impl<'a, M: TypedMind> TypedMoment<'a, M> {
    fn of(moment: &Moment<'a>, sensed: &'a M::Sensed, own: &'a [OwnBehavior]) -> Self {
        Self {
            now: moment.now,
            readings: moment.readings,
            position: moment.readings.pose.map(|pose| pose.position),
            sensed,
            own,
        }
    }
}

/// Robots that have nothing in common.
pub(super) struct Each<M>(PhantomData<fn() -> M>);

impl<M> Each<M> {
    pub fn new() -> Self {
        Self(PhantomData)
    }
}

impl<M> Debug for Each<M> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Each")
    }
}

impl<M: TypedMind> SharedMission for Each<M> {
    fn mind(&self, robot: RobotId, setup: &Setup) -> Box<dyn AgentMission> {
        Box::new(Typed::new(M::new(robot, setup), robot, setup))
    }
}

impl<M: TypedMind> RouteCost for Typed<M> {
    fn seconds(&self, after: &[TaskId], task: TaskId) -> Option<f64> {
        self.mind.seconds(self.position(), after, task)
    }
}

impl<M: TypedMind> AgentMission for Typed<M> {
    fn perceive(
        &mut self,
        moment: &Moment<'_>,
        heard: &[Arc<Broadcast>],
        perception: &mut Perception,
    ) {
        self.sensed = match &moment.readings.mission {
            Sensed::Open(bytes) => bytes.decode().unwrap_or_default(),
            _ => M::Sensed::default(),
        };
        // In place, for a step does not allocate; few speak in a step.
        let heard: SmallVec<[Heard<'_, M>; 4]> = heard.iter().map(|it| Heard::of(it)).collect();
        let moment = TypedMoment::of(moment, &self.sensed, &self.own);
        self.position = moment.position;
        self.mind.perceive(&moment, &heard, perception);
    }

    fn choices(&self, moment: &Moment<'_>, applicable: &[bool], choices: &mut Vec<Choice>) {
        let moment = TypedMoment::of(moment, &self.sensed, &self.own);
        self.mind.choices(&moment, applicable, choices);
    }

    /// # Panics
    /// If the deed is larger than it may be.
    fn act(&mut self, moment: &Moment<'_>, active: Option<BehaviorId>, action: &mut Action) {
        let moment = TypedMoment::of(moment, &self.sensed, &self.own);
        if let Some(deed) = self.mind.act(&moment, active, action) {
            action.actuation.deed = match Bytes::encode(&deed) {
                Ok(bytes) => Deed::Open(bytes),
                Err(error) => panic!("what a robot does for its mission: {error}"),
            };
        }
    }

    fn lore(&self, lore: &mut Lore) {
        let mut bytes = match std::mem::take(lore) {
            Lore::Open(bytes) => bytes,
            _ => Vec::new(),
        };
        encode("what a robot knows", &self.mind.lore(), &mut bytes);
        *lore = Lore::Open(bytes);
    }

    fn position(&self) -> Option<Vec2> {
        self.mind.position(self.position)
    }

    fn is_laden(&self) -> bool {
        self.mind.is_laden()
    }

    fn checkpoint(&self) -> Box<dyn AgentMission> {
        Box::new(self.clone())
    }
}

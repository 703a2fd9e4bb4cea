//! Broadcasts between robots (thesis §3.3.4 and §4.2.3).

use std::fmt::Formatter;

use glam::Vec2;
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Error, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::allocation::AllocationMessage;
use crate::codec::{self, CodecError};
use crate::mission::items::ItemsBulletin;
use crate::mission::{Payload, SharedKnowledge};
use scenario::ids::{BehaviorId, Incarnation, RobotId, TaskId, Tick};
use scenario::time::SimTime;

/// A message from one robot to all others. The world passes it on ([`crate::tick::ToAgent::Tick`]).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Broadcast {
    pub sender: RobotId,
    pub incarnation: Incarnation,
    /// The tick in which it was sent.
    pub tick: Tick,
    /// The index among the sender's broadcasts of that tick, from 0.
    pub index: u16,
    /// The running number within the incarnation, from 0.
    pub seq: u64,
    /// The simulated time of sending.
    pub sent: SimTime,
    pub body: BroadcastContent,
}

/// The identity of a broadcast as a key of a map, the oldest first: tick, sender, incarnation and index.
pub type BroadcastKey = (Tick, RobotId, Incarnation, u16);

impl Broadcast {
    #[must_use]
    pub fn key(&self) -> BroadcastKey {
        (self.tick, self.sender, self.incarnation, self.index)
    }

    /// Returns the shared knowledge in a heartbeat of a mission without items; `None` without knowledge of that type.
    #[must_use]
    pub fn shared_knowledge<K: DeserializeOwned>(&self) -> Option<K> {
        codec::decode(self.knowledge_bytes()?).ok()
    }

    /// Reads the shared knowledge in a heartbeat of a mission without items, a sequence of at most `most` items. `items` is
    /// empty without knowledge of that type.
    pub fn read_shared_items<T: DeserializeOwned>(&self, most: usize, items: &mut Vec<T>) {
        items.clear();
        if let Some(bytes) = self.knowledge_bytes() {
            // Malformed knowledge leaves the list empty.
            let _ = codec::decode_items(bytes, most, items);
        }
    }

    fn knowledge_bytes(&self) -> Option<&[u8]> {
        match &self.body {
            BroadcastContent::Heartbeat(Heartbeat {
                shared_knowledge: SharedKnowledge::Open(bytes),
                ..
            }) => Some(bytes),
            _ => None,
        }
    }

    /// Returns the content of a bulletin of a mission without items; `None` without content of that type.
    #[must_use]
    pub fn bulletin<B: DeserializeOwned>(&self) -> Option<B> {
        match &self.body {
            BroadcastContent::Bulletin(Bulletin {
                payload: Payload::Open(bytes),
                ..
            }) => codec::decode(bytes).ok(),
            _ => None,
        }
    }

    /// Returns the first behavior set or task that does not exist in a run with so many sets and tasks, as a text.
    #[must_use]
    pub fn unknown_number(&self, sets: usize, tasks: usize) -> Option<String> {
        let (set, task) = match &self.body {
            BroadcastContent::Heartbeat(heartbeat) => (heartbeat.set, heartbeat.task),
            BroadcastContent::Bulletin(Bulletin { about, .. }) => {
                (about.map(|about| about.set), about.map(|about| about.task))
            }
            BroadcastContent::Allocation(_) => (None, None),
        };
        let unknown = |what: &str, index: usize, count: usize| {
            (index >= count).then(|| format!("{what} {index} does not exist; there are {count}"))
        };
        let set = set.and_then(|set| unknown("behavior set", set.index(), sets));
        set.or_else(|| task.and_then(|task| unknown("task", task.index(), tasks)))
    }
}

/// The encoding of a broadcast, which is written once for all receivers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EncodedBroadcast(Vec<u8>);

impl EncodedBroadcast {
    /// Encodes a broadcast.
    ///
    /// # Errors
    /// Returns [`CodecError::TooLarge`] above the size limit of a message.
    pub fn of(broadcast: &Broadcast) -> Result<Self, CodecError> {
        codec::encode(broadcast).map(Self)
    }

    /// Returns the size, bytes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.0.len()
    }

    /// Decodes the broadcast.
    ///
    /// # Errors
    /// Returns any [`CodecError`] if the bytes are not a broadcast.
    pub fn decode(&self) -> Result<Broadcast, CodecError> {
        codec::decode(&self.0)
    }
}

impl Serialize for EncodedBroadcast {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de> Deserialize<'de> for EncodedBroadcast {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Encoding;

        impl Visitor<'_> for Encoding {
            type Value = EncodedBroadcast;

            fn expecting(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
                formatter.write_str("the bytes of a broadcast")
            }

            fn visit_bytes<E: Error>(self, bytes: &[u8]) -> Result<Self::Value, E> {
                Ok(EncodedBroadcast(bytes.to_vec()))
            }
        }

        deserializer.deserialize_bytes(Encoding)
    }
}

/// The contents of a broadcast.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum BroadcastContent {
    /// The state of the sender, sent regularly.
    Heartbeat(Heartbeat),
    /// A message of the mission, sent immediately. Heartbeats repeat shared knowledge later.
    Bulletin(Bulletin),
    /// A message of the sender's allocator.
    Allocation(AllocationMessage),
}

/// The kinds of broadcast. Each has its own key below `team/<robot>/`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
pub enum BroadcastKind {
    Heartbeat,
    FirstBulletin,
    SecondBulletin,
    Allocation,
}

impl BroadcastKind {
    pub const ALL: [Self; 4] = [
        Self::Heartbeat,
        Self::FirstBulletin,
        Self::SecondBulletin,
        Self::Allocation,
    ];

    /// Returns the last chunk of the key expression, and the `kind` column of messages.csv. `bulletins` are the
    /// [names](scenario::mission::data::MissionVocabulary::bulletins) of the mission's bulletins.
    #[must_use]
    pub fn name(self, bulletins: [&'static str; 2]) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::FirstBulletin => bulletins[0],
            Self::SecondBulletin => bulletins[1],
            Self::Allocation => "allocation",
        }
    }
}

impl BroadcastContent {
    #[must_use]
    pub fn kind(&self) -> BroadcastKind {
        match self {
            Self::Heartbeat(_) => BroadcastKind::Heartbeat,
            Self::Bulletin(bulletin) => match bulletin.kind {
                BulletinKind::First => BroadcastKind::FirstBulletin,
                BulletinKind::Second => BroadcastKind::SecondBulletin,
            },
            Self::Allocation(_) => BroadcastKind::Allocation,
        }
    }
}

/// A broadcast with contents of the mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bulletin {
    /// The kind, among those of the mission.
    pub kind: BulletinKind,
    /// The task that the message is about, if there is one.
    pub about: Option<BulletinSubject>,
    pub payload: Payload,
}

impl ItemsBulletin {
    #[must_use]
    pub fn into_bulletin(self, about: Option<BulletinSubject>) -> Bulletin {
        Bulletin {
            kind: match self {
                Self::PositionUpdate(_) => BulletinKind::First,
                Self::Withdrawal(_) => BulletinKind::Second,
            },
            about,
            payload: Payload::Items(self),
        }
    }
}

/// The kinds of bulletins of a mission. There are at most two: the draws of a link number all kinds of broadcasts,
/// including heartbeats and allocation messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs)] // The mission defines their meaning.
pub enum BulletinKind {
    First,
    Second,
}

/// The subject of a bulletin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BulletinSubject {
    pub task: TaskId,
    pub set: BehaviorId,
    /// The sender's progress count of the task.
    pub progress: u32,
}

/// The state of a robot with respect to a task, as in its heartbeats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum TaskState {
    Executing,
    /// The behavior set is at the threshold and waits for a teammate to leave the task.
    Waiting,
    /// The robot executes no task, but is alive.
    Idle,
    /// The robot has just left the task.
    Released,
}

impl TaskState {
    /// Returns the `state` column of messages.csv.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Executing => "executing",
            Self::Waiting => "waiting",
            Self::Idle => "idle",
            Self::Released => "released",
        }
    }
}

/// A heartbeat: sent immediately on a change of state or progress, and otherwise every 1/ρ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Heartbeat {
    pub state: TaskState,
    pub since: SimTime,
    pub set: Option<BehaviorId>,
    pub task: Option<TaskId>,
    /// The number of effects on the world that the sender has achieved on the task so far.
    pub progress: u32,
    /// The sender's estimate of its position, m.
    pub position: Option<Vec2>,
    pub carrying: bool,
    /// The sender's shared knowledge about the mission.
    pub shared_knowledge: SharedKnowledge,
}

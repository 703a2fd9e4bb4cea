//! The state of an agent between the messages of the bus: its reaction to ticks and broadcasts.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use cluster::member::Member;
use proto::codec::{CodecError, decode, decode_first};
use proto::secret::{OpenError, PairKeys, Secret};
use proto::team::{Broadcast, BroadcastId};
use proto::tick::{Outcome, TickMessage, ToAgent};
use scenario::ids::{Incarnation, RobotId, Tick};
use tokio::sync::oneshot;
use tokio::time::Instant;
use zenoh::Wait;
use zenoh::pubsub::Publisher;

use crate::agent::{TentativeAgent, Workspace};
use crate::radio::Radio;

/// The time to wait for listed broadcasts before they count as lost. It is well below the world's stall deadline.
/// Broadcasts usually arrive before the tick that lists them.
pub const MANIFEST_DEADLINE: Duration = Duration::from_secs(2);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AgentEnd {
    RunOver(Outcome),
    Superseded,
    /// The process received SIGTERM or SIGINT.
    Signaled,
    /// The connection to the world is lost.
    WorldLost,
}

pub enum AgentState {
    Joining {
        ended: Option<oneshot::Sender<AgentEnd>>,
    },
    Alive(Box<Alive>),
}

pub struct Alive {
    pub secret: Secret,
    pub broadcast_keys: BroadcastKeys,
    pub robot: RobotId,
    pub incarnation: Incarnation,
    /// The names of all robots, by rank. A broadcast must arrive on its sender's key.
    pub names: Vec<String>,
    pub agent: TentativeAgent,
    pub radio: Radio,
    pub space: Workspace,
    /// The latest tick that the world sent to this incarnation. An older tick is a replayed message; a copy of the
    /// latest is a repeated request.
    pub latest: Option<Tick>,
    /// A tick with missing broadcasts, and the deadline for them.
    pub pending: Option<(Box<TickMessage>, Instant)>,
    pub publishers: Publishers,
    pub ended: Option<oneshot::Sender<AgentEnd>>,
}

/// Locks a mutex and ignores poisoning, because a panic ends the process.
pub fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug, thiserror::Error)]
pub enum Ignore {
    #[error(transparent)]
    Unread(#[from] OpenError),
    #[error("{0}")]
    Unfit(&'static str),
}

impl AgentState {
    pub fn receive_from_world(&mut self, message: ToAgent) -> Result<(), Ignore> {
        match (message, self) {
            (ToAgent::End(outcome), state) => state.end(AgentEnd::RunOver(outcome)),
            (ToAgent::Dismissed(incarnation), AgentState::Alive(alive)) => {
                if alive.incarnation == incarnation {
                    alive.end(AgentEnd::Superseded);
                }
            }
            (ToAgent::Tick(tick), AgentState::Alive(alive)) => return alive.receive_tick(tick),
            (ToAgent::Informed(mut tick, ground_truth), AgentState::Alive(alive)) => {
                tick.ground_truth = ground_truth;
                return alive.receive_tick(tick);
            }
            (_, AgentState::Joining { .. }) => {}
        }
        Ok(())
    }

    pub fn receive_broadcast(
        &mut self,
        name: &str,
        key: &str,
        sealed: &[u8],
    ) -> Result<(), Ignore> {
        match self {
            AgentState::Alive(alive) => alive.receive_broadcast(name, key, sealed),
            AgentState::Joining { .. } => Ok(()),
        }
    }

    pub fn give_up_waiting(&mut self) {
        if let AgentState::Alive(alive) = self
            && let Some((_, until)) = &alive.pending
            && *until <= Instant::now()
            && let Some((tick, _)) = alive.pending.take()
        {
            tracing::warn!(tick = tick.tick, "listed broadcasts did not arrive");
            alive.step(tick);
        }
    }

    pub fn end(&mut self, end: AgentEnd) {
        let ended = match self {
            AgentState::Joining { ended } => ended,
            AgentState::Alive(alive) => &mut alive.ended,
        };
        if let Some(ended) = ended.take() {
            // The receiver is dropped only when the process ends.
            let _ = ended.send(end);
        }
    }
}

impl Alive {
    fn receive_tick(&mut self, tick: Box<TickMessage>) -> Result<(), Ignore> {
        if tick.incarnation > self.incarnation {
            self.end(AgentEnd::Superseded);
            return Ok(());
        }
        if tick.incarnation < self.incarnation || Some(tick.tick) < self.latest {
            return Err(Ignore::Unfit("stale"));
        }
        if Some(tick.tick) == self.latest {
            // The world repeats the tick because it has no answer: the report is lost or in flight.
            if self.pending.is_none() {
                self.publish();
            }
            return Ok(());
        }
        self.latest = Some(tick.tick);
        if self.radio.has_all(&tick.manifest) {
            self.step(tick);
        } else {
            self.pending = Some((tick, Instant::now() + MANIFEST_DEADLINE));
        }
        Ok(())
    }

    fn receive_broadcast(&mut self, name: &str, key: &str, sealed: &[u8]) -> Result<(), Ignore> {
        let sender = self.names.iter().position(|known| known == name);
        let sender = sender.ok_or(Ignore::Unfit("from an unknown sender"))?;
        let message = self.broadcast_keys.unseal(key, sealed, sender)?;
        let broadcast: Broadcast = match decode(message) {
            Ok(broadcast) => broadcast,
            Err(error) => {
                if let Ok(id) = decode_first::<BroadcastId>(message)
                    && id.sender.index() == sender
                    && self.radio.receive_undecodable(id)
                {
                    self.step_if_complete();
                }
                return Err(OpenError::from(error).into());
            }
        };
        if broadcast.sender.index() != sender {
            return Err(Ignore::Unfit("on another robot's key"));
        }
        if broadcast.sender == self.robot {
            return Err(Ignore::Unfit("from this robot itself"));
        }
        if !self.radio.receive(broadcast) {
            return Err(Ignore::Unfit("stale"));
        }
        self.step_if_complete();
        Ok(())
    }

    /// Runs the pending step if all broadcasts that it waits for have arrived.
    fn step_if_complete(&mut self) {
        if let Some((tick, _)) = &self.pending
            && self.radio.has_all(&tick.manifest)
            && let Some((tick, _)) = self.pending.take()
        {
            self.step(tick);
        }
    }

    fn step(&mut self, tick: Box<TickMessage>) {
        let space = &mut self.space;
        self.radio.collect(&tick.manifest, &mut space.arrived);
        self.agent.step(tick, space);
        self.publish();
    }

    fn publish(&self) {
        for broadcast in &self.space.broadcasts {
            let publisher = &self.publishers.team[broadcast.body.kind() as usize];
            publish(
                publisher,
                self.broadcast_keys.seal(publisher.key_expr(), broadcast),
            );
        }
        let publisher = &self.publishers.report;
        let report = self.secret.seal(publisher.key_expr(), &self.space.report);
        publish(publisher, report);
    }

    fn end(&mut self, end: AgentEnd) {
        if let Some(ended) = self.ended.take() {
            let _ = ended.send(end);
        }
    }
}

/// Publishes a message. A failure counts as message loss, which the receivers detect.
fn publish(publisher: &Publisher<'_>, sealed: Result<Vec<u8>, CodecError>) {
    match sealed {
        Ok(bytes) => {
            if let Err(error) = publisher.put(bytes).wait() {
                tracing::warn!(%error, key = %publisher.key_expr(), "not published");
            }
        }
        Err(error) => tracing::error!(%error, key = %publisher.key_expr(), "not published"),
    }
}

pub struct Publishers {
    pub report: Publisher<'static>,
    /// A publisher per [`BroadcastKind`], in the order of its declaration.
    pub team: Vec<Publisher<'static>>,
}

pub enum BroadcastKeys {
    /// A single token for all robots, on one machine.
    Token(Secret),
    /// A key per pair of robots, over a network.
    Pairs(PairKeys),
}

impl BroadcastKeys {
    /// Returns `None` if the member has neither kind of key.
    pub fn new(run: &Member, robot: RobotId, pairs: Option<Vec<u128>>) -> Option<Self> {
        match (pairs, &run.token) {
            (Some(keys), _) if robot.index() < keys.len() => {
                Some(Self::Pairs(PairKeys::new(robot.index(), keys)))
            }
            (None, Some(token)) => Some(Self::Token(Secret::from_token(token))),
            _ => None,
        }
    }

    fn seal(&self, key: &str, broadcast: &Broadcast) -> Result<Vec<u8>, CodecError> {
        match self {
            Self::Token(token) => token.seal(key, broadcast),
            Self::Pairs(pairs) => pairs.seal(key, broadcast),
        }
    }

    fn unseal<'s>(
        &self,
        key: &str,
        sealed: &'s [u8],
        sender: usize,
    ) -> Result<&'s [u8], OpenError> {
        match self {
            Self::Token(token) => token.unseal(key, sealed),
            Self::Pairs(pairs) => pairs.unseal(key, sealed, sender),
        }
    }
}

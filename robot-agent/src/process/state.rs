//! The state of an agent between the messages of the bus: its reaction to ticks.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use proto::codec::CodecError;
use proto::secret::{OpenError, Secret};
use proto::team::EncodedBroadcast;
use proto::tick::{ManifestEntry, Outcome, TickMessage, ToAgent};
use scenario::ids::{Incarnation, Tick};
use tokio::sync::oneshot;
use zenoh::Wait;
use zenoh::pubsub::Publisher;

use crate::agent::{TentativeAgent, Workspace};

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
    pub incarnation: Incarnation,
    pub agent: TentativeAgent,
    pub space: Workspace,
    /// The latest tick that the world sent to this incarnation. An older tick is a replayed message; a copy of the
    /// latest is a repeated request.
    pub latest: Option<Tick>,
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
            (
                ToAgent::Tick {
                    mut tick,
                    ground_truth,
                    broadcasts,
                },
                AgentState::Alive(alive),
            ) => {
                tick.ground_truth = ground_truth;
                return alive.receive_tick(tick, &broadcasts);
            }
            (_, AgentState::Joining { .. }) => {}
        }
        Ok(())
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
    fn receive_tick(
        &mut self,
        tick: Box<TickMessage>,
        broadcasts: &[Option<EncodedBroadcast>],
    ) -> Result<(), Ignore> {
        if tick.incarnation > self.incarnation {
            self.end(AgentEnd::Superseded);
            return Ok(());
        }
        if tick.incarnation < self.incarnation || Some(tick.tick) < self.latest {
            return Err(Ignore::Unfit("stale"));
        }
        if Some(tick.tick) == self.latest {
            // The world repeats the tick because it has no answer: the report is lost or in flight.
            self.publish();
            return Ok(());
        }
        let listed = tick.manifest.iter().flat_map(ManifestEntry::keys).count();
        if broadcasts.len() != listed {
            return Err(Ignore::Unfit("with other broadcasts than it lists"));
        }
        self.latest = Some(tick.tick);
        let decoded = broadcasts.iter().map(|broadcast| {
            // A broadcast that cannot be decoded is lost.
            let decoded = broadcast.as_ref()?.decode().ok()?;
            Some(Arc::new(decoded))
        });
        self.space.arrived.clear();
        self.space.arrived.extend(decoded);
        self.agent.step(tick, &mut self.space);
        self.publish();
        Ok(())
    }

    fn publish(&self) {
        for broadcast in &self.space.broadcasts {
            let publisher = &self.publishers.team[broadcast.body.kind() as usize];
            publish(publisher, self.secret.seal(publisher.key_expr(), broadcast));
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

/// Publishes a message. A failure counts as message loss, which the world detects.
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

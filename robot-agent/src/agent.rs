//! One robot's mind: listen, perceive, weigh motivations, act, speak. A plain function of its inputs.

use std::sync::Arc;

use alliance_proto::codec::encoded_len;
use alliance_proto::ids::{Incarnation, RobotId};
use alliance_proto::scenario::Setup;
use alliance_proto::secret::SEAL_BYTES;
use alliance_proto::team::{Broadcast, Content, Heartbeat, Knowledge};
use alliance_proto::tick::{Report, TickMessage};

use crate::alliance::{Announcement, Engine, Parameters, StepInput, StepOutput};
use crate::links::{Heard, Links};
use crate::missions::waste::{Action, Map, Perception, WasteMission};

/// A robot-agent without its process.
#[derive(Clone, Debug)]
pub struct Agent {
    robot: RobotId,
    incarnation: Incarnation,
    /// Messages on their way belong to the state that goes back when a step did not count.
    links: Links,
    engine: Engine,
    mission: WasteMission,
    /// Sequence number of the next broadcast.
    next_seq: u64,
}

/// What all robots of a run know beforehand; there once, however many of them share a process.
#[derive(Clone, Debug)]
pub struct TeamConfig {
    parameters: Arc<Parameters>,
    map: Arc<Map>,
}

impl TeamConfig {
    /// What the robots of that run know.
    #[must_use]
    pub fn of(setup: &Setup) -> Self {
        Self {
            parameters: Arc::new(Parameters::of(setup)),
            map: Arc::new(Map::of(&setup.scenario)),
        }
    }
}

/// Input, output and scratch buffers of a step. Whoever steps agents keeps one for all of them, so a step does not allocate.
#[derive(Debug, Default)]
pub struct Workspace {
    /// For a step: a place for each broadcast of its manifest, in its order; `None` is one that has not arrived. The step
    /// empties it.
    pub arrived: Vec<Option<Arc<Broadcast>>>,
    /// Of a step: for the world.
    pub report: Report,
    /// Of a step: for the team; published before the report.
    pub broadcasts: Vec<Broadcast>,
    /// Broadcasts that nobody will hear any more, for their memory.
    pub spent: Vec<Broadcast>,
    heard: Heard,
    perception: Perception,
    thought: StepOutput,
    action: Action,
}

impl Agent {
    /// A new incarnation of a robot: no memory, all motivations 0.
    #[must_use]
    pub fn new(robot: RobotId, incarnation: Incarnation, setup: &Setup) -> Self {
        Self::with_shared(robot, incarnation, setup, &TeamConfig::of(setup))
    }

    /// A new incarnation of one of many robots in the same process.
    #[must_use]
    pub fn with_shared(
        robot: RobotId,
        incarnation: Incarnation,
        setup: &Setup,
        common: &TeamConfig,
    ) -> Self {
        Self {
            robot,
            incarnation,
            links: Links::new(robot, setup),
            engine: Engine::with_shared(robot, setup, &common.parameters),
            mission: WasteMission::new(robot, setup, &common.map),
            next_seq: 0,
        }
    }

    /// One step of the robot at this tick.
    pub fn step(&mut self, tick: &TickMessage, space: &mut Workspace) {
        self.perceive(tick, space);
        self.think(tick, space);
        self.act(tick, space);
    }

    /// First part of a step: what it hears and senses. Whoever steps several agents may do each part with all of them: the code of
    /// a step is larger than a first-level cache.
    pub fn perceive(&mut self, tick: &TickMessage, space: &mut Workspace) {
        self.links.hear(tick, &mut space.arrived, &mut space.heard);
        self.mission.perceive(
            tick.now,
            &tick.readings,
            &space.heard.inbox,
            &mut space.perception,
        );
    }

    /// Second part: motivations.
    pub fn think(&mut self, tick: &TickMessage, space: &mut Workspace) {
        let input = StepInput {
            now: tick.now,
            heard: &space.heard.inbox,
            applicable: &space.perception.applicable,
            progressed: &space.perception.progressed,
        };
        self.engine.step(&input, &mut space.thought);
        space.heard.inbox.clear();
    }

    /// Third part: what it does, says and reports.
    pub fn act(&mut self, tick: &TickMessage, space: &mut Workspace) {
        let Workspace {
            report,
            broadcasts,
            spent,
            heard,
            perception,
            thought,
            action,
            ..
        } = space;
        let active = self.engine.active();
        self.mission
            .act(tick.now, active, &tick.readings, perception, action);

        broadcasts.clear();
        for announcement in &thought.announcements {
            let body = self.heartbeat(announcement, spent.pop());
            broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
        }
        if !action.bodies.is_empty() {
            for body in action.bodies.drain(..) {
                spent.pop();
                broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
            }
        }

        report.robot = self.robot;
        report.incarnation = self.incarnation;
        report.tick = tick.tick;
        report.actuation = action.actuation;
        report.broadcasts = broadcasts.len() as u16;
        report.broadcast_bytes = broadcasts.iter().map(payload_bytes).sum();
        std::mem::swap(&mut report.motivations, &mut thought.motivations);
        std::mem::swap(&mut report.changes, &mut thought.changes);
        std::mem::swap(&mut report.receptions, &mut heard.receptions);
        report.notes.clear();
        report.notes.append(&mut perception.notes);
        report.notes.append(&mut action.notes);
    }

    /// A heartbeat, in the memory of an old one.
    fn heartbeat(&self, announcement: &Announcement, spent: Option<Broadcast>) -> Content {
        let mut knowledge = match spent.map(|broadcast| broadcast.body) {
            Some(Content::Heartbeat(heartbeat)) => heartbeat.knowledge,
            _ => Knowledge::default(),
        };
        knowledge.clone_from(self.mission.knowledge());
        Content::Heartbeat(Heartbeat {
            state: announcement.state,
            since: announcement.since,
            set: announcement.set,
            task: announcement.task,
            progress: announcement.progress,
            position: self.mission.position(),
            carrying: self.mission.carrying(),
            knowledge,
        })
    }

    fn broadcast(&mut self, tick: &TickMessage, index: usize, body: Content) -> Broadcast {
        let seq = self.next_seq;
        self.next_seq += 1;
        Broadcast {
            sender: self.robot,
            incarnation: self.incarnation,
            tick: tick.tick,
            index: index as u16,
            seq,
            sent: tick.now,
            body,
        }
    }
}

/// What a broadcast takes on the bus, without what zenoh and TCP add.
fn payload_bytes(broadcast: &Broadcast) -> u32 {
    // One too large to be encoded is not published either.
    encoded_len(broadcast).map_or(0, |bytes| (bytes + SEAL_BYTES) as u32)
}

/// Steps from one checkpoint of an agent to the next. To copy it takes half as long as a step.
const CHECKPOINT_EVERY: usize = 32;

/// An agent whose latest step is tentative until the world says that its report counted (DESIGN §4 "What counts").
///
/// Steps seldom fail to count, so that nothing is copied for each: from a checkpoint those that counted are made once more.
#[derive(Clone, Debug)]
pub struct TentativeAgent {
    agent: Agent,
    checkpoint: Agent,
    /// The steps since the checkpoint, of which all but the latest counted.
    since: Vec<Taken>,
}

/// What a step was made from.
#[derive(Clone, Debug)]
struct Taken {
    tick: Box<TickMessage>,
    arrived: Vec<Option<Arc<Broadcast>>>,
}

impl TentativeAgent {
    /// Wraps an agent that has not stepped yet.
    #[must_use]
    pub fn new(agent: Agent) -> Self {
        Self {
            checkpoint: agent.clone(),
            agent,
            since: Vec::with_capacity(CHECKPOINT_EVERY),
        }
    }

    /// Goes back to the state before the latest step if that step did not count, then makes [`Agent::step`].
    pub fn step(&mut self, tick: Box<TickMessage>, space: &mut Workspace) {
        let latest = self.since.last().map(|taken| taken.tick.tick);
        if latest.is_some_and(|latest| tick.last_counted.is_none_or(|counted| counted < latest)) {
            self.since.pop();
            self.agent = self.checkpoint.clone();
            let mut again = Workspace::default();
            for taken in &self.since {
                again.arrived.clone_from(&taken.arrived);
                self.agent.step(&taken.tick, &mut again);
            }
        }
        if self.since.len() == CHECKPOINT_EVERY {
            self.since.clear();
            self.checkpoint = self.agent.clone();
        }
        let arrived = space.arrived.clone();
        self.agent.step(&tick, space);
        self.since.push(Taken { tick, arrived });
    }
}

#[cfg(test)]
mod tests;

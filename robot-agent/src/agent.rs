//! One robot's mind: listen, perceive, weigh motivations, act, speak. A plain function of its inputs.

use std::sync::Arc;

use alliance_proto::codec::encode;
use alliance_proto::ids::{Incarnation, RobotId, Tick};
use alliance_proto::scenario::Setup;
use alliance_proto::secret::SEAL_BYTES;
use alliance_proto::team::{Body, Broadcast, Heartbeat};
use alliance_proto::tick::{Report, TickMessage};

use crate::alliance::{Announcement, Engine, StepInput};
use crate::links::{Heard, Links};
use crate::missions::waste::{Map, WasteMission};
use crate::roster::Roster;

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
pub struct Common {
    roster: Arc<Roster>,
    map: Arc<Map>,
}

impl Common {
    /// What the robots of that run know.
    #[must_use]
    pub fn of(setup: &Setup) -> Self {
        Self {
            roster: Arc::new(Roster::of(&setup.scenario)),
            map: Arc::new(Map::of(&setup.scenario)),
        }
    }
}

/// What a step gave to the outside.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// For the world.
    pub report: Report,
    /// For the team; published before the report.
    pub broadcasts: Vec<Broadcast>,
}

impl Agent {
    /// A new life of a robot: no memory, all motivations 0.
    #[must_use]
    pub fn new(robot: RobotId, incarnation: Incarnation, setup: &Setup) -> Self {
        Self::one_of(robot, incarnation, setup, &Common::of(setup))
    }

    /// A new life of one of many robots in the same process.
    #[must_use]
    pub fn one_of(
        robot: RobotId,
        incarnation: Incarnation,
        setup: &Setup,
        common: &Common,
    ) -> Self {
        Self {
            robot,
            incarnation,
            links: Links::new(robot, setup),
            engine: Engine::new(robot, setup, &common.roster),
            mission: WasteMission::new(robot, setup, &common.roster, &common.map),
            next_seq: 0,
        }
    }

    /// One step of the robot at this tick. `arrived` has a place for each broadcast of the manifest, in its order; `None` is
    /// one that has not arrived.
    pub fn step(&mut self, tick: &TickMessage, arrived: Vec<Option<Arc<Broadcast>>>) -> Step {
        let now = tick.now;
        let Heard { inbox, receptions } = self.links.hear(tick, arrived);
        let perception = self.mission.perceive(now, &tick.readings, &inbox);
        let thought = self.engine.step(&StepInput {
            now,
            heard: &inbox,
            applicable: &perception.applicable,
            progressed: &perception.progressed,
        });
        let action = self.mission.act(now, self.engine.active(), &tick.readings);

        let heartbeats = thought
            .announcements
            .iter()
            .map(|announcement| self.heartbeat(announcement));
        let bodies: Vec<Body> = heartbeats.chain(action.bodies).collect();
        let broadcasts: Vec<Broadcast> = bodies
            .into_iter()
            .enumerate()
            .map(|(index, body)| self.broadcast(tick, index, body))
            .collect();

        let mut notes = perception.notes;
        notes.extend(action.notes);
        Step {
            report: Report {
                robot: self.robot,
                incarnation: self.incarnation,
                tick: tick.tick,
                actuation: action.actuation,
                broadcasts: broadcasts.len() as u16,
                broadcast_bytes: broadcasts.iter().map(payload_bytes).sum(),
                motivations: thought.motivations,
                changes: thought.changes,
                notes,
                receptions,
            },
            broadcasts,
        }
    }

    fn heartbeat(&self, announcement: &Announcement) -> Body {
        Body::Heartbeat(Heartbeat {
            state: announcement.state,
            since: announcement.since,
            set: announcement.set,
            task: announcement.task,
            progress: announcement.progress,
            position: self.mission.position(),
            carrying: self.mission.carrying(),
            knowledge: self.mission.knowledge().clone(),
        })
    }

    fn broadcast(&mut self, tick: &TickMessage, index: usize, body: Body) -> Broadcast {
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
    encode(broadcast).map_or(0, |bytes| (bytes.len() + SEAL_BYTES) as u32)
}

/// An agent whose latest step is tentative until the world says that its report counted (DESIGN §4 "What counts").
#[derive(Clone, Debug)]
pub struct TentativeAgent {
    agent: Agent,
    /// The latest step's tick, and the agent as it was before it.
    before: Option<(Tick, Agent)>,
}

impl TentativeAgent {
    /// Wraps an agent that has not stepped yet.
    #[must_use]
    pub fn new(agent: Agent) -> Self {
        Self {
            agent,
            before: None,
        }
    }

    /// Goes back to the state before the latest step if that step did not count, then makes [`Agent::step`].
    pub fn step(&mut self, tick: &TickMessage, arrived: Vec<Option<Arc<Broadcast>>>) -> Step {
        if let Some((stepped, before)) = self.before.take()
            && tick.last_counted.is_none_or(|counted| counted < stepped)
        {
            self.agent = before;
        }
        self.before = Some((tick.tick, self.agent.clone()));
        self.agent.step(tick, arrived)
    }
}

#[cfg(test)]
mod tests;

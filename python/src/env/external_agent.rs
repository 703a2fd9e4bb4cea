//! The allocator of a robot whose behavior set or whose body the caller of the environment controls.

use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::Vec2;
use prefetch::{Layer, prefetch};
use proto::team::{BroadcastContent, Heartbeat, TaskState};
use robot_agent::allocator::{Allocator, AllocatorKind, Choice, Decision, Input, SelfState};
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{AllocatorSpec, Setup};

use super::common::Level;
use crate::rows::rows;

/// The name of the allocator in scenario and log.
pub const NAME: &str = "environment";

/// The received data about a teammate, as far as observations contain it.
#[derive(Clone, Copy, Debug)]
pub struct Mate {
    pub position: Option<Vec2>,
    pub executing: Option<u32>,
    pub received: SimTime,
}

/// The data that a robot and its external agent exchange.
#[derive(Clone, Debug, Default)]
pub struct ExternalAgent {
    /// The chosen behavior set. The robot is idle while this set is not applicable.
    pub wanted: Option<BehaviorId>,
    /// `true` if the active set has ended by itself since the flag was last cleared.
    pub has_ended: bool,
    /// The data of the latest step: time and position; at level decide also load, choices and active set.
    pub now: SimTime,
    pub position: Option<Vec2>,
    pub is_laden: bool,
    pub choices: Vec<Choice>,
    /// The place of each choice, m.
    pub places: Vec<Option<Vec2>>,
    pub active: Option<BehaviorId>,
    /// The time since which `active` has its value.
    pub since: SimTime,
    /// The received data about each teammate, by rank.
    pub mates: Vec<Option<Mate>>,
    /// The time after which a silent teammate counts as lost.
    pub ceased_after: SimTime,
}

impl ExternalAgent {
    /// Takes the time, the position and the received heartbeats of a step.
    fn perceive(&mut self, input: &Input<'_>) {
        for broadcast in input.received {
            if let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body
                && let Some(mate) = self.mates.get_mut(broadcast.sender.index())
            {
                *mate = Some(Mate::from_heartbeat(heartbeat, input.now));
            }
        }
        self.now = input.now;
        self.position = input.position;
    }

    /// Returns the number of teammates that report to execute a task, without lost ones.
    pub fn claims_of(&self, task: TaskId) -> usize {
        let mates = self.mates.iter().flatten();
        let claims = |mate: &&Mate| {
            mate.executing == Some(task.0) && self.now.since(mate.received) < self.ceased_after
        };
        mates.filter(claims).count()
    }
}

/// The exchanged data of all robots, by rank. Only the thread that steps the environment uses them.
pub struct ExternalAgents(Mutex<Vec<ExternalAgent>>);

impl ExternalAgents {
    pub fn new(robots: usize) -> Self {
        Self(Mutex::new(vec![ExternalAgent::default(); robots]))
    }

    /// Clears the data of a robot except the chosen set, at the start of an incarnation.
    fn restart(&self, me: &SelfState) {
        let agent = &mut self.lock()[me.robot.index()];
        *agent = ExternalAgent {
            wanted: agent.wanted,
            mates: vec![None; me.team],
            ceased_after: me.ceased_after,
            ..ExternalAgent::default()
        };
    }

    pub fn lock(&self) -> MutexGuard<'_, Vec<ExternalAgent>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Requests the memory of a layer, see [`prefetch`](mod@prefetch).
    pub fn prefetch(&self, layer: Layer) {
        match layer {
            Layer::Fields => {}
            Layer::Lists => prefetch(self),
            Layer::Elements => prefetch(&**self.lock()),
            Layer::Contents => {
                for agent in &*self.lock() {
                    prefetch(&*agent.choices);
                    prefetch(&*agent.mates);
                }
            }
        }
    }

    /// Copies the data of all robots from another environment.
    pub fn copy_from(&self, other: &Self) {
        let other = other.lock().clone();
        *self.lock() = other;
    }
}

impl fmt::Debug for ExternalAgents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("ExternalAgents")
    }
}

/// Returns the allocator for the registry of an environment.
pub fn kind(level: Level, agents: Arc<ExternalAgents>) -> AllocatorKind {
    let spec = AllocatorSpec {
        name: NAME,
        about: "the decisions of an environment's user",
        parameters: [].into(),
        needs_ground_truth: false,
        learns_times: false,
    };
    let agents = move |_: &Setup| Ok(Arc::clone(&agents));
    match level {
        Level::Decide => AllocatorKind::with_config::<ExternalAllocator<true>>(spec, agents),
        Level::Drive => AllocatorKind::with_config::<ExternalAllocator<false>>(spec, agents),
    }
}

/// The allocator at level decide, or at level drive without choices: a driven robot has no behavior, because its body
/// follows the actions.
#[derive(Clone, Debug)]
struct ExternalAllocator<const DECIDES: bool> {
    me: RobotId,
    agents: Arc<ExternalAgents>,
}

impl<const DECIDES: bool> Allocator for ExternalAllocator<DECIDES> {
    type Config = Arc<ExternalAgents>;

    fn weighs_costs() -> bool {
        DECIDES
    }

    fn new(me: &SelfState, agents: &Arc<ExternalAgents>) -> Self {
        agents.restart(me);
        Self {
            me: me.robot,
            agents: Arc::clone(agents),
        }
    }

    /// Exchanges data with another environment, in which a copy of the run continues.
    fn adopt(&mut self, agents: &Arc<ExternalAgents>) -> bool {
        self.agents = Arc::clone(agents);
        true
    }

    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        let agent = &mut self.agents.lock()[self.me.index()];
        agent.perceive(input);
        if !DECIDES {
            return;
        }
        agent.choices.clear();
        agent.choices.extend_from_slice(input.choices);
        agent.places.clear();
        let places = input
            .choices
            .iter()
            .map(|choice| (input.place)(choice.task));
        agent.places.extend(places);
        let applies = |wanted: BehaviorId| {
            let mut choices = input.choices.iter();
            choices.any(|choice| choice.behavior == wanted && choice.applicable)
        };
        let before = decision.active;
        decision.active = agent.wanted.filter(|wanted| applies(*wanted));
        agent.has_ended |= before.is_some() && before == agent.wanted && decision.active.is_none();
        if before != decision.active {
            agent.since = input.now;
        }
        agent.is_laden = input.is_laden;
        agent.active = decision.active;
        rows(self.me, input, decision, |_| None);
    }
}

impl Mate {
    fn from_heartbeat(heartbeat: &Heartbeat, received: SimTime) -> Self {
        let executes = heartbeat.state == TaskState::Executing;
        Self {
            position: heartbeat.position,
            executing: heartbeat.task.filter(|_| executes).map(|task| task.0),
            received,
        }
    }
}

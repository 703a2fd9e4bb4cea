//! One robot's mind: listen, perceive, weigh motivations, act, speak. A plain function of its inputs.

use std::collections::BTreeMap;
use std::sync::Arc;

use alliance_proto::codec::encoded_len;
use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::mission::Lore;
use alliance_proto::scenario::{BehaviorParams, RobotTimes, Setup};
use alliance_proto::secret::SEAL_BYTES;
use alliance_proto::team::{Broadcast, Content, Heartbeat};
use alliance_proto::tick::{Report, TickMessage};
use alliance_proto::time::SimTime;

use crate::allocator::{
    AgentRegistry, Announcement, Choice, ConfigError, Draws, Input, Me, Mind, Outcome, OwnBehavior,
    Prepared, TaskBrief, assignment,
};
use crate::mission::{Action, AgentMission, Moment, Perception, SharedMission};
use alliance_proto::links::{Heard, Links};

/// A robot-agent without its process.
#[derive(Clone, Debug)]
pub struct Agent {
    robot: RobotId,
    incarnation: Incarnation,
    /// Messages on their way belong to the state that goes back when a step did not count.
    links: Links,
    mind: Box<dyn Mind>,
    /// Of the mind.
    weighs_costs: bool,
    /// Of the mind.
    uses_radio: bool,
    mission: Box<dyn AgentMission>,
    seed: u64,
    step_s: f64,
    /// Sequence number of the next broadcast.
    next_seq: u64,
}

/// What all robots of a run know beforehand; there once, however many of them share a process.
#[derive(Clone, Debug)]
pub struct TeamConfig {
    mission: Arc<dyn SharedMission>,
    /// By rank.
    allocators: Vec<Arc<dyn Prepared>>,
    /// Tasks given beforehand, by rank.
    assignment: Vec<Arc<[TaskId]>>,
    tasks: Arc<[TaskBrief]>,
}

impl TeamConfig {
    /// What the robots of that run know; its mission and their allocators come from the registry.
    ///
    /// # Errors
    /// When the registry lacks the mission or an allocator of the run, or its parameters are not such as it takes.
    pub fn of(setup: &Setup, registry: &AgentRegistry) -> Result<Self, ConfigError> {
        let scenario = &setup.scenario;
        let mut prepared: BTreeMap<(Option<&str>, &str), Arc<dyn Prepared>> = BTreeMap::new();
        let mut allocators = Vec::with_capacity(scenario.robots.len());
        for robot in &scenario.robots {
            // A mind that this program does not have is another program's: nobody asks for it here.
            let mind = robot.mind.as_deref().filter(|it| registry.has_mind(it));
            let allocator = scenario.allocator_beside_mind(robot);
            let one = match (prepared.get(&(mind, allocator)), mind) {
                (Some(known), _) => Arc::clone(known),
                (None, Some(mind)) => registry.prepare_mind(mind, setup)?,
                (None, None) => registry.prepare(allocator, setup)?,
            };
            allocators.push(Arc::clone(&one));
            prepared.insert((mind, allocator), one);
        }
        let mission = registry.shared(setup)?;
        // The work of an assignment grows with the cube of the team, so it is made only for those who look at it.
        let assignment = if prepared.values().any(|it| it.wants_assignment()) {
            assignment::assign(&mission.planned_cost_ms(setup))
        } else {
            Vec::new()
        };
        Ok(Self {
            mission,
            allocators,
            assignment,
            tasks: TaskBrief::all(setup),
        })
    }

    fn me(&self, robot: RobotId, incarnation: Incarnation, setup: &Setup) -> Me {
        let own = &setup.scenario.robots[robot.index()];
        let values = setup.alliance.robots.get(&own.name);
        let longest = |seconds: fn(&BehaviorParams) -> f64| {
            let all = values.into_iter().flat_map(|own| own.sets.values());
            SimTime::from_secs_f64(all.map(seconds).fold(0.0, f64::max))
        };
        Me {
            robot,
            incarnation,
            team: setup.scenario.robots.len(),
            tasks: setup.catalog.tasks.len(),
            briefs: Arc::clone(&self.tasks),
            behaviors: OwnBehavior::all_of(robot, setup),
            step_s: SimTime(setup.scenario.step_ms).as_secs_f64(),
            heartbeat_period: longest(|values| 1.0 / values.broadcast_rate_hz),
            ceased_after: longest(|values| values.ceased_after_s),
            assigned: assignment::of(&self.assignment, robot),
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
    /// Broadcasts that are no longer needed; the step reuses their buffers.
    pub spent: Vec<Broadcast>,
    heard: Heard,
    perception: Perception,
    choices: Vec<Choice>,
    outcome: Outcome,
    action: Action,
}

impl Agent {
    /// A new incarnation of a robot: it remembers nothing, and has heard nothing.
    #[must_use]
    pub fn new(robot: RobotId, incarnation: Incarnation, setup: &Setup, team: &TeamConfig) -> Self {
        let prepared = &team.allocators[robot.index()];
        let mind = prepared.mind(team.me(robot, incarnation, setup), setup);
        let mission = prepared.mission(robot, setup);
        Self {
            robot,
            incarnation,
            links: Links::new(robot, setup),
            weighs_costs: mind.weighs_costs(),
            uses_radio: mind.uses_radio(),
            mind,
            mission: mission.unwrap_or_else(|| team.mission.mind(robot, setup)),
            seed: setup.seed,
            step_s: SimTime(setup.scenario.step_ms).as_secs_f64(),
            next_seq: 0,
        }
    }

    /// How long robots need for tasks, as far as this one has learned.
    #[must_use]
    pub fn learned(&self, setup: &Setup) -> RobotTimes {
        let mut all = RobotTimes::new();
        for (task, robot, times) in self.mind.learned() {
            let task = setup.catalog.task_name(task).to_owned();
            let robot = setup.roster.name(robot).to_owned();
            all.entry(task).or_default().insert(robot, times);
        }
        all
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
        if self.uses_radio {
            self.links.hear(tick, &mut space.arrived, &mut space.heard);
        } else {
            space.arrived.clear();
            space.heard.clear();
        }
        space.perception.clear();
        self.mission
            .perceive(&moment(tick), &space.heard.inbox, &mut space.perception);
    }

    /// Second part: the allocator chooses which behavior is active.
    pub fn think(&mut self, tick: &TickMessage, space: &mut Workspace) {
        space.choices.clear();
        if self.weighs_costs {
            let applicable = &space.perception.applicable;
            self.mission
                .choices(&moment(tick), applicable, &mut space.choices);
            let is_number = |choice: &Choice| {
                choice.cost_s.is_none_or(f64::is_finite) && choice.reward.is_finite()
            };
            assert!(
                space.choices.iter().all(is_number),
                "the mission's mind weighs {:?}",
                space.choices.iter().find(|choice| !is_number(choice))
            );
        }
        let input = Input {
            now: tick.now,
            step_s: self.step_s,
            position: self.mission.position(),
            is_laden: self.mission.is_laden(),
            applicable: &space.perception.applicable,
            choices: &space.choices,
            progressed: &space.perception.progressed,
            heard: &space.heard.inbox,
            route: &*self.mission,
            truth: &tick.truth,
            draws: Draws::of(self.seed, self.robot, tick.tick),
        };
        self.mind.step(&input, &mut space.outcome);
        space.heard.inbox.clear();
    }

    /// Third part: what it does, says and reports.
    pub fn act(&mut self, tick: &TickMessage, space: &mut Workspace) {
        space.action.clear();
        self.mission
            .act(&moment(tick), space.outcome.active, &mut space.action);
        let actuation = &space.action.actuation;
        assert!(
            actuation.speed_m_s.is_finite() && actuation.turn_rad_s.is_finite(),
            "the mission's mind drives at {} m/s and {} rad/s",
            actuation.speed_m_s,
            actuation.turn_rad_s
        );
        space.broadcasts.clear();
        if self.uses_radio {
            self.speak(tick, space);
        }
        self.tell_world(tick, space);
    }

    /// What it says to the team.
    fn speak(&mut self, tick: &TickMessage, space: &mut Workspace) {
        let Workspace {
            broadcasts,
            spent,
            outcome,
            action,
            ..
        } = space;
        for announcement in &outcome.announcements {
            let body = self.heartbeat(announcement, spent);
            broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
        }
        // To drain a list that is empty, as in most steps, takes longer than to look.
        if !action.bulletins.is_empty() {
            for bulletin in action.bulletins.drain(..) {
                spent.pop();
                let body = Content::Bulletin(bulletin);
                broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
            }
        }
        if !outcome.say.is_empty() {
            for message in outcome.say.drain(..) {
                let body = Content::Allocation(message);
                broadcasts.push(self.broadcast(tick, broadcasts.len(), body));
            }
        }
    }

    /// What it reports to the world.
    fn tell_world(&self, tick: &TickMessage, space: &mut Workspace) {
        let Workspace {
            report,
            broadcasts,
            heard,
            perception,
            outcome,
            action,
            ..
        } = space;
        report.robot = self.robot;
        report.incarnation = self.incarnation;
        report.tick = tick.tick;
        report.broadcasts = broadcasts.len() as u16;
        report.broadcast_bytes = broadcasts.iter().map(payload_bytes).sum();
        report.active = outcome.active;
        std::mem::swap(&mut report.motivations, &mut outcome.motivations);
        std::mem::swap(&mut report.allocation, &mut outcome.rows);
        std::mem::swap(&mut report.changes, &mut outcome.changes);
        std::mem::swap(&mut report.receptions, &mut heard.receptions);
        report.notes.clear();
        for notes in [&mut perception.notes, &mut action.notes] {
            // To append a list that is empty, as in most steps, takes a call of memcpy.
            if !notes.is_empty() {
                report.notes.append(notes);
            }
        }
        // Last: a copy of what has just been written field by field would cause a store-forwarding stall.
        report.actuation = action.actuation;
    }

    /// A heartbeat, in the memory of an old one.
    fn heartbeat(&self, announcement: &Announcement, spent: &mut Vec<Broadcast>) -> Content {
        let mut lore = Lore::default();
        while let Some(broadcast) = spent.pop() {
            // Others have no memory that is worth keeping.
            if let Content::Heartbeat(heartbeat) = broadcast.body {
                lore = heartbeat.lore;
                break;
            }
        }
        self.mission.lore(&mut lore);
        Content::Heartbeat(Heartbeat {
            state: announcement.state,
            since: announcement.since,
            set: announcement.behavior,
            task: announcement.task,
            progress: announcement.progress,
            position: self.mission.position(),
            carrying: self.mission.is_laden(),
            lore,
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

fn moment(tick: &TickMessage) -> Moment<'_> {
    Moment {
        now: tick.now,
        readings: &tick.readings,
    }
}

/// What a broadcast takes on the bus, without what zenoh and TCP add.
#[must_use]
pub fn payload_bytes(broadcast: &Broadcast) -> u32 {
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

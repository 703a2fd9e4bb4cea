//! Checks that every mission must pass, as one function that a test of the mission's crate calls.
//!
//! The checks step a team without processes and without a log. Each agent receives every broadcast in the next step.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::Vec2;
use proto::codec::encode;
use proto::mission::{Action, Bytes, MAX_KNOWLEDGE_BYTES, Payload, SensorReading, SharedKnowledge};
use proto::readings::{Actuation, Readings};
use proto::team::{Broadcast, BroadcastContent, Bulletin, BulletinKind, Heartbeat};
use proto::tick::{ManifestEntry, TickMessage};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use scenario::ids::{BehaviorId, RobotId, TaskId, Tick};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};
use terminal::panics;
use world_server::mission::FigureValue;
use world_server::world::World;

use crate::{MissionParts, Registry};

#[cfg(test)]
mod tests;

/// The maximum number of steps per trial.
const STEPS: u64 = 1500;

/// Runs the scenario, given as the text of a file, under several conditions and checks the following rules.
///
/// - The catalog is consistent, and a scenario survives writing and reading.
/// - Equal inputs give equal bytes.
/// - The state hash covers the row of mission.csv and all sensor readings.
/// - A step that does not count leaves no trace.
/// - The active behavior belongs to the robot.
/// - Messages, actions and readings of another mission cause no panic.
/// - All reported numbers are finite.
/// - [`check_invariants`](world_server::mission::MissionWorld::check_invariants) succeeds after each step.
///
/// # Panics
/// If a rule is violated. The message states the rule.
pub fn check_mission(parts: MissionParts, scenario: &str) {
    let registry = Registry::built_in().with_mission(parts);
    let read = |text: &str| match Scenario::parse("scenario.toml", text, &registry.vocabulary()) {
        Ok(scenario) => scenario,
        Err(error) => panic!("{error}"),
    };
    let scenario = read(scenario);
    assert_eq!(
        scenario.mission(),
        parts.world.data,
        "the scenario belongs to the mission"
    );
    assert_eq!(
        parts.controller.data, parts.world.data,
        "world and controller have the same mission data"
    );
    let text = scenario_text(&scenario);
    assert!(
        read(&text) == scenario,
        "a scenario survives writing and reading"
    );
    for allocator in registry.vocabulary().allocators {
        let mut scenario = scenario.clone();
        scenario.allocator = Some(allocator.name.to_owned());
        let setup = match Setup::resolve(scenario, 1, None) {
            Ok(resolved) => resolved.setup,
            Err(error) => panic!("{error}"),
        };
        check_catalog(&setup);
        let first = Trial::new(&registry, parts, &setup, None).run();
        let again = Trial::new(&registry, parts, &setup, None).run();
        let name = allocator.name;
        assert!(
            first == again,
            "{name}: the same inputs give the same bytes"
        );
        Trial::new(&registry, parts, &setup, Some(7)).run();
    }
}

fn scenario_text(scenario: &Scenario) -> String {
    // Cannot fail: all keys are strings, and the destination is memory.
    scenario.to_toml().expect("a scenario can be written")
}

fn check_catalog(setup: &Setup) {
    let (catalog, scenario) = (&setup.catalog, &setup.scenario);
    let mission = catalog.mission;
    for (index, task) in catalog.tasks.iter().enumerate() {
        let named = catalog.find_task(&task.name).map(|task| task.index());
        assert_eq!(
            named,
            Some(index),
            "the name of task {} is unique",
            task.name
        );
    }
    assert!(
        catalog.sets.is_sorted_by_key(|behavior| behavior.task),
        "behaviors are sorted by task"
    );
    for behavior in &catalog.sets {
        assert!(
            behavior.task.index() < catalog.tasks.len(),
            "{} has a task",
            behavior.name
        );
        let unit_s = mission.work_unit_s(scenario)(&scenario.body, 1.0, behavior);
        assert!(
            unit_s.is_finite() && unit_s > 0.0,
            "a unit of work of {} takes a positive, finite time",
            behavior.name
        );
    }
}

struct Trial<'s> {
    setup: &'s Setup,
    world: World,
    agents: Vec<Member>,
    /// The random stream that draws disturbances. `None` disables them.
    chance: Option<ChaCha8Rng>,
    /// The broadcasts of the previous step, by sender.
    sent: Vec<Vec<Broadcast>>,
    /// The row of mission.csv for each state hash seen so far.
    rows: BTreeMap<u64, Vec<FigureValue>>,
    trace: Vec<u8>,
}

/// An agent with rollback, and an agent that takes only the steps that count. The two share no data.
struct Member {
    tentative: TentativeAgent,
    undisturbed: Agent,
    last_counted: Option<Tick>,
    readings: Readings,
}

impl<'s> Trial<'s> {
    fn new(registry: &Registry, parts: MissionParts, setup: &'s Setup, seed: Option<u64>) -> Self {
        let briefing = setup.for_robots();
        let team = || {
            let team = TeamConfig::new(&briefing, registry.agents());
            team.unwrap_or_else(|error| panic!("{error}"))
        };
        let teams = [team(), team()];
        let robots = (0..setup.scenario.robots.len() as u32).map(RobotId);
        let member = |robot| {
            let [tentative, undisturbed] = teams
                .each_ref()
                .map(|team| Agent::new(robot, 1, &briefing, team));
            Member {
                tentative: TentativeAgent::new(tentative),
                undisturbed,
                last_counted: None,
                readings: Readings::default(),
            }
        };
        Self {
            setup,
            world: World::new(setup, parts.world),
            sent: vec![Vec::new(); robots.len()],
            agents: robots.map(member).collect(),
            chance: seed.map(ChaCha8Rng::seed_from_u64),
            rows: BTreeMap::new(),
            trace: Vec::new(),
        }
    }

    /// Runs the trial. Returns its trace: all readings, reports, broadcasts and rows, and the state hash after each
    /// step.
    fn run(mut self) -> Vec<u8> {
        for tick in 0..STEPS {
            if self.world.mission().end(self.world.now()).is_some() {
                break;
            }
            let commands = self.agents_step(tick);
            let world = &mut self.world;
            check_no_panic(tick, "the world accepts any action of the robots", || {
                check_state_covers_readings(tick, world, &commands);
                world.step(&commands);
            });
            if let Err(violation) = self.world.mission().check_invariants(&self.world) {
                panic!("tick {tick}: {violation}");
            }
            self.note_state(tick);
        }
        self.trace
    }

    /// Checks that the row of mission.csv depends on the state alone, and appends state and row to the trace.
    fn note_state(&mut self, tick: Tick) {
        let state = self.world.mission().state_hash();
        let mut row = Vec::new();
        self.world.mission().row(&mut row);
        let columns = self.setup.catalog.mission.vocabulary().columns;
        assert_eq!(
            row.len(),
            columns.len(),
            "mission.csv has a value for each column"
        );
        assert!(
            row.iter()
                .all(|value| value.number().is_none_or(f64::is_finite)),
            "tick {tick}: mission.csv contains finite numbers only, not {row:?}"
        );
        let copy = self.world.clone();
        assert_eq!(
            copy.mission().state_hash(),
            state,
            "a copy of the world has the same state hash"
        );
        self.trace.extend(state.to_le_bytes());
        self.trace.extend(encode(&row).unwrap_or_default());
        let before = self.rows.entry(state).or_insert_with(|| row.clone());
        assert_eq!(
            *before, row,
            "tick {tick}: equal states have equal rows in mission.csv"
        );
    }

    fn agents_step(&mut self, tick: Tick) -> Vec<Option<Actuation>> {
        let now = SimTime(tick * self.setup.scenario.step_ms);
        let received = std::mem::replace(&mut self.sent, vec![Vec::new(); self.agents.len()]);
        let mut commands = Vec::new();
        for rank in 0..self.agents.len() {
            let robot = RobotId(rank as u32);
            self.world
                .write_readings(robot, &mut self.agents[rank].readings);
            let mut readings = self.agents[rank].readings.clone();
            let counts = self
                .chance
                .as_mut()
                .is_none_or(|chance| chance.random_bool(0.8));
            if let Some(chance) = &mut self.chance
                && chance.random_bool(0.02)
            {
                readings.mission = junk_sensed(chance);
            }
            let others = (0..)
                .map(RobotId)
                .zip(&received)
                .filter(|(sender, _)| *sender != robot);
            let message = TickMessage {
                incarnation: 1,
                tick,
                now,
                last_counted: self.agents[rank].last_counted,
                manifest: others
                    .clone()
                    .filter(|(_, sent)| !sent.is_empty())
                    .map(|(sender, sent)| ManifestEntry {
                        sender,
                        tick: tick - 1,
                        incarnation: 1,
                        count: sent.len() as u16,
                        link: None,
                    })
                    .collect(),
                ground_truth: Vec::new(),
                held: Vec::new(),
                readings,
            };
            let mut space = Workspace::default();
            space.arrived = others
                .flat_map(|(_, sent)| sent)
                .map(|broadcast| Some(Arc::new(broadcast.clone())))
                .collect();
            let arrived = space.arrived.clone();
            self.trace
                .extend(encode(&message.readings).unwrap_or_default());
            let member = &mut self.agents[rank];
            let rule = "a controller accepts any input and returns finite numbers";
            check_no_panic(tick, rule, || {
                member.tentative.step(Box::new(message.clone()), &mut space);
            });
            if !counts {
                commands.push(None);
                continue;
            }
            member.last_counted = Some(tick);
            let mut expected = Workspace::default();
            expected.arrived = arrived;
            member.undisturbed.step(&message, &mut expected);
            let bytes =
                |space: &Workspace| encode(&(&space.report, &space.broadcasts)).unwrap_or_default();
            assert!(
                bytes(&space) == bytes(&expected),
                "tick {tick}: a step that did not count left a trace in {robot}"
            );
            self.trace.extend(bytes(&space));
            let spec = &self.setup.scenario.robots[rank];
            if let Some(active) = space.report.active {
                let mut behaviors = self.setup.catalog.behaviors_of(spec);
                assert!(
                    behaviors.any(|behavior| behavior == active),
                    "the active behavior belongs to the robot"
                );
            }
            let mut command = space.report.actuation;
            for broadcast in &space.broadcasts {
                if let BroadcastContent::Heartbeat(heartbeat) = &broadcast.body {
                    let place = heartbeat.position;
                    assert!(
                        place.is_none_or(Vec2::is_finite),
                        "tick {tick}: {robot} reports a finite position, not {place:?}"
                    );
                }
            }
            self.sent[rank] = space.broadcasts;
            if let Some(chance) = &mut self.chance {
                if chance.random_bool(0.02) {
                    junk_action(chance, &mut command.action);
                }
                for broadcast in &mut self.sent[rank] {
                    if chance.random_bool(0.1) {
                        junk_broadcast(chance, &mut broadcast.body);
                    }
                }
            }
            commands.push(Some(command));
        }
        commands
    }
}

/// Runs a step in which a mission must not panic.
///
/// # Panics
/// With the rule and the mission's panic message.
fn check_no_panic(tick: Tick, rule: &str, step: impl FnOnce()) {
    if let Err(message) = panics::catch(step) {
        panic!("tick {tick}: {rule}: {message}");
    }
}

/// Checks that the state hash covers all effects of actions on the readings. Steps a copy with and a copy without the
/// actions: equal states must give equal readings.
fn check_state_covers_readings(tick: Tick, world: &World, commands: &[Option<Actuation>]) {
    let idle = |command: Actuation| Actuation {
        action: Action::Nothing,
        ..command
    };
    let without: Vec<_> = commands.iter().map(|command| command.map(idle)).collect();
    if without == commands {
        return;
    }
    let [with, without] = [commands, without.as_slice()].map(|commands| {
        let mut world = world.clone();
        world.step(commands);
        world
    });
    if with.mission().state_hash() != without.mission().state_hash() {
        return;
    }
    for robot in (0..with.robot_count() as u32).map(RobotId) {
        if with.pose(robot) == without.pose(robot) {
            let [with, without] = [&with, &without].map(|world| world.readings(robot).mission);
            assert_eq!(
                with, without,
                "tick {tick}: equal states, but actions change the readings of {robot}"
            );
        }
    }
}

/// Returns readings of another mission, or no readings.
fn junk_sensed(chance: &mut ChaCha8Rng) -> SensorReading {
    let bytes: [u8; 24] = chance.random();
    Bytes::encode(&bytes).map_or(SensorReading::Nothing, SensorReading::from_bytes)
}

/// Replaces an action with random bytes, or changes some of its bytes.
fn junk_action(chance: &mut ChaCha8Rng, action: &mut Action) {
    let original = match action {
        Action::Open(bytes) => bytes.as_slice(),
        _ => &[],
    };
    let junk = junk(chance, original, 8);
    *action = Bytes::from_slice(&junk).map_or(Action::Nothing, Action::Open);
}

/// Returns fewer than `most` random bytes, or the original bytes with about half of them replaced.
fn junk(chance: &mut ChaCha8Rng, original: &[u8], most: usize) -> Vec<u8> {
    if original.is_empty() || chance.random_bool(0.5) {
        let length = chance.random_range(0..most);
        return (0..length).map(|_| chance.random()).collect();
    }
    let mut junk = original.to_vec();
    for byte in &mut junk {
        if chance.random_bool(0.5) {
            *byte = chance.random();
        }
    }
    junk
}

/// Replaces the mission's content of a broadcast with random bytes, or changes some of its bytes.
fn junk_broadcast(chance: &mut ChaCha8Rng, body: &mut BroadcastContent) {
    let original = match body {
        BroadcastContent::Heartbeat(Heartbeat {
            shared_knowledge: SharedKnowledge::Open(bytes),
            ..
        })
        | BroadcastContent::Bulletin(Bulletin {
            payload: Payload::Open(bytes),
            ..
        }) => bytes.as_slice(),
        _ => &[],
    };
    let bytes = junk(chance, original, MAX_KNOWLEDGE_BYTES);
    match body {
        BroadcastContent::Heartbeat(heartbeat) => {
            heartbeat.shared_knowledge = SharedKnowledge::Open(bytes);
            // Receivers drop a heartbeat with an unknown behavior set or task. The others show the content to the
            // controllers.
            if chance.random_bool(0.5) {
                heartbeat.task = Some(TaskId(chance.random()));
                heartbeat.set = Some(BehaviorId(chance.random()));
            }
            heartbeat.position = Some(Vec2::splat(f32::NAN));
        }
        other => {
            *other = BroadcastContent::Bulletin(Bulletin {
                kind: BulletinKind::First,
                about: None,
                payload: Payload::Open(bytes),
            });
        }
    }
}

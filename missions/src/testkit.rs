//! What every mission must keep, as one call from a test of the crate that it lives in (SEAMS.md §6).
//!
//! A team of it is stepped by hand, without processes and without a log: each robot's agent, all of what is said heard in the step
//! after it, and the world.

use std::collections::BTreeMap;
use std::sync::Arc;

use alliance_proto::codec::encode;
use alliance_proto::ids::{BehaviorId, RobotId, TaskId, Tick};
use alliance_proto::mission::{Bytes, Deed, LORE_MAX, Lore, Payload, Sensed};
use alliance_proto::panics;
use alliance_proto::readings::{Actuation, Readings};
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::team::{Broadcast, Bulletin, BulletinKind, Content, Heartbeat};
use alliance_proto::tick::{ManifestEntry, TickMessage};
use alliance_proto::time::SimTime;
use glam::Vec2;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use world_server::mission::Value;
use world_server::world::World;

use crate::{MissionParts, Registry};

#[cfg(test)]
mod tests;

/// Steps of each trial.
const STEPS: u64 = 1500;

/// Plays the scenario, a file's text, in many ways, and asks for the laws: the catalog is in order; a scenario is written as it is
/// read; equal inputs give equal bytes; the state tells apart all that the mission tells; a step that did not count leaves no trace;
/// the active behavior is one's own; foreign words, deeds and readings change nothing, or at least end nothing; what is told is a
/// number; all [holds](world_server::mission::WorldMission::holds) after each step.
///
/// # Panics
/// With the law that does not hold.
pub fn mission(parts: MissionParts, scenario: &str) {
    let registry = Registry::built_in().mission(parts);
    let read = |text: &str| match Scenario::parse("scenario.toml", text, &registry.vocabulary()) {
        Ok(scenario) => scenario,
        Err(error) => panic!("{error}"),
    };
    let scenario = read(scenario);
    assert_eq!(
        scenario.mission(),
        parts.world.data,
        "the section's mission"
    );
    assert_eq!(
        parts.mind.data, parts.world.data,
        "both sides are of one mission"
    );
    let text = scenario_text(&scenario);
    assert!(
        read(&text) == scenario,
        "a scenario is written as it is read"
    );
    for allocator in registry.vocabulary().allocators {
        let mut scenario = scenario.clone();
        scenario.allocator = Some(allocator.name.to_owned());
        let setup = match Setup::resolve(scenario, 1, None) {
            Ok(resolved) => resolved.setup,
            Err(error) => panic!("{error}"),
        };
        catalog(&setup);
        let one = Trial::new(&registry, parts, &setup, None).run();
        let again = Trial::new(&registry, parts, &setup, None).run();
        let name = allocator.name;
        assert!(one == again, "{name}: the same inputs give the same bytes");
        Trial::new(&registry, parts, &setup, Some(7)).run();
    }
}

fn scenario_text(scenario: &Scenario) -> String {
    // Its keys are strings and the destination is memory.
    scenario.to_toml().expect("a scenario can be written")
}

fn catalog(setup: &Setup) {
    let (catalog, scenario) = (&setup.catalog, &setup.scenario);
    let mission = catalog.mission;
    for (index, task) in catalog.tasks.iter().enumerate() {
        let named = catalog.task_named(&task.name).map(|it| it.index());
        assert_eq!(named, Some(index), "task {} is there once", task.name);
    }
    assert!(
        catalog.sets.is_sorted_by_key(|it| it.task),
        "behaviors are in the order of their tasks"
    );
    for behavior in &catalog.sets {
        assert!(
            behavior.task.index() < catalog.tasks.len(),
            "{} has a task",
            behavior.name
        );
        let unit_s = mission.unit_s(scenario, &scenario.body, 1.0, behavior);
        assert!(
            unit_s.is_finite() && unit_s > 0.0,
            "{} takes a time",
            behavior.name
        );
    }
}

/// A team and its world.
struct Trial<'s> {
    setup: &'s Setup,
    world: World,
    agents: Vec<Member>,
    /// Draws what is put in its way; `None`: nothing is.
    chance: Option<ChaCha8Rng>,
    /// What was said in the step before, by sender.
    said: Vec<Vec<Broadcast>>,
    /// What the mission told at each of its states.
    rows: BTreeMap<u64, Vec<Value>>,
    trace: Vec<u8>,
}

/// An agent, and one that takes only the steps that count. They have nothing in common.
struct Member {
    tentative: TentativeAgent,
    undisturbed: Agent,
    last_counted: Option<Tick>,
    readings: Readings,
}

impl<'s> Trial<'s> {
    fn new(registry: &Registry, parts: MissionParts, setup: &'s Setup, seed: Option<u64>) -> Self {
        let briefing = setup.briefing();
        let team = || {
            let team = TeamConfig::of(&briefing, registry.agents());
            team.unwrap_or_else(|error| panic!("{error}"))
        };
        let teams = [team(), team()];
        let robots = (0..setup.scenario.robots.len() as u16).map(RobotId);
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
            said: vec![Vec::new(); robots.len()],
            agents: robots.map(member).collect(),
            chance: seed.map(ChaCha8Rng::seed_from_u64),
            rows: BTreeMap::new(),
            trace: Vec::new(),
        }
    }

    /// Its trace: all readings, reports and rows, and the state after each step.
    fn run(mut self) -> Vec<u8> {
        for tick in 0..STEPS {
            if self.world.mission().end(self.world.now()).is_some() {
                break;
            }
            let commands = self.agents_step(tick);
            let world = &mut self.world;
            goes_on(tick, "the world goes on whatever robots do", || {
                whole(tick, world, &commands);
                world.step(&commands);
            });
            if let Err(violation) = self.world.mission().holds(&self.world) {
                panic!("tick {tick}: {violation}");
            }
            self.note_state(tick);
        }
        self.trace
    }

    /// Equal states tell equal rows: what the mission tells depends on its state alone.
    fn note_state(&mut self, tick: Tick) {
        let state = self.world.mission().state();
        let mut row = Vec::new();
        self.world.mission().row(&mut row);
        let columns = self.setup.catalog.mission.terms().columns;
        assert_eq!(
            row.len(),
            columns.len(),
            "mission.csv has a value for each column"
        );
        assert!(
            row.iter()
                .all(|value| value.number().is_none_or(f64::is_finite)),
            "tick {tick}: mission.csv tells numbers, not {row:?}"
        );
        let copy = self.world.clone();
        assert_eq!(
            copy.mission().state(),
            state,
            "a copy of the world has its state"
        );
        self.trace.extend(state.to_le_bytes());
        self.trace.extend(encode(&row).unwrap_or_default());
        let before = self.rows.entry(state).or_insert_with(|| row.clone());
        assert_eq!(
            *before, row,
            "tick {tick}: equal states, and the mission tells something else"
        );
    }

    fn agents_step(&mut self, tick: Tick) -> Vec<Option<Actuation>> {
        let now = SimTime(tick * self.setup.scenario.step_ms);
        let heard = std::mem::replace(&mut self.said, vec![Vec::new(); self.agents.len()]);
        let mut commands = Vec::new();
        for rank in 0..self.agents.len() {
            let robot = RobotId(rank as u16);
            self.world.sense(robot, &mut self.agents[rank].readings);
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
                .zip(&heard)
                .filter(|(sender, _)| *sender != robot);
            let message = TickMessage {
                incarnation: 1,
                tick,
                now,
                last_counted: self.agents[rank].last_counted,
                manifest: others
                    .clone()
                    .filter(|(_, said)| !said.is_empty())
                    .map(|(sender, said)| ManifestEntry {
                        sender,
                        tick: tick - 1,
                        incarnation: 1,
                        count: said.len() as u16,
                        link: None,
                    })
                    .collect(),
                truth: Vec::new(),
                held: Vec::new(),
                readings,
            };
            let mut space = Workspace::default();
            space.arrived = others
                .flat_map(|(_, said)| said)
                .map(|it| Some(Arc::new(it.clone())))
                .collect();
            let arrived = space.arrived.clone();
            self.trace
                .extend(encode(&message.readings).unwrap_or_default());
            let member = &mut self.agents[rank];
            let law = "a mind goes on whatever it is told, and does what is a number";
            goes_on(tick, law, || {
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
            let own = &self.setup.scenario.robots[rank];
            if let Some(active) = space.report.active {
                let mut behaviors = self.setup.catalog.behaviors_of(own);
                assert!(
                    behaviors.any(|it| it == active),
                    "the active behavior is one's own"
                );
            }
            let mut command = space.report.actuation;
            for said in &space.broadcasts {
                if let Content::Heartbeat(heartbeat) = &said.body {
                    let place = heartbeat.position;
                    assert!(
                        place.is_none_or(Vec2::is_finite),
                        "tick {tick}: {robot} is at a place that is a number, not {place:?}"
                    );
                }
            }
            self.said[rank] = space.broadcasts;
            if let Some(chance) = &mut self.chance {
                if chance.random_bool(0.02) {
                    junk_deed(chance, &mut command.deed);
                }
                for said in &mut self.said[rank] {
                    if chance.random_bool(0.1) {
                        junk_said(chance, &mut said.body);
                    }
                }
            }
            commands.push(Some(command));
        }
        commands
    }
}

/// Does what a mission must not panic in.
///
/// # Panics
/// With the law, and what the mission said.
fn goes_on(tick: Tick, law: &str, step: impl FnOnce()) {
    if let Err(said) = panics::catch(step) {
        panic!("tick {tick}: {law}: {said}");
    }
}

/// What deeds change is in the state: if it is the same with them and without, so is all that is sensed.
fn whole(tick: Tick, world: &World, commands: &[Option<Actuation>]) {
    let idle = |command: Actuation| Actuation {
        deed: Deed::Nothing,
        ..command
    };
    let without: Vec<_> = commands.iter().map(|command| command.map(idle)).collect();
    if without == commands {
        return;
    }
    let [one, other] = [commands, without.as_slice()].map(|commands| {
        let mut world = world.clone();
        world.step(commands);
        world
    });
    if one.mission().state() != other.mission().state() {
        return;
    }
    for robot in (0..one.robot_count() as u16).map(RobotId) {
        if one.pose(robot) == other.pose(robot) {
            let [one, other] = [&one, &other].map(|world| world.readings(robot).mission);
            assert_eq!(
                one, other,
                "tick {tick}: equal states, and {robot} senses something else after deeds than without"
            );
        }
    }
}

/// Readings of another mission, or of none.
fn junk_sensed(chance: &mut ChaCha8Rng) -> Sensed {
    let bytes: [u8; 24] = chance.random();
    Bytes::encode(&bytes).map_or(Sensed::Nothing, |bytes| Sensed::Open(bytes.into()))
}

/// What somebody else's robots do, or one's own that mean something else.
fn junk_deed(chance: &mut ChaCha8Rng, deed: &mut Deed) {
    let own = match deed {
        Deed::Open(own) => own.as_slice(),
        _ => &[],
    };
    let junk = junk(chance, own, 8);
    *deed = Bytes::copied(&junk).map_or(Deed::Nothing, Deed::Open);
}

/// Bytes of any length, or those with some others in their places.
fn junk(chance: &mut ChaCha8Rng, own: &[u8], most: usize) -> Vec<u8> {
    if own.is_empty() || chance.random_bool(0.5) {
        let length = chance.random_range(0..most);
        return (0..length).map(|_| chance.random()).collect();
    }
    let mut junk = own.to_vec();
    for byte in &mut junk {
        if chance.random_bool(0.5) {
            *byte = chance.random();
        }
    }
    junk
}

/// What somebody else's robots say, or one's own that mean something else.
fn junk_said(chance: &mut ChaCha8Rng, body: &mut Content) {
    let own = match body {
        Content::Heartbeat(Heartbeat {
            lore: Lore::Open(own),
            ..
        })
        | Content::Bulletin(Bulletin {
            payload: Payload::Open(own),
            ..
        }) => own.as_slice(),
        _ => &[],
    };
    let bytes = junk(chance, own, LORE_MAX);
    match body {
        Content::Heartbeat(heartbeat) => {
            heartbeat.lore = Lore::Open(bytes);
            heartbeat.task = Some(TaskId(chance.random()));
            heartbeat.set = Some(BehaviorId(chance.random()));
            heartbeat.position = Some(Vec2::splat(f32::NAN));
        }
        other => {
            *other = Content::Bulletin(Bulletin {
                kind: BulletinKind::First,
                about: None,
                payload: Payload::Open(bytes),
            });
        }
    }
}

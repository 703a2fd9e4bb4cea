//! What holds for any broadcast that a member of the run seals, whatever allocator the robot has that hears it; part of the fuzz target
//! and of the test over the corpus.

use std::sync::{Arc, LazyLock};

use alliance_proto::codec::{LIMIT_BYTES, decode, encoded_len};
use alliance_proto::ids::RobotId;
use alliance_proto::scenario::{Scenario, Setup};
use alliance_proto::team::Broadcast;
use alliance_proto::tick::{ManifestEntry, TickMessage};
use alliance_proto::time::SimTime;
use missions::Registry;
use missions::waste::data::{WASTE, default_scenario};
use robot_agent::agent::{Agent, TeamConfig, Workspace};

/// The default mission with each of the allocators, and each other mission in a small size.
static TEAMS: LazyLock<Vec<(Setup, TeamConfig)>> = LazyLock::new(|| {
    let registry = Registry::built_in();
    let vocabulary = registry.vocabulary();
    let with = |name: &str| {
        let mut scenario = default_scenario();
        scenario.allocator = Some(name.to_owned());
        scenario
    };
    let others = vocabulary.missions.iter().filter(|it| **it != WASTE);
    let others = others.filter_map(|mission| mission.family(3, 2));
    let allocators = vocabulary.allocators.iter().map(|it| with(it.name));
    let team = |scenario: Scenario| {
        let setup = Setup::resolve(scenario, 1, None)
            .expect("it is sound")
            .setup;
        let team = TeamConfig::of(&setup, registry.agents()).expect("all are known");
        (setup, team)
    };
    allocators.chain(others).map(team).collect()
});

const ME: RobotId = RobotId(1);

/// Ticks in which it is heard: at once, doubled, again, and late.
const TICKS: [u64; 5] = [1, 2, 2, 40, 400];

/// Whether these bytes are a broadcast. A robot that hears it, once and doubled, early and late, from each of its teammates, goes on: what
/// is active is a behavior that it has, and what it says fits on the bus.
///
/// # Panics
/// When that is not so.
#[must_use]
pub fn is_heard(bytes: &[u8]) -> bool {
    let Ok(broadcast) = decode::<Broadcast>(bytes) else {
        return false;
    };
    for (setup, team) in &*TEAMS {
        let mut agent = Agent::new(ME, 1, setup, team);
        let behaviors = &setup.scenario.robots[ME.index()];
        let behaviors: Vec<_> = setup.catalog.behaviors_of(behaviors).collect();
        let mut space = Workspace::default();
        let (mut tick, mut last_counted) = (0, None);
        for (step, later) in TICKS.into_iter().enumerate() {
            tick += later;
            // The world lists nobody but members, by ranks of their own.
            let senders = [RobotId(0), RobotId(2)];
            let copies = senders.repeat(if step == 1 { 2 } else { 1 });
            let heard = |sender| {
                let broadcast = broadcast.clone();
                Some(Arc::new(Broadcast {
                    sender,
                    ..broadcast
                }))
            };
            let entry = |sender| ManifestEntry {
                sender,
                tick: broadcast.tick,
                incarnation: broadcast.incarnation,
                count: 1,
                link: None,
            };
            space.arrived = copies.iter().copied().map(heard).collect();
            let message = TickMessage {
                incarnation: 1,
                tick,
                now: SimTime(tick * setup.scenario.step_ms),
                last_counted,
                manifest: copies.into_iter().map(entry).collect(),
                ..TickMessage::default()
            };
            agent.step(&message, &mut space);
            last_counted = Some(tick);
            let active = space.report.active;
            assert!(
                active.is_none_or(|it| behaviors.contains(&it)),
                "{active:?}"
            );
            for said in &space.broadcasts {
                assert!(encoded_len(said).is_ok_and(|bytes| bytes <= LIMIT_BYTES));
            }
        }
    }
    true
}

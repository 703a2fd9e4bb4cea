//! Properties of a robot that receives any sealed broadcast, for each allocator. The fuzz target and the test over
//! its corpus use them.

use std::sync::{Arc, LazyLock};

use missions::Registry;
use missions::waste::data::{WASTE, default_scenario};
use proto::codec::{LIMIT_BYTES, decode, encoded_len};
use proto::team::Broadcast;
use proto::tick::{ManifestEntry, TickMessage};
use robot_agent::agent::{Agent, TeamConfig, Workspace};
use scenario::ids::RobotId;
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

/// The default mission with each allocator, and each other mission in a small size.
static TEAMS: LazyLock<Vec<(Setup, TeamConfig)>> = LazyLock::new(|| {
    let registry = Registry::built_in();
    let vocabulary = registry.vocabulary();
    let with = |name: &str| {
        let mut scenario = default_scenario();
        scenario.allocator = Some(name.to_owned());
        scenario
    };
    let others = vocabulary
        .missions
        .iter()
        .filter(|mission| **mission != WASTE);
    let others = others.filter_map(|mission| mission.family(3, 2));
    let allocators = vocabulary
        .allocators
        .iter()
        .map(|allocator| with(allocator.name));
    let team = |scenario: Scenario| {
        let setup = Setup::resolve(scenario, 1, None)
            .expect("the scenario is valid")
            .setup;
        let team = TeamConfig::new(&setup, registry.agents())
            .expect("all allocators and missions are registered");
        (setup, team)
    };
    allocators.chain(others).map(team).collect()
});

const ME: RobotId = RobotId(1);

/// The numbers of ticks between deliveries: at once, twice in one tick, again, and late.
const TICKS: [u64; 5] = [1, 2, 2, 40, 400];

/// Returns whether `bytes` are a broadcast. If so, delivers it to a robot from each teammate, once, twice, early and
/// late.
///
/// # Panics
/// Panics if the robot activates a behavior that it does not have, or sends a broadcast that is too long for the bus.
#[must_use]
pub fn accepts(bytes: &[u8]) -> bool {
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
            // The world lists only the ids of members as senders.
            let senders = [RobotId(0), RobotId(2)];
            let copies = senders.repeat(if step == 1 { 2 } else { 1 });
            let received = |sender| {
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
            space.arrived = copies.iter().copied().map(received).collect();
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
                active.is_none_or(|active| behaviors.contains(&active)),
                "{active:?}"
            );
            for broadcast in &space.broadcasts {
                assert!(encoded_len(broadcast).is_ok_and(|bytes| bytes <= LIMIT_BYTES));
            }
        }
    }
    true
}

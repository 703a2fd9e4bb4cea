//! Rollback tests: a step that does not count leaves no trace in the agent.

use std::sync::Arc;

use glam::Vec2;
use proptest::prelude::*;
use proto::codec::encode;
use proto::link::{LinkState, Probability};
use proto::mission::SensorReading;
use proto::mission::items::{ItemsReading, Zone};
use proto::readings::{Pose, Proximity, Readings};
use proto::secret::Secret;
use proto::tick::{ManifestEntry, TickMessage};
use robot_agent::agent::{Agent, TeamConfig, TentativeAgent, Workspace};
use scenario::ids::{RobotId, Tick};
use scenario::time::SimTime;
use scenario::{Scenario, Setup};

use super::data::default_scenario;
use crate::Registry;
use crate::fixtures::resolve;

const BLUE: RobotId = RobotId(0);
const GOLD: RobotId = RobotId(1);

/// A long step, so that motivations reach the threshold within a few steps.
const STEP_MS: u64 = 500;

fn agent(robot: RobotId, setup: &Setup) -> Agent {
    let team = TeamConfig::new(setup, Registry::built_in().agents()).unwrap();
    Agent::new(robot, 1, setup, &team)
}

fn setup() -> Setup {
    resolve(Scenario {
        step_ms: STEP_MS,
        ..default_scenario()
    })
}

fn message(tick: Tick, last_counted: Option<Tick>, readings: &Readings) -> TickMessage {
    TickMessage {
        incarnation: 1,
        tick,
        now: SimTime(tick * STEP_MS),
        last_counted,
        readings: readings.clone(),
        ..TickMessage::default()
    }
}

fn readings() -> impl Strategy<Value = Readings> {
    let border = || prop::option::of(0.0..0.5_f32);
    let place = (0.2..11.8_f32, 0.2..8.8_f32, -3.0..3.0_f32);
    let waste = prop::collection::vec((0.0..1.0_f32, -1.0..1.0_f32), 0..3);
    let floor = (0..3_u8, any::<bool>(), any::<bool>());
    (place, border(), border(), waste, floor).prop_map(
        |((x, y, heading_rad), front, side, waste, (zone, report_site, holding))| Readings {
            pose: Some(Pose {
                position: Vec2::new(x, y),
                heading_rad,
            }),
            front_border: Some(front),
            side_border: Some(side),
            proximity: Some(Proximity::default()),
            mission: SensorReading::Items(ItemsReading {
                items: Some(waste.into_iter().map(Vec2::from).collect()),
                zone: Some([Zone::None, Zone::Source, Zone::Target][usize::from(zone)]),
                at_site: Some(report_site),
                holding: Some(holding),
            }),
            ..Readings::default()
        },
    )
}

fn link() -> impl Strategy<Value = LinkState> {
    let chance = || prop_oneof![Just(0.0), 0.0..1.0].prop_map(Probability::from_share);
    let late = prop_oneof![Just(0), 0..4 * STEP_MS].prop_map(SimTime);
    (
        chance(),
        chance(),
        chance(),
        late,
        prop::bool::weighted(0.1),
    )
        .prop_map(|(drop, duplicate, reorder, jitter, hold)| LinkState {
            drop,
            duplicate,
            reorder,
            jitter,
            hold,
            ..LinkState::default()
        })
}

/// Draws the input of a tick: the readings of the robot and of its teammate, the link between them, and whether the
/// step counts.
fn input() -> impl Strategy<Value = (Readings, Readings, LinkState, bool)> {
    (readings(), readings(), link(), prop::bool::weighted(0.7))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn a_step_that_did_not_count_leaves_no_trace(inputs in prop::collection::vec(input(), 1..120)) {
        let setup = setup();
        let mut tentative = TentativeAgent::new(agent(BLUE, &setup));
        // This agent takes only the steps that count.
        let mut undisturbed = agent(BLUE, &setup);
        let mut gold = agent(GOLD, &setup);
        let mut last_counted = None;
        let mut step = Workspace::default();
        for (tick, (readings, teammate, link, is_counted)) in (0..).zip(&inputs) {
            let mut sent = Workspace::default();
            gold.step(&message(tick, None, teammate), &mut sent);
            let mut message = message(tick, last_counted, readings);
            message.manifest.push(ManifestEntry {
                sender: GOLD,
                tick,
                incarnation: 1,
                count: sent.report.broadcasts,
                link: Some(Box::new(*link)),
            });
            message.held.extend(link.hold.then_some(GOLD));
            let arrived: Vec<_> = sent.broadcasts.into_iter().map(Arc::new).map(Some).collect();
            step.arrived.clone_from(&arrived);
            tentative.step(Box::new(message.clone()), &mut step);
            if *is_counted {
                // The second workspace is new: earlier use of a workspace must not change the result.
                let mut expected = Workspace::default();
                expected.arrived = arrived;
                undisturbed.step(&message, &mut expected);
                prop_assert_eq!(&step.broadcasts, &expected.broadcasts, "in tick {}", tick);
                prop_assert_eq!(&step.report, &expected.report, "in tick {}", tick);
                prop_assert_eq!(encode(&step.report).unwrap(), encode(&expected.report).unwrap());
                last_counted = Some(tick);
            }
        }
    }
}

#[test]
fn a_step_that_did_not_count_returns_its_sequence_numbers() {
    let mut agent = TentativeAgent::new(agent(BLUE, &setup()));
    let readings = Readings::default();
    let mut space = Workspace::default();
    agent.step(Box::new(message(0, None, &readings)), &mut space);
    assert!(!space.broadcasts.is_empty(), "an idle heartbeat");
    agent.step(Box::new(message(1, None, &readings)), &mut space);
    assert_eq!(space.broadcasts[0].seq, 0);
    let next = space.broadcasts.len() as u64;
    agent.step(Box::new(message(6, Some(1), &readings)), &mut space);
    assert_eq!(space.broadcasts[0].seq, next);
}

#[test]
fn a_report_contains_the_size_of_its_broadcasts_on_the_bus() {
    let mut agent = agent(BLUE, &setup());
    let secret = Secret::from_token("token");
    let mut broadcasts = 0;
    // Blue's motivation to find the locations reaches the threshold after 5 s.
    for tick in 0..20 {
        let mut step = Workspace::default();
        agent.step(&message(tick, None, &Readings::default()), &mut step);
        let sealed = step.broadcasts.iter().map(|broadcast| {
            let sealed = secret.seal("alliance/run/team/blue/heartbeat", broadcast);
            sealed.unwrap().len()
        });
        assert_eq!(step.report.broadcast_bytes as usize, sealed.sum::<usize>());
        broadcasts += step.broadcasts.len();
    }
    assert!(broadcasts > 5, "{broadcasts}");
}

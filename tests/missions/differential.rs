//! The robots' motivations against the independent calculation of `alliance_tests::recompute`.
//!
//! The random messages are out of order, repeated or from old incarnations, with all combinations of switches.

use missions::waste::data::default_scenario;
use std::sync::Arc;

use alliance_tests::recompute::compare;
use missions::waste::data::WASTE;
use proto::mission::SharedKnowledge;
use proto::mission::items::{Fact, ItemsBulletin, Locations};
use proto::team::{Broadcast, BroadcastContent, BulletinSubject, Heartbeat, TaskState};
use proto::telemetry::Motivation;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use robot_agent::allocator::StepOutcome;
use robot_agent::allocators::alliance::{Engine, StepInput};
use run_log::{EventRow, MessageRow, MotivationRow};
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;
use scenario::{Catalog, HistoryOrigin, Scenario, Setup, Switches};

const STEP_MS: u64 = 200;
const GOLD: RobotId = RobotId(1);
const TEAMMATES: [RobotId; 2] = [RobotId(0), RobotId(2)];
const STATES: [TaskState; 4] = [
    TaskState::Executing,
    TaskState::Waiting,
    TaskState::Released,
    TaskState::Idle,
];

/// Returns a setup with random switches and values that cause many changes within a few hundred steps.
fn random_setup(rng: &mut ChaCha8Rng) -> Setup {
    let mut setup = Setup::resolve(
        Scenario {
            step_ms: STEP_MS,
            ..default_scenario()
        },
        1,
        None,
    )
    .unwrap()
    .setup;
    setup.alliance.threshold = 10.0;
    let robots = setup.alliance.robots.values_mut();
    for set in robots.flat_map(|robot| robot.sets.values_mut()) {
        set.ceased_after_s = rng.random_range(0.3..3.0);
        set.fast_impatience = rng.random_range(2.0..9.0);
        let slow = set.slow_impatience.values_mut();
        slow.for_each(|rate| *rate = rng.random_range(0.1..2.0));
        let phi = set.willing_to_affect_s.values_mut();
        phi.for_each(|patience_s| *patience_s = rng.random_range(0.3..6.0));
        set.before_yielding_s = rng.random_range(0.3..5.0);
        set.before_giving_up_s = rng.random_range(0.3..9.0);
    }
    let mut flag = || rng.random_bool(0.5);
    setup.alliance.switches = Switches {
        waiting: flag(),
        waiting_counts: flag(),
        wish_when_suppressed: flag(),
        reset_stops_active: flag(),
        history_origin: if flag() {
            HistoryOrigin::Progress
        } else {
            HistoryOrigin::MissionStart
        },
        arbitration: flag(),
        release_message: flag(),
        idle_heartbeat: flag(),
    };
    setup
}

/// Returns a random message of a teammate: any task, any incarnation, sometimes a sequence number ahead of later
/// messages.
fn random_message(rng: &mut ChaCha8Rng, now: SimTime) -> Broadcast {
    let task = TaskId(rng.random_range(0..4));
    let progress = rng.random_range(0..4);
    let tick = now.0 / STEP_MS;
    let body = if rng.random_bool(0.05) {
        let corner = Default::default();
        let about = BulletinSubject {
            task,
            set: scenario::ids::BehaviorId(task.0 + 1),
            progress,
        };
        let update = ItemsBulletin::PositionUpdate(Fact {
            value: Locations {
                min: corner,
                max: corner,
            },
            seen_by: TEAMMATES[0],
            seen: now,
        });
        BroadcastContent::Bulletin(update.into_bulletin(Some(about)))
    } else {
        let state = STATES[rng.random_range(0..4)];
        let named = state != TaskState::Idle;
        BroadcastContent::Heartbeat(Heartbeat {
            state,
            since: SimTime(rng.random_range(0..=now.0)),
            set: named.then_some(scenario::ids::BehaviorId(task.0 + 1)),
            task: named.then_some(task),
            progress: if named { progress } else { 0 },
            position: None,
            carrying: false,
            shared_knowledge: SharedKnowledge::default(),
        })
    };
    Broadcast {
        sender: TEAMMATES[rng.random_range(0..2)],
        incarnation: 1 + (tick / 100) as u32 + u32::from(rng.random_bool(0.02)),
        tick,
        index: 0,
        seq: tick + rng.random_range(0..8),
        sent: now,
        body,
    }
}

struct Rows<'s> {
    setup: &'s Setup,
    catalog: Arc<Catalog>,
}

impl Rows<'_> {
    fn robot(&self, robot: RobotId) -> String {
        self.setup.scenario.robots[robot.index()].name.clone()
    }

    fn motivation(&self, now: SimTime, row: &Motivation) -> MotivationRow {
        let task = self.catalog.sets[row.set.index()].task;
        MotivationRow {
            t_ms: now,
            robot: self.robot(GOLD),
            behavior_set: self.catalog.behavior_name(row.set).to_owned(),
            task: self.catalog.task_name(task).to_owned(),
            motivation: row.motivation,
            impatience: row.impatience,
            sensory_feedback: row.sensory_feedback,
            activity_suppression: row.activity_suppression,
            impatience_reset: row.impatience_reset,
            acquiescence: row.acquiescence,
            state: row.state.as_str().to_owned(),
        }
    }

    fn message(&self, now: SimTime, broadcast: &Broadcast, delivery: &str) -> MessageRow {
        let (state, task, progress) = match &broadcast.body {
            BroadcastContent::Heartbeat(heartbeat) => {
                (heartbeat.state.as_str(), heartbeat.task, heartbeat.progress)
            }
            BroadcastContent::Bulletin(bulletin) => (
                "",
                bulletin.about.map(|about| about.task),
                bulletin.about.map_or(0, |about| about.progress),
            ),
            BroadcastContent::Allocation(_) => ("", None, 0),
        };
        MessageRow {
            t_ms: now,
            receiver: self.robot(GOLD),
            sender: self.robot(broadcast.sender),
            incarnation: broadcast.incarnation,
            seq: Some(broadcast.seq),
            kind: broadcast
                .body
                .kind()
                .name(WASTE.vocabulary().bulletins)
                .to_owned(),
            state: state.to_owned(),
            since_ms: None,
            behavior_set: String::new(),
            task: task.map_or_else(String::new, |task| self.catalog.task_name(task).to_owned()),
            progress: Some(progress),
            sent_ms: broadcast.sent,
            delivery: delivery.to_owned(),
        }
    }
}

fn joined(robot: String, now: SimTime) -> EventRow {
    EventRow {
        t_ms: now,
        kind: "joined".to_owned(),
        robot,
        subject: String::new(),
        reason: String::new(),
        detail: String::new(),
    }
}

#[test]
fn both_calculations_agree_on_any_messages() {
    let mut resets = 0;
    for seed in 0..400 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let setup = random_setup(&mut rng);
        let rows = Rows {
            setup: &setup,
            catalog: Arc::clone(&setup.catalog),
        };
        let mut engine = Engine::new(GOLD, &setup);
        let mut events = vec![joined(rows.robot(GOLD), SimTime::ZERO)];
        let (mut motivations, mut messages) = (Vec::new(), Vec::new());
        let message_rate = rng.random_range(0.05..0.9);
        for step in 0..300 {
            let now = SimTime(STEP_MS * step);
            if rng.random_bool(0.005) {
                engine = Engine::new(GOLD, &setup);
                events.push(joined(rows.robot(GOLD), now));
            }
            let mut received = Vec::new();
            while rng.random_bool(message_rate) {
                received.push(Arc::new(random_message(&mut rng, now)));
            }
            received
                .sort_by_key(|broadcast| (broadcast.sender, broadcast.incarnation, broadcast.seq));
            for broadcast in &received {
                let delivery = ["received", "delayed"][rng.random_range(0..2)];
                messages.push(rows.message(now, broadcast, delivery));
                // Messages without delivery must change nothing.
                let delivery = ["dropped", "cut", "lost", "pending", "duplicate"];
                let undelivered = random_message(&mut rng, now);
                messages.push(rows.message(now, &undelivered, delivery[rng.random_range(0..5)]));
            }
            let mut output = StepOutcome::default();
            let applicable: Vec<bool> = (0..4).map(|_| rng.random_bool(0.99)).collect();
            let input = StepInput {
                now,
                received: &received,
                applicable: &applicable,
                progressed: &[],
            };
            engine.step(&input, &mut output);
            resets += output
                .motivations
                .iter()
                .filter(|row| !row.impatience_reset)
                .count();
            motivations.extend(
                output
                    .motivations
                    .iter()
                    .map(|row| rows.motivation(now, row)),
            );
        }
        let comparison = compare(&setup.alliance, &motivations, &messages, &events);
        assert_eq!(comparison.rows, 300 * 4);
        assert_eq!(
            comparison.mismatches,
            [],
            "seed {seed}, {:#?}",
            setup.alliance.switches
        );
    }
    assert!(resets > 1000, "{resets}");
}

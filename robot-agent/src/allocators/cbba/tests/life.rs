//! Crashes, restarts, forged messages, new rounds, and units under way.

use std::sync::Arc;

use proto::allocation::AllocationMessage;
use proto::allocation::consensus::{
    BidChange, BidTable, Deltas, TableEntry, TimeStamp, WinningBid,
};
use proto::codec::encoded_len;
use proto::team::{Broadcast, BroadcastContent};
use proto::telemetry::Reason;
use scenario::ids::{RobotId, TaskId};
use scenario::time::SimTime;

use crate::allocators::cbba::{Acbba, AcbbaConfig, Cbba, CbbaConfig};
use crate::allocators::consensus::team::{Team, Work};

const TAU: SimTime = SimTime(5000);

/// Returns work in which each robot is nearest to the task of its own rank, and second nearest to the next one.
fn spread(robots: usize, tasks: usize) -> Work {
    let away =
        |robot: usize, task: usize| 10.0 + 5.0 * ((tasks * robots + task - robot) % tasks) as f64;
    Work {
        first_s: (0..robots)
            .map(|robot| (0..tasks).map(|task| away(robot, task)).collect())
            .collect(),
        after_s: vec![vec![10.0; tasks]; tasks],
        reward: vec![1.0; tasks],
        priority: vec![0; tasks],
        max_robots: vec![1; tasks],
    }
}

fn single() -> CbbaConfig {
    CbbaConfig {
        bundle: 1,
        ..CbbaConfig::default()
    }
}

fn sent_by(sender: u16, seq: u64, sent: SimTime, table: BidTable) -> Arc<Broadcast> {
    Arc::new(Broadcast {
        sender: RobotId(sender),
        incarnation: 1,
        tick: 0,
        index: 0,
        seq,
        sent,
        body: BroadcastContent::Allocation(AllocationMessage::Table(table)),
    })
}

fn claims(task: u16, round: SimTime, claim: Option<(u16, f32)>) -> BidTable {
    BidTable {
        block: 0,
        slot: 0,
        beliefs: vec![TableEntry {
            task: TaskId(task),
            round,
            claim: claim.map(|(robot, value)| WinningBid {
                robot: RobotId(robot),
                value,
            }),
        }],
        news: Vec::new(),
    }
}

/// A free robot takes the task of a crashed robot τ after its last message, to the step.
#[test]
fn the_task_of_a_crashed_robot_is_free_after_tau() {
    let mut team = Team::<Cbba>::new(1, spread(3, 2), &single(), TAU);
    while team.tick < 30 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), Some(1), None]);
    team.crashed[1] = true;
    // The robot sent at 0 s, at 1 s and during the first consensus.
    let last_message = SimTime(1000 * (team.now().0 / 1000));
    while team.active()[2].is_none() {
        team.step();
        assert!(team.tick < 1000);
    }
    let taken = SimTime(team.now().0 - 50);
    assert!(taken.since(last_message) <= TAU + SimTime(50), "{taken:?}");
    assert!(taken.since(last_message) >= TAU, "{taken:?}");
    assert_eq!(team.members[2].decision.reason, Some(Reason::Claimed));
    assert_eq!(team.active()[0], Some(0));
}

/// The tasks of the previous incarnation are free at the first message of the new one.
#[test]
fn a_new_incarnation_holds_no_task() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    while team.tick < 10 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), None]);
    team.members[0] = team.fresh_member(0, 2, &single(), TAU);
    // The robot cannot do the task any more and reports that. Otherwise the task would stay reserved for τ.
    team.applicable[0][0] = false;
    team.step();
    team.step();
    assert_eq!(team.active(), [None, Some(0)]);
}

/// C6: empty and invalid messages take no task from its holder.
#[test]
fn empty_and_forged_messages_take_no_task() {
    let invalid = [
        claims(0, SimTime::ZERO, None),
        claims(0, SimTime::ZERO, Some((1, f32::NAN))),
        claims(0, SimTime::ZERO, Some((1, f32::INFINITY))),
        claims(0, SimTime::ZERO, Some((1, -1.0))),
        claims(0, SimTime::ZERO, Some((9, 1e9))),
        claims(0, SimTime(u64::MAX), Some((1, 1e9))),
        claims(7, SimTime::ZERO, Some((1, 1e9))),
        BidTable {
            slot: 3,
            ..claims(0, SimTime::ZERO, Some((1, 1e9)))
        },
        BidTable {
            news: vec![TimeStamp {
                robot: RobotId(2),
                age_ms: u32::MAX,
            }],
            ..claims(0, SimTime::ZERO, Some((2, 1e9)))
        },
    ];
    for table in invalid {
        let mut team = Team::<Cbba>::new(1, spread(3, 1), &single(), TAU);
        for _ in 0..4 {
            team.step();
        }
        assert_eq!(team.active(), [Some(0), None, None]);
        let now = team.now();
        team.deliver_to(0, sent_by(1, 1000, now.since(SimTime(50)), table.clone()));
        team.step();
        assert_eq!(team.active()[0], Some(0), "{table:?}");
        // The robot does not claim the task again either, because it would broadcast that.
        assert_eq!(team.members[0].decision.say, [], "{table:?}");
    }
    // A better bid takes the task.
    let mut team = Team::<Cbba>::new(1, spread(3, 1), &single(), TAU);
    for _ in 0..4 {
        team.step();
    }
    let sent = team.now().since(SimTime(50));
    let better = claims(0, SimTime::ZERO, Some((1, 1e9)));
    team.deliver_to(0, sent_by(1, 1000, sent, better.clone()));
    team.step();
    assert_eq!(team.active()[0], None);
    assert_eq!(team.members[0].decision.reason, Some(Reason::Outbid));
    // A message from the future or an overtaken one does not count.
    for (seq, sent) in [(1001, SimTime(1 << 40)), (999, sent), (1000, sent)] {
        let mut team = Team::<Cbba>::new(1, spread(3, 1), &single(), TAU);
        for _ in 0..4 {
            team.step();
        }
        let idle = claims(0, SimTime::ZERO, None);
        team.deliver_to(0, sent_by(1, 1000, team.now().since(SimTime(50)), idle));
        team.step();
        team.deliver_to(0, sent_by(1, seq, sent, better.clone()));
        team.step();
        assert_eq!(team.active()[0], Some(0), "{seq} {sent:?}");
    }
}

/// A newer round voids the claims of the older one, independent of the robot that learns of it first.
#[test]
fn a_new_round_is_negotiated_anew() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    for _ in 0..10 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), None]);
    team.work.first_s = vec![vec![50.0], vec![5.0]];
    team.round[0] = SimTime(400);
    for _ in 0..3 {
        team.step();
    }
    assert_eq!(team.active(), [None, Some(0)]);
}

/// A message about an older round takes no task. It also reserves nothing for a restarted robot that has not received
/// the newer round.
#[test]
fn older_rounds_are_void() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    team.round[0] = SimTime(100);
    for _ in 0..10 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0), None]);
    let sent = team.now().since(SimTime(50));
    let better = claims(0, SimTime(50), Some((1, 1e9)));
    team.deliver_to(0, sent_by(1, 1000, sent, better));
    team.step();
    assert_eq!(team.active(), [Some(0), None]);

    team.crashed[0] = true;
    let mut restarted = sent_by(0, 0, sent, claims(0, SimTime::ZERO, None));
    Arc::make_mut(&mut restarted).incarnation = 2;
    team.deliver_to(1, restarted);
    team.step();
    assert_eq!(team.active()[1], Some(0));
}

/// A claim keeps its initial utility for τ. Then a unit under way gets its bonus, and a nearer newcomer does not take
/// it.
#[test]
fn a_unit_that_has_really_started_is_kept() {
    for (steps, keeps) in [(40, false), (110, true)] {
        let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
        team.applicable[1][0] = false;
        for _ in 0..steps {
            team.step();
        }
        team.applicable[1][0] = true;
        team.work.first_s[1][0] = 1.0;
        for _ in 0..3 {
            team.step();
        }
        let expected = if keeps {
            [Some(0), None]
        } else {
            [None, Some(0)]
        };
        assert_eq!(team.active(), expected, "after {steps} steps");
    }
}

/// A task of higher priority interrupts a robot's current task at any stage.
#[test]
fn higher_priority_goes_first() {
    let mut work = spread(1, 2);
    work.priority[1] = 1;
    let mut team = Team::<Cbba>::new(1, work, &single(), TAU);
    team.applicable[0][1] = false;
    for _ in 0..110 {
        team.step();
    }
    assert_eq!(team.active(), [Some(0)]);
    team.applicable[0][1] = true;
    team.step();
    assert_eq!(team.active(), [Some(1)]);
}

/// After a minute without progress the bonus is lost, and a nearer robot gets the task.
#[test]
fn a_claim_without_progress_loses_its_bonus() {
    let mut team = Team::<Cbba>::new(1, spread(2, 1), &single(), TAU);
    team.applicable[1][0] = false;
    for _ in 0..110 {
        team.step();
    }
    team.applicable[1][0] = true;
    team.work.first_s[1][0] = 1.0;
    let mut progressed = false;
    while team.active()[1].is_none() {
        if team.tick == 600 {
            team.progressed[0].push(TaskId(0));
            progressed = true;
        }
        team.step();
        assert!(team.tick < 2000);
    }
    assert!(progressed);
    // A minute after the progress at 30 s, plus one step for the message.
    assert_eq!(team.tick, 600 + 1200 + 2);
}

/// The bound also holds with the largest numbers in all fields.
#[test]
fn the_largest_table_fits_a_message() {
    let belief = |task| TableEntry {
        task: TaskId(u16::MAX - task),
        round: SimTime(u64::from(u32::MAX) + 1),
        claim: Some(WinningBid {
            robot: RobotId(u16::MAX),
            value: 1.0,
        }),
    };
    let news = TimeStamp {
        robot: RobotId(u16::MAX),
        age_ms: 60_000,
    };
    let table = AllocationMessage::Table(BidTable {
        block: u16::MAX,
        slot: u16::MAX,
        beliefs: (0..32).map(belief).collect(),
        news: vec![news; 64],
    });
    assert!(encoded_len(&table).unwrap() <= 1200);
}

/// ACBBA: a robot that releases a task adopts the best known bid of the others, which may be smaller than its own was.
#[test]
fn a_released_task_goes_to_the_next_bidder() {
    let mut team = Team::<Acbba>::new(1, spread(2, 1), &AcbbaConfig::default(), TAU);
    team.crashed[1] = true;
    for _ in 0..4 {
        team.step();
    }
    let made = team.now().since(SimTime(50));
    let delta = BidChange {
        belief: claims(0, SimTime::ZERO, Some((1, 0.1))).beliefs[0],
        slot: 0,
        made,
    };
    let mut message = sent_by(1, 1000, made, BidTable::default());
    let entries = vec![delta];
    Arc::make_mut(&mut message).body =
        BroadcastContent::Allocation(AllocationMessage::Deltas(Deltas { entries }));
    team.deliver_to(0, message);
    let holder = |team: &Team<Acbba>| team.members[0].allocator.0.beliefs.holder(TaskId(0));
    team.step();
    assert_eq!(holder(&team), Some(RobotId(0)));
    team.applicable[0][0] = false;
    team.step();
    assert_eq!(holder(&team), Some(RobotId(1)));
}

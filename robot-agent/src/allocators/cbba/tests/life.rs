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
use crate::allocators::team::{STEP, Situation, TAU, Team, allocator_messages};
use crate::fixtures;

fn single() -> CbbaConfig {
    CbbaConfig {
        bundle: 1,
        ..CbbaConfig::default()
    }
}

/// Returns a team after some steps in which each robot bids for one task.
fn team_after(robots: usize, tasks: usize, steps: u64) -> Team<Cbba> {
    let mut team = Team::still(1, TAU, Situation::spread(robots, tasks), single());
    team.run(steps);
    team
}

fn sent_by(sender: u16, seq: u64, sent: SimTime, message: AllocationMessage) -> Arc<Broadcast> {
    let body = BroadcastContent::Allocation(message);
    Arc::new(fixtures::broadcast(RobotId(sender), (1, seq), sent, body))
}

fn table_by(sender: u16, seq: u64, sent: SimTime, table: BidTable) -> Arc<Broadcast> {
    sent_by(sender, seq, sent, AllocationMessage::Table(table))
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
    let mut team = team_after(3, 2, 30);
    assert_eq!(team.active(), [Some(0), Some(1), None]);
    team.kill(1);
    // The robot sent at 0 s, at 1 s and during the first consensus.
    let last_message = SimTime(1000 * (team.now().0 / 1000));
    while team.active()[2].is_none() {
        team.step();
        assert!(team.now() < SimTime(50_000));
    }
    let taken = team.now() - STEP;
    assert!(taken.since(last_message) <= TAU + STEP, "{taken:?}");
    assert!(taken.since(last_message) >= TAU, "{taken:?}");
    assert_eq!(team.robots[2].outcome.changes[0].reason, Reason::Claimed);
    assert_eq!(team.active()[0], Some(0));
}

/// The tasks of the previous incarnation are free at the first message of the new one.
#[test]
fn a_new_incarnation_holds_no_task() {
    let mut team = team_after(2, 1, 10);
    assert_eq!(team.active(), [Some(0), None]);
    team.restart(0);
    // The robot cannot do the task any more and reports that. Otherwise the task would stay reserved for τ.
    team.applicable[0][0] = false;
    team.run(2);
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
        let mut team = team_after(3, 1, 4);
        assert_eq!(team.active(), [Some(0), None, None]);
        let sent = team.now() - STEP;
        team.in_flight.push(table_by(1, 1000, sent, table.clone()));
        team.step();
        assert_eq!(team.active()[0], Some(0), "{table:?}");
        // The robot does not claim the task again either, because it would broadcast that.
        let mut senders = allocator_messages(&team.in_flight).map(|(sender, _)| sender);
        assert!(!senders.any(|sender| sender == RobotId(0)), "{table:?}");
    }
    // A better bid takes the task.
    let mut team = team_after(3, 1, 4);
    let sent = team.now() - STEP;
    let better = claims(0, SimTime::ZERO, Some((1, 1e9)));
    team.in_flight.push(table_by(1, 1000, sent, better.clone()));
    team.step();
    assert_eq!(team.active()[0], None);
    assert_eq!(team.robots[0].outcome.changes[0].reason, Reason::Outbid);
    // A message from the future or an overtaken one does not count.
    for (seq, sent) in [(1001, SimTime(1 << 40)), (999, sent), (1000, sent)] {
        let mut team = team_after(3, 1, 4);
        let idle = claims(0, SimTime::ZERO, None);
        let now = team.now();
        team.in_flight.push(table_by(1, 1000, now - STEP, idle));
        team.step();
        team.in_flight.push(table_by(1, seq, sent, better.clone()));
        team.step();
        assert_eq!(team.active()[0], Some(0), "{seq} {sent:?}");
    }
}

/// A newer round voids the claims of the older one, independent of the robot that learns of it first.
#[test]
fn a_new_round_is_negotiated_anew() {
    let mut team = team_after(2, 1, 10);
    assert_eq!(team.active(), [Some(0), None]);
    team.situation.cost_s = vec![vec![Some(50.0)], vec![Some(5.0)]];
    team.situation.tasks[0].round = SimTime(400);
    team.run(3);
    assert_eq!(team.active(), [None, Some(0)]);
}

/// A message about an older round takes no task. It also reserves nothing for a restarted robot that has not received
/// the newer round.
#[test]
fn older_rounds_are_void() {
    let mut team = team_after(2, 1, 0);
    team.situation.tasks[0].round = SimTime(100);
    team.run(10);
    assert_eq!(team.active(), [Some(0), None]);
    let sent = team.now() - STEP;
    let better = claims(0, SimTime(50), Some((1, 1e9)));
    team.in_flight.push(table_by(1, 1000, sent, better));
    team.step();
    assert_eq!(team.active(), [Some(0), None]);

    team.kill(0);
    let mut restarted = table_by(0, 0, sent, claims(0, SimTime::ZERO, None));
    Arc::make_mut(&mut restarted).incarnation = 2;
    team.in_flight.push(restarted);
    team.step();
    assert_eq!(team.active()[1], Some(0));
}

/// A claim keeps its initial utility for τ. Then a unit under way gets its bonus, and a nearer newcomer does not take
/// it.
#[test]
fn a_unit_that_has_really_started_is_kept() {
    for (steps, keeps) in [(40, false), (110, true)] {
        let mut team = team_after(2, 1, 0);
        team.applicable[1][0] = false;
        team.run(steps);
        team.applicable[1][0] = true;
        team.situation.cost_s[1][0] = Some(1.0);
        team.run(3);
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
    let mut situation = Situation::spread(1, 2);
    situation.tasks[1].priority = 1;
    let mut team = Team::<Cbba>::still(1, TAU, situation, single());
    team.applicable[0][1] = false;
    team.run(110);
    assert_eq!(team.active(), [Some(0)]);
    team.applicable[0][1] = true;
    team.step();
    assert_eq!(team.active(), [Some(1)]);
}

/// After a minute without progress the bonus is lost, and a nearer robot gets the task.
#[test]
fn a_claim_without_progress_loses_its_bonus() {
    let mut team = team_after(2, 1, 0);
    team.applicable[1][0] = false;
    team.run(110);
    team.applicable[1][0] = true;
    team.situation.cost_s[1][0] = Some(1.0);
    team.run(490);
    team.robots[0].progressed.push(TaskId(0));
    let progress = team.now();
    while team.active()[1].is_none() {
        team.step();
        assert!(team.now() < SimTime(100_000));
    }
    // A minute after the progress, plus one step for the message.
    assert_eq!(team.now(), progress + SimTime(60_000) + STEP + STEP);
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
    let situation = Situation::spread(2, 1);
    let mut team = Team::<Acbba>::still(1, TAU, situation, AcbbaConfig::default());
    team.kill(1);
    team.run(4);
    let made = team.now() - STEP;
    let delta = BidChange {
        belief: claims(0, SimTime::ZERO, Some((1, 0.1))).beliefs[0],
        slot: 0,
        made,
    };
    let entries = vec![delta];
    let message = AllocationMessage::Deltas(Deltas { entries });
    team.in_flight.push(sent_by(1, 1000, made, message));
    let holder = |team: &Team<Acbba>| team.allocator(0).0.beliefs.holder(TaskId(0));
    team.step();
    assert_eq!(holder(&team), Some(RobotId(0)));
    team.applicable[0][0] = false;
    team.step();
    assert_eq!(holder(&team), Some(RobotId(1)));
}

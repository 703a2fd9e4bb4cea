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

use crate::allocator::Allocator;
use crate::allocators::cbba::{Acbba, AcbbaConfig, Cbba, CbbaConfig};
use crate::allocators::team::{STEP, Situation, TAU, Task, Team, allocator_messages};
use crate::fixtures;

/// Returns work in which each robot is nearest to the task of its own rank, and second nearest to the next one.
fn spread(robots: usize, tasks: usize) -> Situation {
    let away =
        |robot: usize, task: usize| 10.0 + 5.0 * ((tasks * robots + task - robot) % tasks) as f64;
    Situation {
        tasks: vec![Task::default(); tasks],
        cost_s: (0..robots)
            .map(|robot| (0..tasks).map(|task| Some(away(robot, task))).collect())
            .collect(),
        after_s: Some(vec![vec![10.0; tasks]; tasks]),
    }
}

fn bidders(situation: Situation) -> Team<Cbba> {
    Team::still(1, TAU, situation, single())
}

/// Makes one step in which a robot receives a further broadcast, after all others.
fn step_with<A: Allocator>(broadcast: Arc<Broadcast>, receiver: u32, team: &mut Team<A>) {
    team.in_flight.push(Arc::clone(&broadcast));
    let is_further = |passing: &Broadcast| std::ptr::eq(passing, Arc::as_ptr(&broadcast));
    team.step_with(|passing, to| !is_further(passing) || to == RobotId(receiver));
}

/// Returns the number of steps so far.
fn steps<A: Allocator>(team: &Team<A>) -> u64 {
    team.now().0 / STEP.0
}

fn single() -> CbbaConfig {
    CbbaConfig {
        bundle: 1,
        ..CbbaConfig::default()
    }
}

fn sent_by(sender: u32, seq: u64, sent: SimTime, table: BidTable) -> Arc<Broadcast> {
    let body = BroadcastContent::Allocation(AllocationMessage::Table(table));
    Arc::new(fixtures::broadcast(RobotId(sender), (1, seq), sent, body))
}

fn claims(task: u32, round: SimTime, claim: Option<(u32, f32)>) -> BidTable {
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
    let mut team = bidders(spread(3, 2));
    team.run(30);
    assert_eq!(team.active(), [Some(0), Some(1), None]);
    team.kill(1);
    // The robot sent at 0 s, at 1 s and during the first consensus.
    let last_message = SimTime(1000 * (team.now().0 / 1000));
    while team.active()[2].is_none() {
        team.step();
        assert!(steps(&team) < 1000);
    }
    let taken = SimTime(team.now().0 - 50);
    assert!(taken.since(last_message) <= TAU + SimTime(50), "{taken:?}");
    assert!(taken.since(last_message) >= TAU, "{taken:?}");
    assert_eq!(team.robots[2].outcome.changes[0].reason, Reason::Claimed);
    assert_eq!(team.active()[0], Some(0));
}

/// The tasks of the previous incarnation are free at the first message of the new one.
#[test]
fn a_new_incarnation_holds_no_task() {
    let mut team = bidders(spread(2, 1));
    team.run(10);
    assert_eq!(team.active(), [Some(0), None]);
    team.restart(0);
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
        let mut team = bidders(spread(3, 1));
        team.run(4);
        assert_eq!(team.active(), [Some(0), None, None]);
        let now = team.now();
        step_with(
            sent_by(1, 1000, now.since(SimTime(50)), table.clone()),
            0,
            &mut team,
        );
        assert_eq!(team.active()[0], Some(0), "{table:?}");
        // The robot does not claim the task again either, because it would broadcast that.
        let mut messages = allocator_messages(&team.in_flight);
        assert!(
            messages.all(|(sender, _)| sender != RobotId(0)),
            "{table:?}"
        );
    }
    // A better bid takes the task.
    let mut team = bidders(spread(3, 1));
    team.run(4);
    let sent = team.now().since(SimTime(50));
    let better = claims(0, SimTime::ZERO, Some((1, 1e9)));
    step_with(sent_by(1, 1000, sent, better.clone()), 0, &mut team);
    assert_eq!(team.active()[0], None);
    assert_eq!(team.robots[0].outcome.changes[0].reason, Reason::Outbid);
    // A message from the future or an overtaken one does not count.
    for (seq, sent) in [(1001, SimTime(1 << 40)), (999, sent), (1000, sent)] {
        let mut team = bidders(spread(3, 1));
        team.run(4);
        let idle = claims(0, SimTime::ZERO, None);
        step_with(
            sent_by(1, 1000, team.now().since(SimTime(50)), idle),
            0,
            &mut team,
        );
        step_with(sent_by(1, seq, sent, better.clone()), 0, &mut team);
        assert_eq!(team.active()[0], Some(0), "{seq} {sent:?}");
    }
}

/// A newer round voids the claims of the older one, independent of the robot that learns of it first.
#[test]
fn a_new_round_is_negotiated_anew() {
    let mut team = bidders(spread(2, 1));
    team.run(10);
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
    let mut team = bidders(spread(2, 1));
    team.situation.tasks[0].round = SimTime(100);
    team.run(10);
    assert_eq!(team.active(), [Some(0), None]);
    let sent = team.now().since(SimTime(50));
    let better = claims(0, SimTime(50), Some((1, 1e9)));
    step_with(sent_by(1, 1000, sent, better), 0, &mut team);
    assert_eq!(team.active(), [Some(0), None]);

    team.kill(0);
    let mut restarted = sent_by(0, 0, sent, claims(0, SimTime::ZERO, None));
    Arc::make_mut(&mut restarted).incarnation = 2;
    step_with(restarted, 1, &mut team);
    assert_eq!(team.active()[1], Some(0));
}

/// A claim keeps its initial utility for τ. Then a unit under way gets its bonus, and a nearer newcomer does not take
/// it.
#[test]
fn a_unit_that_has_really_started_is_kept() {
    for (steps, keeps) in [(40, false), (110, true)] {
        let mut team = bidders(spread(2, 1));
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
    let mut situation = spread(1, 2);
    situation.tasks[1].priority = 1;
    let mut team = bidders(situation);
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
    let mut team = bidders(spread(2, 1));
    team.applicable[1][0] = false;
    team.run(110);
    team.applicable[1][0] = true;
    team.situation.cost_s[1][0] = Some(1.0);
    let mut progressed = false;
    while team.active()[1].is_none() {
        if steps(&team) == 600 {
            team.robots[0].progressed.push(TaskId(0));
            progressed = true;
        }
        team.step();
        assert!(steps(&team) < 2000);
    }
    assert!(progressed);
    // A minute after the progress at 30 s, plus one step for the message.
    assert_eq!(steps(&team), 600 + 1200 + 2);
}

/// The bound also holds with the largest numbers in all fields, for up to 65,536 robots and tasks.
#[test]
fn the_largest_table_fits_a_message() {
    const LAST: u32 = u16::MAX as u32;
    let belief = |task| TableEntry {
        task: TaskId(LAST - task),
        round: SimTime(u64::from(u32::MAX) + 1),
        claim: Some(WinningBid {
            robot: RobotId(LAST),
            value: 1.0,
        }),
    };
    let news = TimeStamp {
        robot: RobotId(LAST),
        age_ms: 60_000,
    };
    let table = AllocationMessage::Table(BidTable {
        block: LAST,
        slot: u16::MAX,
        beliefs: (0..32).map(belief).collect(),
        news: vec![news; 64],
    });
    assert!(encoded_len(&table).unwrap() <= 1200);
}

/// ACBBA: a robot that releases a task adopts the best known bid of the others, which may be smaller than its own was.
#[test]
fn a_released_task_goes_to_the_next_bidder() {
    let mut team = Team::<Acbba>::still(1, TAU, spread(2, 1), AcbbaConfig::default());
    team.kill(1);
    team.run(4);
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
    let holder = |team: &Team<Acbba>| team.allocator(0).0.beliefs.holder(TaskId(0));
    step_with(message, 0, &mut team);
    assert_eq!(holder(&team), Some(RobotId(0)));
    team.applicable[0][0] = false;
    team.step();
    assert_eq!(holder(&team), Some(RobotId(1)));
}

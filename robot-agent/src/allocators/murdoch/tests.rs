//! The properties of MURDOCH (docs/allocators/murdoch.md), and those of all allocators.

use std::collections::{BTreeMap, BTreeSet};

use proptest::prelude::*;
use proto::allocation::AllocationMessage;
use proto::allocation::murdoch::{ContractStatus, Negotiation, NegotiationKind};
use proto::team::{Broadcast, BroadcastContent};
use proto::telemetry::Reason;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{Incarnation, RobotId, TaskId};
use scenario::time::SimTime;

use super::{Config, Monitor, Murdoch};
use crate::allocators::team::{STEP, Situation, TAU, Task, Team, allocator_messages};
use crate::testkit;

use ContractStatus::{Abort, Done, Ongoing};

use NegotiationKind::{Ack, Announce, Bid, Renew};

const LEASE: SimTime = SimTime(6000);
const AUCTION: SimTime = SimTime(500);

fn team(cost_s: &[&[f64]]) -> Team<Murdoch> {
    Team::new(Situation::from_costs(cost_s), Config::default())
}

fn watchful() -> Config {
    Config {
        monitor: Monitor::Progress,
        ban_s: 20.0,
        ..Config::default()
    }
}

fn steps(count: u64) -> SimTime {
    SimTime(count * STEP.0)
}

fn negotiations(team: &Team<Murdoch>) -> Vec<(RobotId, Negotiation)> {
    allocator_messages(&team.in_flight)
        .filter_map(|(robot, message)| match message {
            AllocationMessage::Murdoch(negotiation) => Some((robot, *negotiation)),
            _ => None,
        })
        .collect()
}

/// The sortable id of an auction.
type AuctionKey = (RobotId, Incarnation, u32);

fn key_of(message: &Negotiation) -> AuctionKey {
    let auction = message.auction;
    (auction.auctioneer, auction.incarnation, auction.number)
}

/// Makes steps until a robot executes the task.
fn until_taken(team: &mut Team<Murdoch>, task: usize) {
    let limit = team.now() + SimTime(60_000);
    while team.executors(task).is_empty() {
        assert!(team.now() < limit, "no robot takes task {task}");
        team.step();
    }
}

#[test]
fn murdoch_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Murdoch>(&Config::default());
    let quick = Config {
        auction_s: 0.1,
        renew_hz: 5.0,
        lease_s: 0.5,
        parallel: 2,
        progress_units: 0.2,
        ban_s: 2.0,
        ..watchful()
    };
    testkit::check_allocator::<Murdoch>(&quick);
}

/// A complete auction: the auctioneer waits for a lease, takes bids and awards to the best. The winner starts one step
/// later.
#[test]
fn an_auction_from_announcement_to_work() {
    let mut team = team(&[&[30.0], &[20.0], &[40.0]]);
    until_taken(&mut team, 0);
    assert_eq!(team.executors(0), [1]);
    let change = &team.robots[1].outcome.changes[0];
    assert_eq!(change.reason, Reason::Awarded);
    assert_eq!(team.now() - STEP, LEASE + AUCTION + STEP);
    // A nearer robot does not get a task under contract.
    team.situation.cost_s[0][0] = Some(1.0);
    team.run(300);
    assert_eq!(team.executors(0), [1]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// M1: a task whose contract is no longer answered is announced a lease and a step after the receipt of the last
    /// answer. A free, able robot executes it an auction and a step later.
    #[test]
    fn m1_the_task_of_a_crashed_robot_is_auctioned_again(
        costs in prop::collection::vec(1..200_u32, 3..6),
        wait in 1..300_u64,
    ) {
        let costs: Vec<[f64; 1]> = costs.into_iter().map(|cost| [f64::from(cost)]).collect();
        let rows: Vec<&[f64]> = costs.iter().map(|row| &row[..]).collect();
        let mut team = Team::<Murdoch>::new(Situation::from_costs(&rows), Config::default());
        until_taken(&mut team, 0);
        let mut answered = team.now() - STEP;
        for _ in 0..wait {
            let now = team.now();
            team.step();
            if negotiations(&team).iter().any(|(_, message)| matches!(message.word, Ack { .. })) {
                answered = now;
            }
        }
        let winner = team.executors(0)[0];
        let (mut last_received, mut announced) = (SimTime::ZERO, None);
        for (robot, _) in team.in_flight.iter().map(|broadcast| (broadcast.sender, ())) {
            if robot.index() == winner {
                last_received = team.now();
            }
        }
        team.kill(winner);
        while team.executors(0).is_empty() {
            let now = team.now();
            prop_assert!(now < answered + SimTime(60_000));
            team.step();
            let mut sent = negotiations(&team).into_iter();
            if announced.is_none() && sent.any(|(_, message)| matches!(message.word, Announce { .. })) {
                announced = Some(now);
            }
        }
        let (announced, taken) = (announced.unwrap(), team.now() - STEP);
        prop_assert_eq!(taken, announced + AUCTION + STEP);
        if winner == 0 {
            // The auctioneer crashed with the winner. The next one takes over after τ and then waits for a lease.
            prop_assert!(announced <= last_received.max(answered) + TAU + SimTime(1000) + LEASE + steps(2));
            prop_assert!(taken <= answered + SimTime(1000) + TAU + LEASE + LEASE + AUCTION + steps(4));
        } else {
            prop_assert_eq!(announced, answered + STEP + LEASE + STEP);
            prop_assert!(taken <= answered + LEASE + AUCTION + steps(4));
        }
    }

    /// M2: the winner is the best received bid of a robot without a contract. M3: no robot has two contracts, and a
    /// robot with one does not bid. M4: without message loss and with one auctioneer, no task exceeds its limit.
    #[test]
    fn m2_m3_m4_in_lossless_teams(
        situation in Situation::arbitrary(5, 4),
        seed in any::<u64>(),
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut team = Team::<Murdoch>::new(situation, Config::default());
        // All robots can do all tasks, so that there is one auctioneer.
        for row in &mut team.situation.cost_s {
            for cost_s in row.iter_mut() {
                *cost_s = Some(chance.random_range(1.0..99.0));
            }
        }
        let mut team = Team::<Murdoch>::new(team.situation, Config::default());
        let mut bids: BTreeMap<AuctionKey, Vec<(f32, RobotId)>> = BTreeMap::new();
        let mut awarded: BTreeSet<AuctionKey> = BTreeSet::new();
        // The last time at which each robot had a contract.
        let mut busy = vec![SimTime::ZERO; team.robots.len()];
        let mut awards = 0;
        for _ in 0..1200 {
            if chance.random_bool(0.02) {
                team.situation.change(&mut chance, 100.0, 0.3);
            }
            if chance.random_bool(0.004) {
                let rank = chance.random_range(0..team.robots.len());
                if rank > 0 { team.restart(rank) }
            }
            team.step();
            let now = team.now();
            for (robot, busy) in team.robots.iter().zip(&mut busy) {
                if robot.active.is_some() {
                    *busy = now;
                }
            }
            let mut winners = BTreeSet::new();
            for (robot, message) in negotiations(&team) {
                match message.word {
                    Renew { winner } if awarded.insert(key_of(&message)) => {
                        awards += 1;
                        prop_assert!(winners.insert(winner), "M3: one award at a time");
                        let bids = bids.remove(&key_of(&message)).unwrap_or_default();
                        // The end of a contract is received one step later.
                        let is_free = |robot: &RobotId| now.since(busy[robot.index()]) > steps(2) && !winners.contains(robot);
                        let free = bids.iter().filter(|(_, bidder)| *bidder == winner || is_free(bidder));
                        let best = free.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
                        prop_assert_eq!(best.map(|bid| bid.1), Some(winner), "M2: {:?}", bids);
                        // The winner may return the award, which is received two steps later.
                        busy[winner.index()] = now;
                    }
                    Bid { utility } => {
                        let active = team.robots[robot.index()].active;
                        // The robot may win another auction in the step in which it bids.
                        let began = team.robots[robot.index()].outcome.changes.iter().any(|change| change.reason == Reason::Awarded);
                        prop_assert!(active.is_none() || began, "M3: a robot with a contract does not bid");
                        bids.entry(key_of(&message)).or_default().push((utility, robot));
                    }
                    _ => {}
                }
            }
            for (id, task) in team.situation.tasks.iter().enumerate() {
                prop_assert!(team.executors(id).len() <= task.max_robots, "M4");
            }
        }
        // A case in which no task was due for long enough tests nothing.
        prop_assume!(awards > 0);
        // A running contract costs one renewal and one answer per second, an unassigned task two announcements per
        // second.
        for task in &mut team.situation.tasks {
            task.units = None;
        }
        team.run(200);
        // Reports of progress are excluded from the count.
        let (mut count, mut reported) = (0, BTreeMap::new());
        for _ in 0..200 {
            team.step();
            for (robot, message) in negotiations(&team) {
                let is_news = match message.word {
                    Ack { progress, .. } => reported.insert((robot, message.task), progress) < Some(progress),
                    _ => false,
                };
                count += usize::from(!is_news);
            }
        }
        prop_assert!(count <= 10 * 3 * team.situation.tasks.len() * 2, "{count} in 10 s");
    }

    /// M3: no robot acknowledges two contracts at once, for any message loss.
    #[test]
    fn m3_no_robot_holds_two_contracts(
        situation in Situation::arbitrary(4, 4),
        seed in any::<u64>(),
        loss in 0.0..0.8_f64,
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut team = Team::<Murdoch>::new(situation, Config::default());
        let mut held: Vec<BTreeSet<AuctionKey>> = vec![BTreeSet::new(); team.robots.len()];
        for _ in 0..1200 {
            if chance.random_bool(0.01) {
                team.situation.change(&mut chance, 100.0, 0.3);
            }
            team.step_with(|_, _| !chance.random_bool(loss));
            for (robot, message) in negotiations(&team) {
                if let Ack { status, .. } = message.word {
                    let held = &mut held[robot.index()];
                    match status {
                        Ongoing => held.insert(key_of(&message)),
                        Done | Abort => held.remove(&key_of(&message)),
                    };
                }
            }
            prop_assert!(held.iter().all(|held| held.len() <= 1), "{held:?}");
        }
    }

    /// M5: no robot keeps a task without progress for longer than progress_s + lease_s, nor gets it again within ban_s.
    #[test]
    fn m5_a_robot_without_progress_loses_the_task(
        robots in 2..5_usize,
        costs in prop::collection::vec(1..60_u32, 1..4),
        useless in any::<prop::sample::Index>(),
    ) {
        let costs: Vec<f64> = costs.into_iter().map(|cost| f64::from(cost) / 10.0).collect();
        let config = watchful();
        let (progress_units, ban) = (config.progress_units, SimTime::from_secs_f64(config.ban_s));
        let useless = useless.index(robots);
        let mut situation = Situation::from_costs(&vec![&costs[..]; robots]);
        // The useless robot always has the best bid.
        situation.cost_s[useless] = costs.iter().map(|cost| Some(cost / 2.0)).collect();
        let mut team = Team::<Murdoch>::new(situation, config);
        team.robots[useless].makes_progress = false;
        let (mut since, mut left, mut stints) = (SimTime::ZERO, BTreeMap::new(), 0);
        let mut before: Option<TaskId> = None;
        while team.now() < SimTime(120_000) {
            let now = team.now();
            team.step();
            let active = team.robots[useless].active;
            if active != before {
                if let Some(task) = before {
                    left.insert(task, now);
                }
                if let Some(task) = active {
                    stints += 1;
                    if let Some(left) = left.get(&task) {
                        prop_assert!(now >= *left + ban - LEASE - steps(2), "the ban starts when the robot leaves, at the latest");
                    }
                }
                (since, before) = (now, active);
            }
            if let Some(task) = active {
                let patience = SimTime::from_secs_f64(progress_units * costs[task.index()]);
                // The time without progress counts from the award, which takes a step.
                prop_assert!(now.since(since) <= patience + LEASE + steps(3));
            }
        }
        prop_assert!(stints > 0);
    }

    /// G5: without any messages, a robot that can do all tasks completes them.
    #[test]
    fn g5_all_tasks_are_done_with_all_links_cut(
        robots in 1..4_usize,
        costs in prop::collection::vec(1..8_u32, 1..5),
    ) {
        let mut team = Team::<Murdoch>::with_work(robots, &costs, Config::default());
        // Each robot acts as auctioneer after a lease without messages, and an auction precedes each task.
        let work_s = f64::from(2 * costs.iter().sum::<u32>());
        let limit_s = 6.0 + work_s + 0.7 * costs.len() as f64 + 1.0;
        while team.now().as_secs_f64() < limit_s {
            team.step_with(|_, _| false);
        }
        prop_assert!(team.is_done());
    }

    /// All tasks that can be done are done, for any message loss.
    #[test]
    fn all_tasks_are_done_despite_message_loss(
        costs in prop::collection::vec(prop::collection::vec(1..8_u32, 3), 2..5),
        seed in any::<u64>(),
        loss in 0.0..0.6_f64,
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let costs: Vec<Vec<f64>> = costs.iter().map(|row| row.iter().map(|&cost| f64::from(cost)).collect()).collect();
        let rows: Vec<&[f64]> = costs.iter().map(|row| &row[..]).collect();
        let mut situation = Situation::from_costs(&rows);
        for task in &mut situation.tasks {
            task.units = Some(3);
        }
        let mut team = Team::<Murdoch>::new(situation, Config::default());
        while team.now() < SimTime(300_000) && !team.is_done() {
            team.step_with(|_, _| !chance.random_bool(loss));
        }
        prop_assert!(team.is_done());
    }
}

/// Both sides of a partition have an auctioneer. After the partition heals, the lower-ranked auctioneer's contract wins
/// within a renewal and two steps.
#[test]
fn a_partition_that_heals_leaves_the_contract_of_the_lower_rank() {
    let mut team = team(&[&[50.0], &[90.0], &[10.0]]);
    let cut =
        |broadcast: &Broadcast, receiver: RobotId| (broadcast.sender.0 < 2) == (receiver.0 < 2);
    for _ in 0..300 {
        team.step_with(cut);
    }
    assert_eq!(team.executors(0), [0, 2]);
    team.run(20 + 2);
    assert_eq!(team.executors(0), [0]);
}

/// The auctioneer crashes and the winner continues. The next auctioneer has the contract and renews it.
#[test]
fn a_new_auctioneer_adopts_running_contracts() {
    let mut team = team(&[&[70.0], &[60.0], &[50.0]]);
    until_taken(&mut team, 0);
    team.run(25);
    team.kill(0);
    for _ in 0..1000 {
        team.step();
        assert_eq!(team.executors(0), [2]);
    }
    // The old auctioneer restarts, waits, and takes the contract over in turn.
    team.restart(0);
    for _ in 0..1000 {
        team.step();
        assert_eq!(team.executors(0), [2]);
    }
}

/// Teammates receive the lowest rank's heartbeats, but not its announcements. The next robot becomes auctioneer after τ
/// and a lease, and waits for another lease.
#[test]
fn a_task_without_announcements_is_auctioned_by_the_next_robot() {
    let mut situation = Situation::from_costs(&[&[90.0, 90.0], &[50.0, 10.0]]);
    situation.tasks[0] = Task {
        max_robots: 2,
        ..Task::default()
    };
    let mut team = Team::<Murdoch>::new(situation, Config::default());
    let mute = |broadcast: &Broadcast, _: RobotId| {
        !(broadcast.sender == RobotId(0)
            && matches!(broadcast.body, BroadcastContent::Allocation(_)))
    };
    while team.executors(1) != [1] {
        assert!(team.now() < SimTime(20_000));
        team.step_with(mute);
    }
    assert_eq!(team.now() - STEP, TAU + LEASE + LEASE + AUCTION + STEP);
}

/// Invalid bids, awards and answers change nothing: invalid numbers, future times, unknown robots and unknown tasks.
#[test]
fn forged_messages_change_nothing() {
    let mut team = team(&[&[30.0], &[20.0], &[40.0]]);
    let mut open = None;
    while open.is_none() {
        team.step();
        open = negotiations(&team).pop();
    }
    let (_, announced) = open.unwrap();
    let forge =
        |team: &mut Team<Murdoch>, message| team.inject(2, AllocationMessage::Murdoch(message));
    for utility in [f32::NAN, f32::INFINITY] {
        forge(
            &mut team,
            Negotiation {
                word: Bid { utility },
                ..announced
            },
        );
    }
    for message in [
        Negotiation {
            task: TaskId(9),
            ..announced
        },
        Negotiation {
            round: SimTime(u64::MAX),
            word: Renew { winner: RobotId(2) },
            ..announced
        },
        Negotiation {
            word: Renew {
                winner: RobotId(999),
            },
            ..announced
        },
        Negotiation {
            word: Announce {
                closes: SimTime::ZERO,
            },
            ..announced
        },
    ] {
        forge(&mut team, message);
    }
    until_taken(&mut team, 0);
    assert_eq!(team.executors(0), [1]);
    assert_eq!(team.now() - STEP, LEASE + AUCTION + STEP);
}

/// A restarted robot has no contract and reports that, so that the task is auctioned at once.
#[test]
fn a_new_incarnation_returns_its_old_contract() {
    let mut team = team(&[&[90.0], &[10.0], &[50.0]]);
    until_taken(&mut team, 0);
    team.run(5);
    assert_eq!(team.executors(0), [1]);
    let mut renewed = None;
    while renewed.is_none() {
        team.step();
        let mut sent = negotiations(&team).into_iter();
        renewed = sent.find(|(_, message)| matches!(message.word, Renew { .. }));
    }
    team.restart(1);
    let back = team.now();
    // A renewal in flight names the old contract, and the robot returns it.
    let (_, renewed) = renewed.unwrap();
    team.step();
    assert!(team.executors(0).is_empty());
    assert!(negotiations(&team).iter().any(|(robot, message)| {
        let returns_contract = matches!(message.word, Ack { status: Abort, .. });
        *robot == RobotId(1) && returns_contract && message.auction == renewed.auction
    }));
    until_taken(&mut team, 0);
    assert_eq!(team.executors(0), [1]);
    assert_eq!(team.now() - STEP, back + STEP + AUCTION + STEP);
}

/// An overtaken or repeated answer is ignored.
#[test]
fn old_messages_restore_no_contract() {
    let mut team = team(&[&[90.0], &[10.0]]);
    until_taken(&mut team, 0);
    let answer = team.in_flight.iter().find(|broadcast| {
        broadcast.sender == RobotId(1) && matches!(broadcast.body, BroadcastContent::Allocation(_))
    });
    let answer = answer.unwrap().clone();
    team.run(5);
    team.situation.tasks[0].units = Some(0);
    team.run(5);
    assert!(team.executors(0).is_empty());
    team.in_flight.push(answer);
    team.step();
    team.situation.tasks[0].units = None;
    let due = team.now();
    until_taken(&mut team, 0);
    assert_eq!(team.now() - STEP, due + AUCTION + STEP);
}

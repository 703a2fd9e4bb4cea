//! The laws of MURDOCH (ALLOCATORS.md §5), and those for all.

use std::collections::{BTreeMap, BTreeSet};

use alliance_proto::allocation::AllocationMessage;
use alliance_proto::allocation::murdoch::{Negotiation, Status, Word};
use alliance_proto::ids::{Incarnation, RobotId, TaskId};
use alliance_proto::team::{Broadcast, Content};
use alliance_proto::telemetry::Reason;
use alliance_proto::time::SimTime;
use proptest::prelude::*;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::{Config, Monitor, Murdoch};
use crate::allocators::team::{STEP, Situation, TAU, Task, Team, words};
use crate::testkit;

const LEASE: SimTime = SimTime(6000);
const AUCTION: SimTime = SimTime(500);

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
    words(&team.air)
        .filter_map(|(robot, word)| match word {
            AllocationMessage::Murdoch(said) => Some((robot, *said)),
            _ => None,
        })
        .collect()
}

/// An auction's name, to be sorted by.
type Name = (RobotId, Incarnation, u32);

fn name(said: &Negotiation) -> Name {
    let auction = said.auction;
    (auction.auctioneer, auction.incarnation, auction.number)
}

/// Runs until somebody is at the task.
fn until_taken(team: &mut Team<Murdoch>, task: usize) {
    let limit = team.now() + SimTime(60_000);
    while team.executors(task).is_empty() {
        assert!(team.now() < limit, "nobody takes task {task}");
        team.step();
    }
}

/// Changes some costs, and which tasks are due.
fn change(situation: &mut Situation, chance: &mut ChaCha8Rng) {
    for row in &mut situation.cost_s {
        for cost_s in row.iter_mut().flatten() {
            if chance.random_bool(0.3) {
                *cost_s = chance.random_range(0.1..100.0);
            }
        }
    }
    for task in &mut situation.tasks {
        if chance.random_bool(0.3) {
            task.units = if task.units.is_none() { Some(0) } else { None };
        }
    }
}

#[test]
fn it_keeps_the_laws_for_all() {
    testkit::allocator::<Murdoch>(&Config::default());
    let quick = Config {
        auction_s: 0.1,
        renew_hz: 5.0,
        lease_s: 0.5,
        parallel: 2,
        progress_units: 0.2,
        ban_s: 2.0,
        ..watchful()
    };
    testkit::allocator::<Murdoch>(&quick);
}

/// The whole course: an auctioneer listens for a lease, takes bids, awards to the best; the winner is at it a step later.
#[test]
fn an_auction_from_announcement_to_work() {
    let mut team = Team::<Murdoch>::new(
        Situation::of(&[&[30.0], &[20.0], &[40.0]]),
        Config::default(),
    );
    until_taken(&mut team, 0);
    assert_eq!(team.executors(0), [1]);
    let change = &team.robots[1].outcome.changes[0];
    assert_eq!(change.reason, Reason::Awarded);
    assert_eq!(team.now() - STEP, LEASE + AUCTION + STEP);
    // A nearer one gets nothing that is given away.
    team.situation.cost_s[0][0] = Some(1.0);
    team.run(300);
    assert_eq!(team.executors(0), [1]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// M1: a contract that is no longer answered is announced again a lease and a step after the last answer was heard, and is at work
    /// again an auction and a step later, if one hears it who is free and can.
    #[test]
    fn m1_the_contract_of_the_dead_is_auctioned_anew(
        costs in prop::collection::vec(1..200_u32, 3..6),
        wait in 1..300_u64,
    ) {
        let costs: Vec<[f64; 1]> = costs.into_iter().map(|cost| [f64::from(cost)]).collect();
        let rows: Vec<&[f64]> = costs.iter().map(|row| &row[..]).collect();
        let mut team = Team::<Murdoch>::new(Situation::of(&rows), Config::default());
        until_taken(&mut team, 0);
        let mut answered = team.now() - STEP;
        for _ in 0..wait {
            let now = team.now();
            team.step();
            if negotiations(&team).iter().any(|(_, it)| matches!(it.word, Word::Ack { .. })) {
                answered = now;
            }
        }
        let winner = team.executors(0)[0];
        let (mut heard_last, mut announced) = (SimTime::ZERO, None);
        for (robot, _) in team.air.iter().map(|it| (it.sender, ())) {
            if robot.index() == winner {
                heard_last = team.now();
            }
        }
        team.kill(winner);
        while team.executors(0).is_empty() {
            let now = team.now();
            prop_assert!(now < answered + SimTime(60_000));
            team.step();
            let mut said = negotiations(&team).into_iter();
            if announced.is_none() && said.any(|(_, it)| matches!(it.word, Word::Announce { .. })) {
                announced = Some(now);
            }
        }
        let (announced, taken) = (announced.unwrap(), team.now() - STEP);
        prop_assert_eq!(taken, announced + AUCTION + STEP);
        if winner == 0 {
            // The auctioneer died with the winner: τ until the next one takes office, and it listens for a lease.
            prop_assert!(announced <= heard_last.max(answered) + TAU + SimTime(1000) + LEASE + steps(2));
            prop_assert!(taken <= answered + SimTime(1000) + TAU + LEASE + LEASE + AUCTION + steps(4));
        } else {
            prop_assert_eq!(announced, answered + STEP + LEASE + STEP);
            prop_assert!(taken <= answered + LEASE + AUCTION + steps(4));
        }
    }

    /// M2: the winner is the best of the bids heard, of those who have no contract yet. M3: nobody holds two contracts, and who holds
    /// one does not bid. M4: lossless and with one auctioneer a task never has more executors than may be.
    #[test]
    fn m2_m3_m4_in_lossless_teams(
        situation in Situation::any(5, 4),
        seed in any::<u64>(),
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut team = Team::<Murdoch>::new(situation, Config::default());
        // All can do all: there is one auctioneer.
        for row in &mut team.situation.cost_s {
            for cost_s in row.iter_mut() {
                *cost_s = Some(chance.random_range(1.0..99.0));
            }
        }
        let mut team = Team::<Murdoch>::new(team.situation, Config::default());
        let mut bids: BTreeMap<Name, Vec<(f32, RobotId)>> = BTreeMap::new();
        let mut awarded: BTreeSet<Name> = BTreeSet::new();
        // When each was last seen to have a contract.
        let mut busy = vec![SimTime::ZERO; team.robots.len()];
        let mut awards = 0;
        for _ in 0..1200 {
            if chance.random_bool(0.02) {
                change(&mut team.situation, &mut chance);
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
            for (robot, said) in negotiations(&team) {
                match said.word {
                    Word::Renew { winner } if awarded.insert(name(&said)) => {
                        awards += 1;
                        prop_assert!(winners.insert(winner), "M3: one award at a time");
                        let bids = bids.remove(&name(&said)).unwrap_or_default();
                        // That a contract has ended is heard a step later.
                        let is_free = |it: &RobotId| now.since(busy[it.index()]) > steps(2) && !winners.contains(it);
                        let free = bids.iter().filter(|(_, it)| *it == winner || is_free(it));
                        let best = free.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
                        prop_assert_eq!(best.map(|it| it.1), Some(winner), "M2: {:?}", bids);
                        // It may give the award back, which is heard two steps later.
                        busy[winner.index()] = now;
                    }
                    Word::Bid { utility } => {
                        let active = team.robots[robot.index()].active;
                        // It may be awarded another in the very step in which it bids.
                        let began = team.robots[robot.index()].outcome.changes.iter().any(|it| it.reason == Reason::Awarded);
                        prop_assert!(active.is_none() || began, "M3: who has a contract does not bid");
                        bids.entry(name(&said)).or_default().push((utility, robot));
                    }
                    _ => {}
                }
            }
            for (id, task) in team.situation.tasks.iter().enumerate() {
                prop_assert!(team.executors(id).len() <= task.max_robots, "M4");
            }
        }
        // Where nothing was due for long enough, nothing was tried.
        prop_assume!(awards > 0);
        // What goes on costs a renewal and an answer a second, what nobody has time for two announcements.
        for task in &mut team.situation.tasks {
            task.units = None;
        }
        team.run(200);
        // Progress is told besides, as often as there is any.
        let (mut words, mut told) = (0, BTreeMap::new());
        for _ in 0..200 {
            team.step();
            for (robot, said) in negotiations(&team) {
                let is_news = match said.word {
                    Word::Ack { progress, .. } => told.insert((robot, said.task), progress) < Some(progress),
                    _ => false,
                };
                words += usize::from(!is_news);
            }
        }
        prop_assert!(words <= 10 * 3 * team.situation.tasks.len() * 2, "{words} in 10 s");
    }

    /// M3, whatever is lost: of nobody two contracts are alive by its own words.
    #[test]
    fn m3_nobody_holds_two_contracts(
        situation in Situation::any(4, 4),
        seed in any::<u64>(),
        loss in 0.0..0.8_f64,
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let mut team = Team::<Murdoch>::new(situation, Config::default());
        let mut held: Vec<BTreeSet<Name>> = vec![BTreeSet::new(); team.robots.len()];
        for _ in 0..1200 {
            if chance.random_bool(0.01) {
                change(&mut team.situation, &mut chance);
            }
            team.step_with(|_, _| !chance.random_bool(loss));
            for (robot, said) in negotiations(&team) {
                if let Word::Ack { status, .. } = said.word {
                    let held = &mut held[robot.index()];
                    match status {
                        Status::Ongoing => held.insert(name(&said)),
                        Status::Done | Status::Abort => held.remove(&name(&said)),
                    };
                }
            }
            prop_assert!(held.iter().all(|held| held.len() <= 1), "{held:?}");
        }
    }

    /// M5: no robot keeps a task without progress for longer than progress_s + lease_s, nor gets it back within ban_s.
    #[test]
    fn m5_who_gets_nowhere_loses_the_task(
        robots in 2..5_usize,
        costs in prop::collection::vec(1..60_u32, 1..4),
        useless in any::<prop::sample::Index>(),
    ) {
        let costs: Vec<f64> = costs.into_iter().map(|cost| f64::from(cost) / 10.0).collect();
        let config = watchful();
        let (progress_units, ban) = (config.progress_units, SimTime::from_secs_f64(config.ban_s));
        let useless = useless.index(robots);
        let mut situation = Situation::of(&vec![&costs[..]; robots]);
        // It always has the best bid.
        situation.cost_s[useless] = costs.iter().map(|cost| Some(cost / 2.0)).collect();
        let mut team = Team::<Murdoch>::new(situation, config);
        team.robots[useless].works = false;
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
                        prop_assert!(now >= *left + ban - LEASE - steps(2), "banned at the latest when it leaves");
                    }
                }
                (since, before) = (now, active);
            }
            if let Some(task) = active {
                let patience = SimTime::from_secs_f64(progress_units * costs[task.index()]);
                // The watch begins with the award, which takes a step.
                prop_assert!(now.since(since) <= patience + LEASE + steps(3));
            }
        }
        prop_assert!(stints > 0);
    }

    /// G5: alone, or deaf to all others, a robot that can do everything completes it.
    #[test]
    fn g5_with_all_links_cut_everything_is_done(robots in 1..4_usize, costs in prop::collection::vec(1..8_u32, 1..5)) {
        let costs: Vec<f64> = costs.into_iter().map(f64::from).collect();
        let mut situation = Situation::of(&vec![&costs[..]; robots]);
        for task in &mut situation.tasks {
            task.units = Some(2);
        }
        let mut team = Team::<Murdoch>::new(situation, Config::default());
        // All believe to be auctioneers once nobody has been heard for a lease; an auction comes before each task.
        let limit_s = 6.0 + 2.0 * costs.iter().sum::<f64>() + 0.7 * costs.len() as f64 + 1.0;
        while team.now().as_secs_f64() < limit_s {
            team.step_with(|_, _| false);
        }
        prop_assert!(team.is_done());
    }

    /// Whatever is lost, what can be done is done.
    #[test]
    fn with_losses_everything_is_done(
        costs in prop::collection::vec(prop::collection::vec(1..8_u32, 3), 2..5),
        seed in any::<u64>(),
        loss in 0.0..0.6_f64,
    ) {
        let mut chance = ChaCha8Rng::seed_from_u64(seed);
        let costs: Vec<Vec<f64>> = costs.iter().map(|row| row.iter().map(|&it| f64::from(it)).collect()).collect();
        let rows: Vec<&[f64]> = costs.iter().map(|row| &row[..]).collect();
        let mut situation = Situation::of(&rows);
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

/// Both sides of a partition have an auctioneer; healed, the contract of the lower-ranked one holds, within a renewal and two steps.
#[test]
fn a_partition_that_heals_leaves_the_contract_of_the_lower_rank() {
    let mut team = Team::<Murdoch>::new(
        Situation::of(&[&[50.0], &[90.0], &[10.0]]),
        Config::default(),
    );
    let cut =
        |broadcast: &Broadcast, receiver: RobotId| (broadcast.sender.0 < 2) == (receiver.0 < 2);
    for _ in 0..300 {
        team.step_with(cut);
    }
    assert_eq!(team.executors(0), [0, 2]);
    team.run(20 + 2);
    assert_eq!(team.executors(0), [0]);
}

/// The auctioneer dies, the winner works on: the next auctioneer knows the contract and renews it.
#[test]
fn a_new_auctioneer_adopts_what_goes_on() {
    let mut team = Team::<Murdoch>::new(
        Situation::of(&[&[70.0], &[60.0], &[50.0]]),
        Config::default(),
    );
    until_taken(&mut team, 0);
    team.run(25);
    team.kill(0);
    for _ in 0..1000 {
        team.step();
        assert_eq!(team.executors(0), [2]);
    }
    // The old one comes back, listens, and takes it over in turn.
    team.restart(0);
    for _ in 0..1000 {
        team.step();
        assert_eq!(team.executors(0), [2]);
    }
}

/// The lowest rank is heard, but nobody hears it announce: the next one takes the office after τ and a lease, and listens for one more.
#[test]
fn a_task_that_the_auctioneer_does_not_care_for_is_auctioned_by_the_next() {
    let mut situation = Situation::of(&[&[90.0, 90.0], &[50.0, 10.0]]);
    situation.tasks[0] = Task {
        max_robots: 2,
        ..Task::default()
    };
    let mut team = Team::<Murdoch>::new(situation, Config::default());
    let mute = |broadcast: &Broadcast, _: RobotId| {
        !(broadcast.sender == RobotId(0) && matches!(broadcast.body, Content::Allocation(_)))
    };
    while team.executors(1) != [1] {
        assert!(team.now() < SimTime(20_000));
        team.step_with(mute);
    }
    assert_eq!(team.now() - STEP, TAU + LEASE + LEASE + AUCTION + STEP);
}

/// What is no bid, no award and no answer changes nothing: no numbers, times to come, robots and tasks that there are not.
#[test]
fn forged_words_change_nothing() {
    let mut team = Team::<Murdoch>::new(
        Situation::of(&[&[30.0], &[20.0], &[40.0]]),
        Config::default(),
    );
    let mut open = None;
    while open.is_none() {
        team.step();
        open = negotiations(&team).pop();
    }
    let (_, announced) = open.unwrap();
    let forge = |team: &mut Team<Murdoch>, said| team.forge(2, AllocationMessage::Murdoch(said));
    for utility in [f32::NAN, f32::INFINITY] {
        forge(
            &mut team,
            Negotiation {
                word: Word::Bid { utility },
                ..announced
            },
        );
    }
    for said in [
        Negotiation {
            task: TaskId(9),
            ..announced
        },
        Negotiation {
            round: SimTime(u64::MAX),
            word: Word::Renew { winner: RobotId(2) },
            ..announced
        },
        Negotiation {
            word: Word::Renew {
                winner: RobotId(999),
            },
            ..announced
        },
        Negotiation {
            word: Word::Announce {
                closes: SimTime::ZERO,
            },
            ..announced
        },
    ] {
        forge(&mut team, said);
    }
    until_taken(&mut team, 0);
    assert_eq!(team.executors(0), [1]);
    assert_eq!(team.now() - STEP, LEASE + AUCTION + STEP);
}

/// A robot that starts again knows nothing of its contract, and says so: the task is auctioned at once.
#[test]
fn a_new_life_gives_its_old_contract_back() {
    let mut team = Team::<Murdoch>::new(
        Situation::of(&[&[90.0], &[10.0], &[50.0]]),
        Config::default(),
    );
    until_taken(&mut team, 0);
    team.run(5);
    assert_eq!(team.executors(0), [1]);
    let mut renewed = None;
    while renewed.is_none() {
        team.step();
        let mut said = negotiations(&team).into_iter();
        renewed = said.find(|(_, it)| matches!(it.word, Word::Renew { .. }));
    }
    team.restart(1);
    let back = team.now();
    // A renewal that is still on its way names it, and is given back.
    let (_, renewed) = renewed.unwrap();
    team.step();
    assert!(team.executors(0).is_empty());
    assert!(negotiations(&team).iter().any(|(robot, it)| {
        let gives_back = matches!(
            it.word,
            Word::Ack {
                status: Status::Abort,
                ..
            }
        );
        *robot == RobotId(1) && gives_back && it.auction == renewed.auction
    }));
    until_taken(&mut team, 0);
    assert_eq!(team.executors(0), [1]);
    assert_eq!(team.now() - STEP, back + STEP + AUCTION + STEP);
}

/// An answer that is overtaken by a later one of its sender, or comes twice, is none.
#[test]
fn old_words_bring_no_contract_back() {
    let mut team = Team::<Murdoch>::new(Situation::of(&[&[90.0], &[10.0]]), Config::default());
    until_taken(&mut team, 0);
    let answer = team
        .air
        .iter()
        .find(|it| it.sender == RobotId(1) && matches!(it.body, Content::Allocation(_)));
    let answer = answer.unwrap().clone();
    team.run(5);
    team.situation.tasks[0].units = Some(0);
    team.run(5);
    assert!(team.executors(0).is_empty());
    team.air.push(answer);
    team.step();
    team.situation.tasks[0].units = None;
    let due = team.now();
    until_taken(&mut team, 0);
    assert_eq!(team.now() - STEP, due + AUCTION + STEP);
}

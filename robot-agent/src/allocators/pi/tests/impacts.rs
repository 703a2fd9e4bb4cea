//! Removal and inclusion impacts against hand-computed values, and what a single exchange does to the global cost.

use std::sync::Arc;

use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::reference::cost;
use crate::allocator::unit::WorkUnit;
use crate::allocator::{Allocator, Choice, Decision, Input, SelfState};
use crate::allocators::consensus::winners::Winners;
use crate::allocators::pi::impact::Costs;
use crate::allocators::pi::{Pi, PiConfig};
use crate::allocators::team::Situation;
use crate::fixtures;

/// Three tasks on a line, 10 s apart: at 10, 20 and 30 s from the robot. A unit takes the way alone.
fn line_s(after: &[TaskId], task: TaskId) -> Option<f64> {
    let at = |task: TaskId| 10.0 * (f64::from(task.0) + 1.0);
    let from = after.last().map_or(0.0, |&last| at(last));
    Some((at(task) - from).abs())
}

fn state(robot: u32, team: usize, tasks: usize) -> SelfState {
    let brief = fixtures::brief(team, 60.0);
    fixtures::self_state(RobotId(robot), team, vec![brief; tasks].into())
}

fn choices(first_s: impl Fn(u32) -> f64, tasks: usize) -> Vec<Choice> {
    let ids = 0..tasks as u32;
    ids.map(|task| fixtures::choice(task, first_s(task)))
        .collect()
}

fn with_costs<T>(
    choices: &[Choice],
    seconds: &dyn Fn(&[TaskId], TaskId) -> Option<f64>,
    run: impl FnOnce(&Costs<'_, '_>) -> T,
) -> T {
    let winners = Winners::new(&state(0, 2, choices.len()));
    let input = Input {
        choices,
        seconds,
        ..fixtures::input(SimTime(1000), RobotId(0))
    };
    run(&Costs::new(&input, winners.tasks(), &WorkUnit::default()))
}

#[test]
fn impacts_match_hand_calculation() {
    let mut choices = choices(|task| 10.0 * (f64::from(task) + 1.0), 3);
    with_costs(&choices, &line_s, |costs| {
        // 10 + 20 + 30.
        assert_eq!(costs.cost(&[0, 1, 2]), Some(60.0));
        // 30, then 20 s back: 30 + 50.
        assert_eq!(costs.cost(&[2, 0]), Some(80.0));
        // The last task is on the way of no other one.
        assert_eq!(costs.removal(&[0, 1, 2], 2), Some(30.0));
        // The first one delays none, because it is on the way.
        assert_eq!(costs.removal(&[0, 1, 2], 0), Some(10.0));
        // Task 2 first delays task 0 from 10 s to 50 s: 80 − 10.
        assert_eq!(costs.removal(&[2, 0], 0), Some(70.0));
        assert_eq!(costs.removal(&[2, 0], 1), Some(50.0));
        // Task 1 fits between 0 and 2 at 20 s; before, behind and first cost 50, 70 and 20 s or more.
        assert_eq!(costs.inclusion(&[0, 2], 1, 0..=2), Some((1, 20.0)));
        // At the end alone: 30, and 10 s back to 20.
        assert_eq!(costs.inclusion(&[0, 2], 1, 2..=2), Some((2, 40.0)));
    });
    // A reward weighs the own time, and the delay of others by theirs.
    choices[2].reward = 3.0;
    with_costs(&choices, &line_s, |costs| {
        assert_eq!(costs.removal(&[2, 0], 0), Some(3.0 * 30.0 + 40.0));
        assert_eq!(costs.removal(&[0, 2], 1), Some(90.0));
    });
}

/// Task 0 opens in 50 s. The wait costs nothing, and a task that cannot be done has no impact.
#[test]
fn a_wait_before_the_window_costs_nothing() {
    let choices = [
        Choice {
            opens_in_s: 50.0,
            ..fixtures::choice(0, 60.0)
        },
        fixtures::choice(1, 30.0),
        Choice {
            cost_s: None,
            ..fixtures::choice(2, 0.0)
        },
    ];
    let seconds = |after: &[TaskId], task: TaskId| match (after, task) {
        ([TaskId(1)], TaskId(0)) => Some(30.0),
        ([TaskId(0)], TaskId(1)) => Some(30.0),
        _ => None,
    };
    with_costs(&choices, &seconds, |costs| {
        assert_eq!(costs.cost(&[0]), Some(10.0));
        assert_eq!(costs.inclusion(&[0], 1, 0..=1), Some((0, 30.0)));
        assert_eq!(costs.inclusion(&[0], 2, 0..=1), None);
        assert_eq!(costs.cost(&[1, 2]), None);
    });
}

/// A robot that has begun a unit claims it with impact 0, and a laden one with −r. Without progress for 60 s, the impact
/// is that of any task.
#[test]
fn a_unit_under_way_has_no_impact_until_it_lapses() {
    let mut robot = Pi::new(&state(0, 2, 2), &PiConfig::default());
    let mut decision = Decision::default();
    let choices = choices(|task| 10.0 * (f64::from(task) + 1.0), 2);
    let mut gamma_at = |ms: u64, is_laden: bool| {
        let input = Input {
            applicable: &[true, true],
            choices: &choices,
            seconds: &line_s,
            is_laden,
            ..fixtures::input(SimTime(ms), RobotId(0))
        };
        decision.say.clear();
        decision.rows.clear();
        robot.step(&input, &mut decision);
        assert_eq!(decision.active, Some(BehaviorId(0)));
        let claim = robot.beliefs.entries()[0].claim.unwrap();
        -claim.value
    };
    assert_eq!(gamma_at(0, false), 10.0);
    assert_eq!(gamma_at(4000, false), 10.0);
    assert_eq!(gamma_at(6000, false), 0.0);
    assert_eq!(gamma_at(7000, true), -1.0);
    assert_eq!(gamma_at(8000, false), 0.0);
    assert_eq!(gamma_at(70_000, false), 10.0);
}

proptest! {
    /// The published argument: a task that moves to a list where its inclusion impact is below its removal impact
    /// lowers the sum of the costs of both lists, by the difference.
    #[test]
    fn a_single_exchange_lowers_the_global_cost_by_the_difference_of_impacts(
        seed: u64,
        tasks in 1..7_usize,
        split in 0..7_usize,
        moved in 0..7_usize,
    ) {
        let situation = Situation::on_grid(&mut ChaCha8Rng::seed_from_u64(seed), 2, tasks);
        let order: Vec<usize> = (0..tasks).collect();
        let (giver, taker) = order.split_at(1 + split % tasks);
        let at = moved % giver.len();
        let situation = &situation;
        let seconds = |robot: usize| {
            move |after: &[TaskId], task: TaskId| situation.seconds(robot, after, task)
        };
        let of_robot = |robot: usize| {
            let mut choices = choices(|task| seconds(robot)(&[], TaskId(task)).unwrap(), tasks);
            for (choice, task) in choices.iter_mut().zip(&situation.tasks) {
                choice.reward = task.reward;
            }
            choices
        };
        let removal = with_costs(&of_robot(0), &seconds(0), |costs| costs.removal(giver, at));
        let included = with_costs(&of_robot(1), &seconds(1), |costs| {
            costs.inclusion(taker, giver[at], 0..=taker.len())
        });
        let (removal, (place, inclusion)) = (removal.unwrap(), included.unwrap());
        let before = cost(situation, 0, giver) + cost(situation, 1, taker);
        let (mut without, mut with) = (giver.to_vec(), taker.to_vec());
        with.insert(place, without.remove(at));
        let after = cost(situation, 0, &without) + cost(situation, 1, &with);
        prop_assert!((before - after - (removal - inclusion)).abs() < 1e-6);
    }
}

/// Both phases of one robot against a teammate's claims: the robot takes the task whose impact is lower, and leaves the
/// other.
#[test]
fn a_task_moves_to_the_lower_impact() {
    use proto::allocation::AllocationMessage;
    use proto::allocation::consensus::{BidTable, TableEntry, WinningBid};
    use proto::team::BroadcastContent;

    let entry = |task: u32, gamma: f32| TableEntry {
        task: TaskId(task),
        round: SimTime::ZERO,
        claim: Some(WinningBid {
            robot: RobotId(1),
            value: -gamma,
        }),
    };
    let table = BidTable {
        beliefs: vec![entry(0, 5.0), entry(1, 12.0)],
        ..BidTable::default()
    };
    let content = BroadcastContent::Allocation(AllocationMessage::Impacts(table));
    let received = [Arc::new(fixtures::broadcast(
        RobotId(1),
        (1, 0),
        SimTime(950),
        content,
    ))];
    let choices = choices(|_| 10.0, 2);
    let mut robot = Pi::new(&state(0, 2, 2), &PiConfig::default());
    let input = Input {
        applicable: &[true, true],
        choices: &choices,
        seconds: &|_, _| Some(10.0),
        received: &received,
        ..fixtures::input(SimTime(1000), RobotId(0))
    };
    let mut decision = Decision::default();
    robot.step(&input, &mut decision);
    let holders = [0, 1].map(|task| robot.beliefs.holder(TaskId(task)));
    assert_eq!(holders, [Some(RobotId(1)), Some(RobotId(0))]);
    assert_eq!(robot.list.tasks(&robot.beliefs), [1]);
}

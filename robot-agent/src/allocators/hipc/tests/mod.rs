//! The properties of HIPC (docs/allocators/hipc.md), in teams in lockstep, and its differences from CBBA.

use std::sync::Arc;

use proto::allocation::AllocationMessage;
use proto::allocation::awareness::{Awareness, TaskCost};
use proto::allocation::consensus::BLOCK_TASKS;
use proto::team::BroadcastContent;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::{Hipc, HipcConfig};
use crate::allocator::{Allocator, Choice, Decision, Input, TaskBrief};
use crate::allocators::cbba::Cbba;
use crate::allocators::cbba::bundle::Bundle;
use crate::allocators::cbba::tests::laws::{
    Open, REFRESHES, agrees_after_trouble, assignment, beliefs, check_beliefs, random_bidders,
    settles_with_loss,
};
use crate::allocators::cbba::tests::reference::greedy;
use crate::allocators::consensus::team::{NEVER, random_team};
use crate::allocators::consensus::winners::Winners;
use crate::allocators::team::{Situation, Team};
use crate::{fixtures, testkit};

/// The steps of the default wait.
const WAIT_STEPS: usize = 4;

impl Open for Hipc {
    fn config(bundle: usize, refresh_s: f64) -> HipcConfig {
        HipcConfig {
            bundle,
            refresh_s,
            awareness_s: 1e6,
            ..HipcConfig::default()
        }
    }
    fn parts(&self) -> (&Winners, &Bundle) {
        (&self.bidder.beliefs, &self.bidder.bundle)
    }
}

#[test]
fn hipc_keeps_the_properties_of_all_allocators() {
    testkit::check_allocator::<Hipc>(&HipcConfig::default());
    testkit::check_allocator::<Hipc>(&Hipc::config(4, 0.1));
    testkit::check_allocator::<Hipc>(&HipcConfig {
        awareness_s: 0.0,
        ..HipcConfig::default()
    });
}

/// Without awareness, each decision and each message is that of CBBA, with and without message loss.
#[test]
fn hipc_without_awareness_is_cbba() {
    for seed in 0..200 {
        let refresh_s = REFRESHES[seed as usize % 2];
        let (mut cbba, _) = random_bidders::<Cbba>(seed, refresh_s, NEVER);
        let mut hipc = random_team::<Hipc>(seed, NEVER, |chance| HipcConfig {
            awareness_s: 0.0,
            ..Hipc::config(chance.random_range(1..4), refresh_s)
        });
        (cbba.loss, hipc.loss) = (0.3, 0.3);
        for _ in 0..60 {
            cbba.step();
            hipc.step();
            assert_eq!(cbba.in_flight, hipc.in_flight, "seed {seed}");
            for (of_cbba, of_hipc) in cbba.robots.iter().zip(&hipc.robots) {
                assert_eq!(of_cbba.outcome, of_hipc.outcome, "seed {seed}");
            }
        }
    }
}

/// All robots agree, with one claim per place, and nothing changes afterwards. The result is that of CBBA, the sequential
/// greedy assignment, except in few teams: a robot that has left a task after a wrong prediction may have a full bundle.
#[test]
fn all_robots_agree_and_nearly_always_as_with_cbba() {
    let mut greedy_teams = 0;
    for seed in 0..600 {
        let (mut team, bundle) = random_bidders::<Hipc>(seed, REFRESHES[seed as usize % 2], NEVER);
        let situation = team.situation.clone();
        // A wrong prediction delays each bid by the wait.
        let claims = situation.places().min(bundle * team.robots.len());
        let rounds = claims * (team.diameter() + WAIT_STEPS);
        for _ in 0..=rounds {
            team.step();
            check_beliefs(&team);
        }
        let (settled, agreed) = (assignment(&team), beliefs(&team));
        for other in &agreed {
            assert_eq!(*other, agreed[0], "seed {seed}: {situation:?}");
        }
        team.run(20);
        assert_eq!(beliefs(&team), agreed, "seed {seed}");
        let expected = greedy(&situation, bundle);
        greedy_teams += u32::from(settled == expected);
        let count = |assignment: &[Vec<_>]| assignment.iter().map(Vec::len).sum::<usize>();
        assert_eq!(
            count(&settled),
            count(&expected),
            "seed {seed}: {situation:?}"
        );
    }
    assert!(greedy_teams >= 595, "{greedy_teams}");
}

/// A robot leaves a task to a teammate that is nearer, but that does not claim it. After the wait the robot takes it.
#[test]
fn a_wrong_prediction_delays_the_bid_by_the_wait() {
    let me = fixtures::self_state(RobotId(0), 2, [fixtures::brief(2, 60.0)].into());
    let mut robot = Hipc::new(&me, &HipcConfig::default());
    let choices = [fixtures::choice(0, 30.0)];
    let costs = Awareness {
        block: 0,
        costs: vec![TaskCost {
            task: TaskId(0),
            cost_s: 1.0,
            worth: 0.98,
        }],
    };
    let content = BroadcastContent::Allocation(AllocationMessage::Awareness(costs));
    let message = fixtures::broadcast(RobotId(1), (1, 0), SimTime(950), content);
    let received = [Arc::new(message)];
    let mut decision = Decision::default();
    for ms in (1000..=1200).step_by(50) {
        let input = Input {
            applicable: &[true],
            choices: &choices,
            seconds: &|_, _| Some(30.0),
            received: if ms == 1000 { &received } else { &[] },
            ..fixtures::input(SimTime(ms), RobotId(0))
        };
        decision.say.clear();
        decision.rows.clear();
        robot.step(&input, &mut decision);
        let is_taken = decision.active == Some(BehaviorId(0));
        assert_eq!(is_taken, ms == 1200, "{ms}");
    }
}

/// A teammate has sent the costs of its tasks in two blocks, and restarts. Its first message contains the costs of the first
/// block alone. The robot does not leave the task of the other block to it.
#[test]
fn a_restarted_teammate_loses_its_old_costs() {
    const LAST: u32 = BLOCK_TASKS;
    let briefs = vec![fixtures::brief(2, 60.0); LAST as usize + 1];
    let me = fixtures::self_state(RobotId(0), 2, briefs.into());
    let costs = |block, tasks: &[u32]| {
        let cost = |&task| TaskCost {
            task: TaskId(task),
            cost_s: 1.0,
            worth: 0.98,
        };
        AllocationMessage::Awareness(Awareness {
            block,
            costs: tasks.iter().map(cost).collect(),
        })
    };
    let message = |number, ms, content| {
        let content = BroadcastContent::Allocation(content);
        Arc::new(fixtures::broadcast(
            RobotId(1),
            number,
            SimTime(ms),
            content,
        ))
    };
    let before = [
        message((1, 0), 850, costs(0, &[])),
        message((1, 1), 900, costs(1, &[LAST])),
    ];
    let restarted = message((2, 0), 950, costs(0, &[]));
    let mut choices: Vec<Choice> = (0..=LAST)
        .map(|task| fixtures::choice(task, 30.0))
        .collect();
    let mut applicable = vec![false; choices.len()];
    applicable[LAST as usize] = true;
    for (choice, applicable) in choices.iter_mut().zip(&applicable) {
        choice.applicable = *applicable;
    }
    for is_restarted in [false, true] {
        let mut robot = Hipc::new(&me, &HipcConfig::default());
        let mut received = before.to_vec();
        received.extend(is_restarted.then(|| Arc::clone(&restarted)));
        let input = Input {
            applicable: &applicable,
            choices: &choices,
            seconds: &|_, _| Some(30.0),
            received: &received,
            ..fixtures::input(SimTime(1000), RobotId(0))
        };
        let mut decision = Decision::default();
        robot.step(&input, &mut decision);
        let is_taken = decision.active == Some(BehaviorId(LAST));
        assert_eq!(is_taken, is_restarted);
    }
}

/// Three tables are due in each step, and two messages are allowed. One of them contains the costs.
#[test]
fn tables_do_not_keep_back_the_costs() {
    let brief = TaskBrief {
        max_robots: 3,
        ..fixtures::brief(4, 60.0)
    };
    let me = fixtures::self_state(RobotId(0), 4, [brief].into());
    let mut robot = Hipc::new(&me, &Hipc::config(2, 0.01));
    let choices = [fixtures::choice(0, 30.0)];
    let mut decision = Decision::default();
    for tick in 0..10 {
        let input = Input {
            applicable: &[true],
            choices: &choices,
            seconds: &|_, _| Some(30.0),
            ..fixtures::input(SimTime(50 * tick), RobotId(0))
        };
        decision.say.clear();
        decision.rows.clear();
        robot.step(&input, &mut decision);
        let costs = decision.say.iter();
        let costs = costs.filter(|message| matches!(message, AllocationMessage::Awareness(_)));
        assert_eq!(
            (costs.count(), decision.say.len()),
            (usize::from(tick > 0), 2)
        );
    }
}

#[test]
fn repeated_messages_reach_the_same_result_despite_loss() {
    // One of the 80 situations needs between 400 and 1,600 rounds.
    settles_with_loss::<Hipc>(0.3, 1600, 24);
    settles_with_loss::<Hipc>(0.6, 800, 12);
}

#[test]
fn hipc_agrees_after_trouble() {
    agrees_after_trouble::<Hipc>();
}

/// Returns the number of rounds until all robots have the final claims for good.
fn rounds<A: Open>(seed: u64, is_line: bool) -> usize {
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let (robots, tasks) = (chance.random_range(2..8), chance.random_range(2..16));
    let situation = Situation::on_grid(&mut chance, robots, tasks);
    let bundle = chance.random_range(1..4);
    let mut team = Team::<A>::still(seed, NEVER, situation, A::config(bundle, 1e6));
    if is_line {
        team.connect_as_line(0.0);
    }
    let mut history = Vec::new();
    for _ in 0..300 {
        team.step();
        history.push(beliefs(&team));
    }
    let last = history.last().unwrap().clone();
    let settled = history.iter().rposition(|beliefs| *beliefs != last);
    settled.map_or(1, |before| before + 2)
}

/// With all robots in range, HIPC needs no more rounds than CBBA. On lines, where a robot has the costs of its
/// neighbors alone, it sometimes does.
#[test]
fn hipc_needs_no_more_rounds_than_cbba() {
    for is_line in [false, true] {
        let pairs: Vec<(usize, usize)> = (0..300)
            .map(|seed| (rounds::<Hipc>(seed, is_line), rounds::<Cbba>(seed, is_line)))
            .collect();
        let more = pairs.iter().filter(|(hipc, cbba)| hipc > cbba).count();
        let fewer = pairs.iter().filter(|(hipc, cbba)| hipc < cbba).count();
        let mean = |of: fn(&(usize, usize)) -> usize| {
            pairs.iter().map(of).sum::<usize>() as f64 / pairs.len() as f64
        };
        let (hipc, cbba) = (mean(|pair| pair.0), mean(|pair| pair.1));
        assert!(hipc < cbba, "line {is_line}: {hipc} and {cbba}");
        // With all in range 0 and 204 of 300 pairs, on lines 11 and 33.
        let (most_more, least_fewer) = if is_line { (20, 20) } else { (0, 150) };
        assert!(
            more <= most_more && fewer >= least_fewer,
            "line {is_line}: {more}, {fewer}"
        );
    }
}

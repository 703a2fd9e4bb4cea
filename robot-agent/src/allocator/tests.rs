//! Tests of the laws for all allocators (docs/ALLOCATORS.md, "The laws") and of the baselines.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use proptest::prelude::*;
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::team::{Broadcast, BroadcastContent, TaskState};
use proto::telemetry::Reason;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::testkit::default_setup;
use scenario::time::SimTime;
use terminal::panics;

use super::utility::DISCOUNT_PER_S;
use super::{
    Allocator, AllocatorRunner, Announcement, Choice, Decision, Input, RunningAllocator, SelfState,
    StepOutcome, assignment,
};
use crate::agent::TeamConfig;
use crate::allocators::first_come::FirstCome;
use crate::allocators::nearest::{Nearest, NearestSilent};
use crate::allocators::random::{self, Random};
use crate::allocators::static_assignment::Fixed;
use crate::fixtures::{self, STEP};
use crate::registry::AgentRegistry;
use crate::testkit;

#[test]
fn every_baseline_satisfies_the_laws() {
    testkit::check_allocator::<Nearest>(&Default::default());
    testkit::check_allocator::<NearestSilent>(&Default::default());
    testkit::check_allocator::<FirstCome>(&Default::default());
    testkit::check_allocator::<Fixed>(&Default::default());
    testkit::check_allocator::<Random>(&random::Config { redraw_s: 2.0 });
}

/// An allocator that breaks a law.
#[derive(Clone, Debug)]
struct Faulty {
    first: BehaviorId,
    received: usize,
    /// The number of steps of all clones.
    steps: Arc<AtomicUsize>,
    rule: Rule,
}

type Rule = fn(&mut Faulty, &Input<'_>, &mut Decision);

impl Allocator for Faulty {
    type Config = Rule;
    fn new(me: &SelfState, rule: &Rule) -> Self {
        Self {
            first: me.behaviors[0].id,
            received: 0,
            steps: Arc::default(),
            rule: *rule,
        }
    }
    fn step(&mut self, input: &Input<'_>, decision: &mut Decision) {
        (self.rule)(self, input, decision);
    }
}

/// Returns the first applicable behavior if `acts`.
fn first_if(acts: bool, input: &Input<'_>) -> Option<BehaviorId> {
    let mut applicable = input.choices.iter().filter(|choice| choice.applicable);
    applicable
        .next()
        .filter(|_| acts)
        .map(|choice| choice.behavior)
}

#[test]
fn the_testkit_finds_each_violation() {
    static LATEST: AtomicUsize = AtomicUsize::new(0);
    let violations: [(&str, Rule); 5] = [
        ("not applicable", |faulty, _, decision| {
            decision.active = Some(faulty.first);
        }),
        (
            "a second copy changes nothing",
            |faulty, input, decision| {
                faulty.received += input.received.len();
                decision.active = first_if(faulty.received % 3 == 1, input);
            },
        ),
        (
            "G1, the same inputs give the same decisions",
            |_, input, decision| {
                // All instances share the largest step so far.
                LATEST.fetch_max((input.now.0 / 50) as usize, Relaxed);
                decision.active = first_if(LATEST.load(Relaxed) > 300, input);
            },
        ),
        (
            "a step that does not count leaves no trace",
            |faulty, input, decision| {
                let steps = faulty.steps.fetch_add(1, Relaxed);
                decision.active = first_if(steps % 3 == 1, input);
            },
        ),
        ("G3, no message makes it panic", |_, input, decision| {
            for broadcast in input.received {
                if let BroadcastContent::Allocation(AllocationMessage::Open(message)) =
                    &broadcast.body
                    && message.schema == "trusts"
                {
                    assert_eq!(message.bytes.len(), 3, "the length of an own message");
                }
            }
            let message = OpenMessage {
                schema: "trusts".to_owned(),
                bytes: vec![1, 2, 3],
            };
            decision.say.push(AllocationMessage::Open(message));
        }),
    ];
    for (law, rule) in violations {
        let found = panics::catch(|| testkit::check_allocator::<Faulty>(&rule));
        let text = found.expect_err(law).to_string();
        assert!(text.contains(law), "{law}: {text}");
    }
}

fn me(robot: u32, tasks: usize) -> SelfState {
    let briefs = vec![fixtures::brief(3, 10.0); tasks];
    SelfState {
        assigned: [TaskId(1)].into(),
        ..fixtures::self_state(RobotId(robot), 3, briefs.into())
    }
}

fn choices(costs: &[f64]) -> Vec<Choice> {
    let costs = costs.iter().zip(0..);
    costs
        .map(|(&cost_s, task)| fixtures::choice(task, cost_s))
        .collect()
}

fn step(
    allocator: &mut dyn RunningAllocator,
    tick: u64,
    choices: &[Choice],
    received: &[Arc<Broadcast>],
    progressed: &[TaskId],
) -> StepOutcome {
    let applicable: Vec<bool> = choices.iter().map(|choice| choice.applicable).collect();
    let mut outcome = StepOutcome::default();
    let input = Input {
        applicable: &applicable,
        choices,
        progressed,
        received,
        ..fixtures::input(SimTime(STEP.0 * tick), RobotId(0))
    };
    allocator.step(&input, &mut outcome);
    outcome
}

fn executes(sender: u32, seq: u64, since_ms: u64, task: Option<u32>) -> Arc<Broadcast> {
    let idle = Announcement::idle(SimTime(since_ms));
    let announcement = task.map_or(idle, |task| Announcement {
        state: TaskState::Executing,
        behavior: Some(BehaviorId(task)),
        task: Some(TaskId(task)),
        ..idle
    });
    let body = fixtures::heartbeat(&announcement);
    Arc::new(fixtures::broadcast(
        RobotId(sender),
        (1, seq),
        SimTime::ZERO,
        body,
    ))
}

/// u = r·λ^cost: with λ = 0.98/s, a cost of 10 s takes 18.3 % of the reward.
#[test]
fn utility_matches_hand_calculation() {
    assert!((libm::pow(DISCOUNT_PER_S, 10.0) - 0.817_07).abs() < 1e-5);
    let mut nearest = AllocatorRunner::<Nearest>::new(me(0, 2), &Default::default());
    let outcome = step(&mut nearest, 0, &choices(&[10.0, 20.0]), &[], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(0)));
    assert!((outcome.rows[0].utility - 0.817_07).abs() < 1e-5);
    // A unit in progress keeps its full reward for a minute at any distance; afterwards the cost counts.
    let far = choices(&[90.0, 20.0]);
    for tick in [1, 1199] {
        let outcome = step(&mut nearest, tick, &far, &[], &[]);
        assert_eq!(outcome.active, Some(BehaviorId(0)));
    }
    let outcome = step(&mut nearest, 1200, &far, &[], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(1)));
    assert_eq!(outcome.changes[0].reason, Reason::Reassigned);
    assert_eq!(outcome.changes[1].reason, Reason::Chosen);
}

/// Every allocator sends a heartbeat at once after a change, then every 1/ρ.
#[test]
fn heartbeats_follow_changes_at_once_and_then_each_period() {
    let mut nearest = AllocatorRunner::<Nearest>::new(me(0, 2), &Default::default());
    let sent_at: Vec<u64> = (0..45)
        .filter(|&tick| {
            let mut now = choices(&[10.0, 20.0]);
            now[0].applicable = tick < 7;
            let progressed = [TaskId(1)];
            let progressed = if tick == 30 { &progressed[..] } else { &[] };
            let announcements = step(&mut nearest, tick, &now, &[], progressed).announcements;
            let states: Vec<_> = announcements.iter().map(|sent| sent.state).collect();
            match tick {
                7 => assert_eq!(states, [TaskState::Released, TaskState::Executing]),
                30 => assert_eq!(announcements[0].progress, 1),
                _ => {}
            }
            !announcements.is_empty()
        })
        .collect();
    assert_eq!(sent_at, [0, 7, 27, 30]);
}

/// Without message loss, one executor is left two steps after a conflict: the one that began earlier, else the lower
/// rank.
#[test]
fn first_come_leaves_one_executor() {
    let mut low = AllocatorRunner::<FirstCome>::new(me(0, 2), &Default::default());
    let mut high = AllocatorRunner::<FirstCome>::new(me(2, 2), &Default::default());
    let both = choices(&[10.0, 20.0]);
    for robot in [&mut low, &mut high] {
        let outcome = step(robot, 0, &both, &[], &[]);
        assert_eq!(outcome.active, Some(BehaviorId(0)));
    }
    let outcome = step(&mut low, 1, &both, &[executes(2, 1, 0, Some(0))], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(0)));
    let outcome = step(&mut high, 1, &both, &[executes(0, 1, 0, Some(0))], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(1)));
    assert_eq!(outcome.changes[0].reason, Reason::Outbid);

    // The robot of lower rank falls silent: its task is free after τ, exact to the step.
    let first_only = choices(&[10.0]);
    let mut idle = AllocatorRunner::<FirstCome>::new(me(2, 1), &Default::default());
    let outcome = step(
        &mut idle,
        1,
        &first_only,
        &[executes(0, 1, 0, Some(0))],
        &[],
    );
    assert_eq!(outcome.active, None);
    assert_eq!(step(&mut idle, 100, &first_only, &[], &[]).active, None);
    let outcome = step(&mut idle, 101, &first_only, &[], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(0)));
    assert_eq!(outcome.changes[0].reason, Reason::Claimed);
    // A late older heartbeat has no effect, and a newer one frees the task at once.
    let mut late = AllocatorRunner::<FirstCome>::new(me(2, 1), &Default::default());
    let heartbeats = [executes(0, 5, 0, None), executes(0, 4, 0, Some(0))];
    let outcome = step(&mut late, 1, &first_only, &heartbeats, &[]);
    assert_eq!(outcome.active, Some(BehaviorId(0)));
}

#[test]
fn a_static_robot_performs_only_its_assigned_tasks() {
    let mut fixed = AllocatorRunner::<Fixed>::new(me(0, 3), &Default::default());
    let all = choices(&[1.0, 50.0, 1.0]);
    assert_eq!(
        step(&mut fixed, 0, &all, &[], &[]).active,
        Some(BehaviorId(1))
    );
    let mut without = all.clone();
    without[1].applicable = false;
    assert_eq!(step(&mut fixed, 1, &without, &[], &[]).active, None);
}

/// In 10,000 draws each of three tasks gets a third: χ² is below 13.8, the 99.9 % point for two degrees of freedom.
#[test]
fn random_draws_evenly() {
    let config = random::Config { redraw_s: 0.05 };
    let mut random = AllocatorRunner::<Random>::new(me(0, 3), &config);
    let mut counts = [0_f64; 3];
    for tick in 0..10_000 {
        let active = step(&mut random, tick, &choices(&[1.0, 2.0, 3.0]), &[], &[]).active;
        counts[active.unwrap().index()] += 1.0;
    }
    let expected = 10_000.0 / 3.0;
    let chi_squared: f64 = counts
        .iter()
        .map(|count| (count - expected).powi(2) / expected)
        .sum();
    assert!(chi_squared < 13.8, "{counts:?}");
}

/// Received broadcasts do not affect the draws.
#[test]
fn received_broadcasts_do_not_change_random_draws() {
    let draws = |received: &dyn Fn(u64) -> Vec<Arc<Broadcast>>| -> Vec<_> {
        let config = random::Config { redraw_s: 0.05 };
        let mut random = AllocatorRunner::<Random>::new(me(0, 3), &config);
        let three = choices(&[1.0, 2.0, 3.0]);
        let active = |tick| step(&mut random, tick, &three, &received(tick), &[]).active;
        (0..1_000).map(active).collect()
    };
    let alone = draws(&|_| Vec::new());
    let executing = |tick| vec![executes(2, tick + 1, tick, Some((tick % 3) as u32))];
    assert_eq!(draws(&executing), alone);
}

proptest! {
    /// The first round has the least cost of all permutations.
    #[test]
    fn static_assignment_has_the_least_cost(
        costs in prop::collection::vec(prop::collection::vec(1..1000_i64, 4), 4),
    ) {
        let rows: Vec<Vec<Option<i64>>> = costs
            .iter()
            .map(|row| row.iter().copied().map(Some).collect())
            .collect();
        let assigned = assignment::assign(&rows, &[]);
        let total: i64 = assigned.iter().zip(&costs).map(|(tasks, row)| row[tasks[0].index()]).sum();
        let mut least = i64::MAX;
        for code in 0..256_usize {
            let tasks = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 & 3];
            let distinct = tasks.iter().collect::<std::collections::BTreeSet<_>>();
            if distinct.len() == 4 {
                least = least.min(tasks.iter().zip(&costs).map(|(task, row)| row[*task]).sum());
            }
        }
        prop_assert_eq!(total, least);
    }

    /// Every feasible task is assigned once, to a robot able to do it, for any numbers of robots and tasks.
    #[test]
    fn static_assignment_assigns_every_feasible_task_once(
        costs in (1..5_usize, 1..9_usize).prop_flat_map(|(robots, tasks)| {
            let cell = prop::option::weighted(0.7, 1..1000_i64);
            prop::collection::vec(prop::collection::vec(cell, tasks), robots)
        }),
    ) {
        let coalition: Vec<TaskId> = (0..3).filter(|task| *task < costs[0].len() as u32).map(TaskId).collect();
        let assigned = assignment::assign(&costs, std::slice::from_ref(&coalition));
        for own in &assigned {
            let together = own.iter().filter(|task| coalition.contains(task));
            prop_assert!(together.count() <= 1, "a robot has two tasks of a coalition");
        }
        for task in coalition.len()..costs[0].len() {
            let owners: Vec<usize> = (0..costs.len())
                .filter(|&robot| assigned[robot].contains(&TaskId(task as u32)))
                .collect();
            let can_be_done = costs.iter().any(|row| row[task].is_some());
            prop_assert_eq!(owners.len(), usize::from(can_be_done));
            prop_assert!(owners.iter().all(|&robot| costs[robot][task].is_some()));
        }
    }
}

#[test]
fn an_unknown_allocator_gives_a_message_of_one_line() {
    let mut setup = default_setup(1);
    setup.scenario.allocator = Some("telepathy".to_owned());
    let registry = AgentRegistry::built_in();
    let error = TeamConfig::new(&setup, &registry).unwrap_err();
    let known = registry.vocabulary().allocators;
    let known: Vec<&str> = known.iter().map(|allocator| allocator.name).collect();
    let names = known.join(", ");
    assert_eq!(
        error.to_string(),
        format!("allocators.telepathy: there is no such allocator; there are {names}")
    );
}

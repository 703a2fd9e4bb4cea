//! Tests of the laws for all allocators (docs/ALLOCATORS.md, "The laws") and of the baselines.

use scenario::testkit::default_setup;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use proptest::prelude::*;
use proto::allocation::{AllocationMessage, OpenMessage};
use proto::mission::SharedKnowledge;
use proto::team::{Broadcast, BroadcastContent, Heartbeat, TaskState};
use proto::telemetry::Reason;
use scenario::ids::{BehaviorId, RobotId, TaskId};
use scenario::time::SimTime;

use super::utility::DISCOUNT_PER_S;
use super::{
    Allocator, AllocatorRunner, Choice, Input, OwnBehavior, RandomDraws, RunningAllocator,
    SelfState, StepOutcome, TaskBrief, assignment,
};
use crate::agent::TeamConfig;
use crate::allocators::first_come::FirstCome;
use crate::allocators::nearest::{Nearest, NearestSilent};
use crate::allocators::random::{self, Random};
use crate::allocators::static_assignment::Fixed;
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

/// An allocator that keeps a behavior that is not applicable.
#[test]
#[should_panic(expected = "not applicable")]
fn the_testkit_finds_a_choice_that_is_not_applicable() {
    #[derive(Clone, Debug)]
    struct Stubborn(BehaviorId);
    impl Allocator for Stubborn {
        type Config = ();
        fn new(me: &SelfState, (): &()) -> Self {
            Self(me.behaviors[0].id)
        }
        fn step(&mut self, _: &Input<'_>, decision: &mut super::Decision) {
            decision.active = Some(self.0);
        }
    }
    testkit::check_allocator::<Stubborn>(&());
}

/// An allocator that counts messages, so that a copy has an effect.
#[test]
#[should_panic(expected = "a second copy changes nothing")]
fn the_testkit_finds_an_effect_of_copies() {
    #[derive(Clone, Debug)]
    struct Counts(usize);
    impl Allocator for Counts {
        type Config = ();
        fn new(_: &SelfState, (): &()) -> Self {
            Self(0)
        }
        fn step(&mut self, input: &Input<'_>, decision: &mut super::Decision) {
            self.0 += input.received.len();
            let mut applicable = input.choices.iter().filter(|choice| choice.applicable);
            decision.active = (self.0 % 3 == 1)
                .then(|| applicable.next().map(|choice| choice.behavior))
                .flatten();
        }
    }
    testkit::check_allocator::<Counts>(&());
}

/// An allocator with state outside its value.
#[test]
#[should_panic(expected = "G1, the same inputs give the same decisions")]
fn the_testkit_finds_state_in_a_static() {
    static SEEN: AtomicU32 = AtomicU32::new(0);
    #[derive(Clone, Debug)]
    struct UsesStatic;
    impl Allocator for UsesStatic {
        type Config = ();
        fn new(_: &SelfState, (): &()) -> Self {
            Self
        }
        fn step(&mut self, input: &Input<'_>, decision: &mut super::Decision) {
            // All instances share the largest step so far.
            SEEN.fetch_max((input.now.0 / 50) as u32, Relaxed);
            let mut applicable = input.choices.iter().filter(|choice| choice.applicable);
            decision.active = (SEEN.load(Relaxed) > 300)
                .then(|| applicable.next().map(|choice| choice.behavior))
                .flatten();
        }
    }
    testkit::check_allocator::<UsesStatic>(&());
}

#[test]
#[should_panic(expected = "a step that does not count leaves no trace")]
fn the_testkit_finds_state_that_clones_share() {
    #[derive(Clone, Debug)]
    struct Shares(Arc<AtomicU32>);
    impl Allocator for Shares {
        type Config = ();
        fn new(_: &SelfState, (): &()) -> Self {
            Self(Arc::default())
        }
        fn step(&mut self, input: &Input<'_>, decision: &mut super::Decision) {
            let steps = self.0.fetch_add(1, Relaxed);
            let mut applicable = input.choices.iter().filter(|choice| choice.applicable);
            decision.active = (steps % 3 == 1)
                .then(|| applicable.next().map(|choice| choice.behavior))
                .flatten();
        }
    }
    testkit::check_allocator::<Shares>(&());
}

/// An allocator that does not validate messages under its own schema.
#[test]
#[should_panic(expected = "G3, no message makes it panic")]
fn the_testkit_finds_a_panic_on_a_malformed_message() {
    #[derive(Clone, Debug)]
    struct Trusts;
    impl Allocator for Trusts {
        type Config = ();
        fn new(_: &SelfState, (): &()) -> Self {
            Self
        }
        fn step(&mut self, input: &Input<'_>, decision: &mut super::Decision) {
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
        }
    }
    testkit::check_allocator::<Trusts>(&());
}

fn me(robot: u16, tasks: u16) -> SelfState {
    SelfState {
        robot: RobotId(robot),
        incarnation: 1,
        team: 3,
        tasks: usize::from(tasks),
        briefs: (0..tasks)
            .map(|_| TaskBrief {
                max_robots: 1,
                priority: 0,
                unit_s: 10.0,
                robots: (0..3).map(RobotId).collect(),
            })
            .collect(),
        behaviors: (0..tasks)
            .map(|task| OwnBehavior {
                id: BehaviorId(task),
                task: TaskId(task),
                max_robots: 1,
                priority: 0,
            })
            .collect(),
        step_s: 0.05,
        heartbeat_period: SimTime(1000),
        ceased_after: SimTime(5000),
        assigned: [TaskId(1)].into(),
    }
}

fn choices(costs: &[f64]) -> Vec<Choice> {
    let choice = |(task, &cost_s): (usize, &f64)| Choice {
        behavior: BehaviorId(task as u16),
        task: TaskId(task as u16),
        round: SimTime::ZERO,
        applicable: true,
        cost_s: Some(cost_s),
        reward: 1.0,
        priority: 0,
        max_robots: 1,
    };
    costs.iter().enumerate().map(choice).collect()
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
        now: SimTime(50 * tick),
        step_s: 0.05,
        position: None,
        is_laden: false,
        applicable: &applicable,
        choices,
        progressed,
        received,
        seconds: &|_, _| None,
        ground_truth: &[],
        draws: RandomDraws::new(7, RobotId(0), tick),
    };
    allocator.step(&input, &mut outcome);
    outcome
}

fn executes(sender: u16, seq: u64, since_ms: u64, task: Option<u16>) -> Arc<Broadcast> {
    Arc::new(Broadcast {
        sender: RobotId(sender),
        incarnation: 1,
        tick: 0,
        index: 0,
        seq,
        sent: SimTime::ZERO,
        body: BroadcastContent::Heartbeat(Heartbeat {
            state: if task.is_some() {
                TaskState::Executing
            } else {
                TaskState::Idle
            },
            since: SimTime(since_ms),
            set: task.map(BehaviorId),
            task: task.map(TaskId),
            progress: 0,
            position: None,
            carrying: false,
            shared_knowledge: SharedKnowledge::default(),
        }),
    })
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
    assert_eq!(
        step(&mut nearest, 1, &far, &[], &[]).active,
        Some(BehaviorId(0))
    );
    assert_eq!(
        step(&mut nearest, 1199, &far, &[], &[]).active,
        Some(BehaviorId(0))
    );
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
            let states: Vec<_> = announcements
                .iter()
                .map(|announcement| announcement.state)
                .collect();
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
    assert_eq!(
        step(&mut low, 0, &both, &[], &[]).active,
        Some(BehaviorId(0))
    );
    assert_eq!(
        step(&mut high, 0, &both, &[], &[]).active,
        Some(BehaviorId(0))
    );
    let outcome = step(&mut low, 1, &both, &[executes(2, 1, 0, Some(0))], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(0)));
    let outcome = step(&mut high, 1, &both, &[executes(0, 1, 0, Some(0))], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(1)));
    assert_eq!(outcome.changes[0].reason, Reason::Outbid);

    // The robot of lower rank falls silent: its task is free after τ, exact to the step.
    let first_only = choices(&[10.0]);
    let mut idle = AllocatorRunner::<FirstCome>::new(me(2, 1), &Default::default());
    assert_eq!(
        step(
            &mut idle,
            1,
            &first_only,
            &[executes(0, 1, 0, Some(0))],
            &[]
        )
        .active,
        None
    );
    assert_eq!(step(&mut idle, 100, &first_only, &[], &[]).active, None);
    let outcome = step(&mut idle, 101, &first_only, &[], &[]);
    assert_eq!(outcome.active, Some(BehaviorId(0)));
    assert_eq!(outcome.changes[0].reason, Reason::Claimed);
    // A late older heartbeat has no effect, and a newer one frees the task at once.
    let mut late = AllocatorRunner::<FirstCome>::new(me(2, 1), &Default::default());
    let heartbeats = [executes(0, 5, 0, None), executes(0, 4, 0, Some(0))];
    assert_eq!(
        step(&mut late, 1, &first_only, &heartbeats, &[]).active,
        Some(BehaviorId(0))
    );
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
    let executing = |tick| vec![executes(2, tick + 1, tick, Some((tick % 3) as u16))];
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
        let assigned = assignment::assign(&rows);
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
        let assigned = assignment::assign(&costs);
        for task in 0..costs[0].len() {
            let owners: Vec<usize> = (0..costs.len())
                .filter(|&robot| assigned[robot].contains(&TaskId(task as u16)))
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

//! The laws L1 to L6 of ALLOCATORS.md §3.

use alliance_proto::telemetry::{BehaviorState, Reason};
use proptest::prelude::*;
use proptest::strategy::Strategy as _;

use super::super::config::Strategy;
use super::super::monitor::Monitor;
use super::super::rates::{Category, Knowledge, PATIENCE_CAP, rates};
use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

const MU: usize = 7;

/// Robot 0 makes μ trials of that length and goes on to make one each `next`, or none. When robot 1 is at θ after the μ-th, if ever
/// within ten of them.
fn at_threshold(length: SimTime, next: Option<SimTime>) -> Option<SimTime> {
    let unit_s = length.as_secs_f64() / 2.0;
    // At θ it shall activate at once, whatever others claim.
    let switches = Switches {
        waiting: false,
        arbitration: false,
        ..Preset::Team.switches()
    };
    let mut solo = Solo::new(&me(1, 2, &[unit_s]), &Config::default(), switches);
    let learned = SimTime(length.0 * MU as u64);
    let end = learned + SimTime(10 * length.0);
    let mut progress = 0;
    let mut due = length;
    while solo.now < end {
        let is_done = solo.now == due;
        if is_done {
            progress += 1;
            due = match next {
                _ if progress < MU as u32 => due + length,
                Some(next) => due + next,
                None => SimTime(u64::MAX),
            };
        }
        let speaks = is_done || solo.now.0.is_multiple_of(1000);
        let word = speaks.then(|| solo.word(0, (Executing, Some(0), progress)));
        let heard: Vec<_> = word.into_iter().collect();
        // The task falls due for robot 1 with the last lesson.
        let is_due = solo.now >= learned;
        solo.step(&[is_due], &heard, &[]);
        if solo.active().is_some() {
            return Some(solo.now - STEP - learned);
        }
    }
    None
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// L1: whoever talks and achieves nothing is taken over d after its first word, and whoever achieves something every d - 2δt never.
    #[test]
    fn patience_lasts_as_long_as_a_trial(steps in 60..400_u64) {
        let length = SimTime(steps * STEP.0);
        prop_assert_eq!(at_threshold(length, None), Some(length));
        prop_assert_eq!(at_threshold(length, Some(length - STEP - STEP)), None);
    }
}

/// Something that a teammate says: state, task, progress, by how many steps its time is wrong, whether it begins a new incarnation.
fn act() -> impl proptest::strategy::Strategy<Value = (Word, i64, bool)> {
    let state = prop::sample::select(vec![
        Executing, Executing, Executing, Waiting, Released, Idle,
    ]);
    let word = (state, 0..3_u16, prop_oneof![0..6_u32, Just(u32::MAX)]);
    let wrong = prop_oneof![4 => Just(0_i64), 1 => -200..200_i64];
    (word, wrong, prop::bool::weighted(0.05)).prop_map(|((state, task, progress), wrong, new)| {
        let task = (state != Idle).then_some(task);
        ((state, task, progress), wrong, new)
    })
}

fn strategies() -> impl proptest::strategy::Strategy<Value = (Strategy, Ordering)> {
    let strategy = prop::sample::select(STRATEGIES.to_vec());
    (strategy, prop::sample::select(ORDERINGS.to_vec()))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    /// L2: 0 < δ_slow < δ_fast, ψ > 0 and φ is capped, whatever was heard. L3: delays lie within their limits before they are clamped.
    #[test]
    fn rates_are_sound_whatever_was_heard(
        (strategy, ordering) in strategies(),
        acts in prop::collection::vec((1..3_u16, act(), 0..60_u64), 1..60),
        done in prop::collection::vec(0..3_u16, 0..3),
        units in prop::collection::vec(0.0..50.0_f64, 3),
    ) {
        let config = Config { strategy, ordering, ..Config::default() };
        let mut solo = Solo::new(&me(0, 3, &units), &config, Preset::Team.switches());
        let mut life = [1; 3];
        for (sender, (word, wrong, new), rest) in acts {
            let life = &mut life[usize::from(sender)];
            *life += u32::from(new);
            solo.seq += 1;
            let sent = SimTime(solo.now.0.saturating_add_signed(wrong * 100));
            let heard = says(sender, (*life, solo.seq), sent, word);
            solo.step(&[true; 3], &[heard], &done);
            for _ in 0..rest {
                solo.step(&[true; 3], &[], &[]);
            }
            for (task, lesson) in solo.learner.tasks.iter().zip(&solo.learner.lessons) {
                let mut list = Vec::new();
                let values = solo.learner.adaptive(*task, lesson, &mut list);
                let shortest_s = lesson.knowledge.shortest_s;
                let all = list.iter().map(|(_, toward)| *toward).chain([values.toward_most]);
                for toward in all {
                    prop_assert!(toward.slow > 0.0 && toward.slow < values.fast);
                    prop_assert!(values.fast.is_finite());
                    let most_s = PATIENCE_CAP * shortest_s + 1e-3;
                    prop_assert!(toward.phi.as_secs_f64() <= most_s);
                }
                prop_assert!(values.psi.0 > 0 && values.lambda >= values.psi);
                let delay_s = lesson.rates.delay_s;
                let limits_s = 2.0 - 1e-9..8.0 + 1e-9;
                prop_assert!(limits_s.contains(&delay_s), "{delay_s}");
            }
        }
    }

    /// Steps that the engine leaves out equal those that it makes, although its values change under it.
    #[test]
    fn steps_that_are_left_out_change_nothing(
        (strategy, ordering) in strategies(),
        acts in prop::collection::vec((1..3_u16, act(), 0..100_u64), 1..40),
    ) {
        let config = Config { strategy, ordering, ..Config::default() };
        let [mut solo, mut whole] = std::array::from_fn(|_| {
            Solo::new(&me(0, 3, &[3.0, 5.0, 8.0]), &config, Preset::Team.switches())
        });
        for (place, (sender, (word, _, is_done), rest)) in acts.into_iter().enumerate() {
            for step in 0..=rest {
                let heard = (step == 0).then(|| says(sender, (1, place as u64 + 1), solo.now, word));
                let heard: Vec<_> = heard.into_iter().collect();
                let done: Vec<u16> = solo.active().filter(|_| is_done && step == 0).into_iter().collect();
                whole.learner.engine.weigh_anew();
                solo.step(&[true; 3], &heard, &done);
                whole.step(&[true; 3], &heard, &done);
                prop_assert_eq!(&solo.outcome, &whole.outcome);
            }
        }
    }

    /// L3: of what the robot is best at the longer goes first, of the rest the shorter.
    #[test]
    fn longer_tasks_come_sooner_where_the_robot_is_best(
        one in 1.0..100.0_f64, more in 0.1..100.0_f64, low in 0.0..1.0_f64, high in 0.0..100.0_f64,
    ) {
        let delay_s = |own_s, category| {
            let knowledge = Knowledge { own_s, best_s: own_s, shortest_s: own_s, category };
            rates(&Config::default(), &knowledge, (low, one + more + high), 0.0).delay_s
        };
        let longer = one + more;
        prop_assert!(delay_s(longer, Category::Mine) < delay_s(one, Category::Mine));
        prop_assert!(delay_s(longer, Category::Others) > delay_s(one, Category::Others));
    }

    /// L4: with the same trials known to all, a task is at most one robot's.
    #[test]
    fn a_task_belongs_to_at_most_one_robot(
        trials in prop::collection::vec((0..4_u16, 0..3_u16, 1..5_u32), 0..40),
    ) {
        let mut minds: Vec<Solo> = (0..4)
            .map(|rank| Solo::new(&me(rank, 4, &[3.0; 3]), &Config::default(), Preset::Team.switches()))
            .collect();
        let mut owners = [0; 3];
        for solo in &mut minds {
            for &(robot, task, time_s) in &trials {
                let time_s = f64::from(time_s);
                solo.learner.monitor.store(RobotId(robot), TaskId(task), time_s);
            }
            let own = solo.learner.me.robot.0;
            let others = (0..4).filter(|&rank| rank != own);
            let heard: Vec<_> = others.map(|rank| solo.word(rank, (Idle, None, 0))).collect();
            solo.step(&[false; 3], &heard, &[]);
            for (count, lesson) in owners.iter_mut().zip(&solo.learner.lessons) {
                *count += u32::from(lesson.knowledge.category == Category::Mine);
            }
        }
        prop_assert_eq!(owners, [1; 3]);
    }

    /// L5: after μ new trials old ones have no weight.
    #[test]
    fn old_trials_are_forgotten(
        window in 1..12_usize,
        old in prop::collection::vec(0.1..100.0_f64, 0..30),
        new in prop::collection::vec(0.1..100.0_f64, 12),
    ) {
        let me = me(1, 2, &[10.0]);
        let time_s = |times: &[f64]| {
            let mut monitor = Monitor::new(&me, window, 2.0, false);
            for &time_s in times {
                monitor.store(RobotId(0), TaskId(0), time_s);
            }
            monitor.time_s(TaskId(0), RobotId(0))
        };
        let new = &new[..window];
        prop_assert_eq!(time_s(&[&old, new].concat()), time_s(new));
    }
}

/// For how long robot n is kept from the only task before it has had a stint that it ended itself, s, and the longest that it
/// believed to need itself meanwhile; gives up when that is more than `limit_s` of it. Before the task falls due for it, each teammate
/// does a unit in `unit_s`.
fn kept_away_s(
    config: &Config,
    preset: Preset,
    teammates: usize,
    unit_s: u64,
    limit_s: impl Fn(f64) -> f64,
    mut speak: impl FnMut(usize, SimTime) -> Option<(TaskState, bool)>,
) -> (f64, f64) {
    let rank = teammates as u16;
    let mut solo = Solo::new(&me(rank, teammates + 1, &[2.0]), config, preset.switches());
    let (mut away_s, mut own_s) = (0.0, 0.0_f64);
    let mut lives = vec![1; teammates];
    for second in 0..=unit_s {
        let word = (Executing, Some(0), u32::from(second == unit_s));
        let mut heard: Vec<_> = (0..rank).map(|mate| solo.word(mate, word)).collect();
        for _ in 0..1000 / STEP.0 {
            solo.step(&[false], &heard, &[]);
            heard.clear();
        }
    }
    while away_s <= limit_s(own_s) {
        let mut heard = Vec::new();
        for (sender, life) in lives.iter_mut().enumerate() {
            if let Some((state, is_new)) = speak(sender, solo.now) {
                *life += u32::from(is_new);
                solo.seq += 1;
                let task = (state != Idle).then_some(0);
                let sent = SimTime(solo.now.0.saturating_sub(STEP.0));
                heard.push(says(
                    sender as u16,
                    (*life, solo.seq),
                    sent,
                    (state, task, 0),
                ));
            }
        }
        solo.step(&[true], &heard, &[]);
        own_s = own_s.max(solo.learner.lessons[0].knowledge.own_s);
        let ended = [Reason::AcquiescedPsi, Reason::GaveUpLambda];
        if solo
            .outcome
            .changes
            .iter()
            .any(|it| ended.contains(&it.reason))
        {
            break;
        }
        if solo.outcome.motivations[0].state != BehaviorState::Active {
            away_s += STEP.as_secs_f64();
        }
    }
    (away_s, own_s)
}

/// What a teammate says again and again, and after how many steps it goes on: anything, or that it is at the task and nothing else.
fn script() -> impl proptest::strategy::Strategy<Value = Vec<(TaskState, bool, u64)>> {
    let word = (
        prop::sample::select(vec![Executing, Executing, Waiting, Released, Idle]),
        prop::bool::weighted(0.1),
        prop_oneof![Just(1_u64), 1_u64..8, 1_u64..120],
    );
    prop_oneof![
        2 => prop::collection::vec(word, 1..6),
        1 => Just(vec![(Executing, false, 8)]),
    ]
}

/// B of docs/BOUNDS.md, with the longest delay, boredom before each rise and the cap of φ, s.
fn bound_s(config: &Config, preset: Preset, teammates: usize, own_s: f64) -> f64 {
    let (n, step_s) = (teammates as f64, STEP.as_secs_f64());
    let waits = if preset == Preset::Team {
        n * (n + 1.0) / 2.0
    } else {
        0.0
    };
    let rise_s = config.max_delay_s + config.boredom_threshold / config.boredom_rate;
    (n + 1.0) * (rise_s + 2.0 * step_s)
        + n * (PATIENCE_CAP * own_s + step_s)
        + waits * (own_s + TAU.as_secs_f64() + step_s)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// L6: whatever teammates say without progress, and however many trials they fail, the bound holds.
    #[test]
    fn nobody_keeps_a_task_for_longer_than_the_bound(
        (strategy, ordering) in strategies(),
        preset in prop::sample::select(vec![Preset::Team, Preset::Par98]),
        teammates in prop::collection::vec(script(), 1..4),
        unit_s in prop_oneof![Just(0_u64), 1_u64..300],
    ) {
        let config = Config { strategy, ordering, ..Config::default() };
        let mut next = vec![(0_usize, 0_u64); teammates.len()];
        let bound_s = |own_s| bound_s(&config, preset, teammates.len(), own_s);
        let limit_s = |own_s| 2.0 * bound_s(own_s) + 100.0;
        let (away_s, own_s) = kept_away_s(&config, preset, teammates.len(), unit_s, limit_s, |rank, _| {
            let (place, resting) = &mut next[rank];
            if *resting > 0 {
                *resting -= 1;
                return None;
            }
            let (state, is_new, rests) = teammates[rank][*place];
            *place = (*place + 1) % teammates[rank].len();
            *resting = rests - 1;
            Some((state, is_new))
        });
        prop_assert!(away_s <= bound_s(own_s), "{away_s} of {} s", bound_s(own_s));
    }
}

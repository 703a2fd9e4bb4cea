//! The longest time for which teammates without progress can keep a robot from a task (docs/BOUNDS.md).

use proptest::prelude::*;

use super::*;

use TaskState::{Executing, Idle, Released, Waiting};

const STEP_MS: u64 = 200;
const PRESETS: [Preset; 3] = [Preset::Thesis, Preset::Par98, Preset::Team];

/// The parameters of the robot under test, equal toward all teammates.
#[derive(Clone, Copy, Debug)]
struct Values {
    fast: f64,
    slow: f64,
    tau_s: f64,
    phi_s: f64,
    psi_s: f64,
    lambda_s: f64,
}

const VALUES: Values = Values {
    fast: 5.0,
    slow: 1.0,
    tau_s: 1.6,
    phi_s: 3.0,
    psi_s: 4.0,
    lambda_s: 9.0,
};

fn setup_of(preset: Preset, teammates: usize, values: Values) -> Setup {
    let mut setup = setup(preset, teammates + 1, STEP_MS);
    setup.alliance.threshold = 10.0;
    every_set(&mut setup, |set| {
        set.broadcast_rate_hz = 2.0;
        set.fast_impatience = values.fast;
        set.ceased_after_s = values.tau_s;
        set.before_yielding_s = values.psi_s;
        set.before_giving_up_s = values.lambda_s;
        toward_all(set, values.slow, values.phi_s);
    });
    setup
}

/// Computes B of docs/BOUNDS.md, s.
fn bound_s(preset: Preset, teammates: usize, values: Values) -> f64 {
    let n = teammates as f64;
    let step_s = STEP_MS as f64 / 1000.0;
    let waits = match preset {
        Preset::Par98 => 0.0,
        Preset::Thesis => n,
        Preset::Team => n * (n + 1.0) / 2.0,
    };
    (n + 1.0) * (10.0 / values.fast + 2.0 * step_s)
        + n * (1.0 - values.slow / values.fast) * (values.phi_s + step_s)
        + waits * (values.psi_s + values.tau_s + step_s)
}

/// The broadcast of a teammate in one step, if any: the state and start time of the claim or wish.
type Message = Option<(TaskState, SimTime)>;

/// The state of the robot under test before a teammate sends. The robot has the highest rank.
#[derive(Clone, Copy, Debug)]
struct Situation {
    now: SimTime,
    state: BehaviorState,
    motivation: f64,
    /// The start time of that state.
    since: SimTime,
}

/// Returns the time, s, for which the robot is not active before it first ends a stint itself, by ψ or λ. Stops once
/// that time exceeds `limit_s`. `send` returns the message of each teammate; it increments the incarnation to simulate
/// a restart.
fn kept_away_s(
    setup: &Setup,
    limit_s: f64,
    mut send: impl FnMut(usize, &Situation, &mut u32) -> Message,
) -> f64 {
    let teammates = setup.scenario.robots.len() - 1;
    let mut robot = Solo::new(RobotId(teammates as u32), setup);
    let mut incarnations = vec![1; teammates];
    let mut situation = Situation {
        now: ms(0),
        state: BehaviorState::Hibernating,
        motivation: 0.0,
        since: ms(0),
    };
    let mut away_s = 0.0;
    while away_s <= limit_s {
        situation.now = robot.now;
        let mut received = Vec::new();
        for (rank, incarnation) in incarnations.iter_mut().enumerate() {
            if let Some((state, since)) = send(rank, &situation, incarnation) {
                let mut message = robot.message(RobotId(rank as u32), state, since);
                message.incarnation = *incarnation;
                received.push(message);
            }
        }
        let output = robot.step(ONLY_TOP, &received);
        let row = output.motivations[TOP];
        for change in &output.changes {
            situation.since = situation.now;
            if matches!(change.reason, Reason::AcquiescedPsi | Reason::GaveUpLambda) {
                return away_s;
            }
        }
        (situation.state, situation.motivation) = (row.state, row.motivation);
        if row.state != BehaviorState::Active {
            away_s += STEP_MS as f64 / 1000.0;
        }
    }
    away_s
}

fn every(period_ms: u64, situation: &Situation) -> bool {
    situation.now.0.is_multiple_of(period_ms)
}

#[test]
fn no_misbehavior_keeps_a_task_for_longer_than_the_bound() {
    type Misbehavior = fn(&Situation, &mut u32) -> Message;
    let all: [(&str, Misbehavior); 7] = [
        ("babbling: claims without end", |situation, _| {
            every(400, situation).then_some((Executing, ms(0)))
        }),
        ("babbling: wishes without end", |situation, _| {
            every(400, situation).then_some((Waiting, ms(0)))
        }),
        (
            "flapping: alternates claims and releases",
            |situation, _| {
                let state = if every(400, situation) {
                    Executing
                } else {
                    Released
                };
                // Claimed in the step in which the robot received the release and activated.
                Some((state, situation.now - ms(STEP_MS)))
            },
        ),
        (
            "flapping: silent for slightly longer than τ, with an old claim",
            |situation, _| every(2000, situation).then_some((Executing, ms(0))),
        ),
        (
            "flapping: a new incarnation with each message",
            |situation, incarnation| {
                *incarnation += 1;
                let state = if every(400, situation) {
                    Executing
                } else {
                    Idle
                };
                Some((state, situation.now - ms(STEP_MS)))
            },
        ),
        ("deaf: executes, rests, executes again", |situation, _| {
            let phase = situation.now.0 % 11_000;
            let state = if phase < 9_000 { Executing } else { Idle };
            every(400, situation).then_some((state, situation.now - ms(phase)))
        }),
        (
            "always claims at the same time as the robot, with a lower rank",
            |situation, _| {
                Some(if situation.state == BehaviorState::Active {
                    (Executing, situation.since)
                } else {
                    (Waiting, ms(0))
                })
            },
        ),
    ];
    for preset in PRESETS {
        let setup = setup_of(preset, 1, VALUES);
        let bound_s = bound_s(preset, 1, VALUES);
        for (name, misbehavior) in all {
            let away_s = kept_away_s(&setup, 2.0 * bound_s, |_, situation, incarnation| {
                misbehavior(situation, incarnation)
            });
            assert!(
                away_s <= bound_s,
                "{name}, {preset:?}: {away_s} of {bound_s} s"
            );
        }
    }
}

/// A babbling teammate starts when the robot is about to activate.
#[test]
fn the_bound_is_tight_within_a_few_steps() {
    for preset in PRESETS {
        let setup = setup_of(preset, 1, VALUES);
        let bound_s = bound_s(preset, 1, VALUES);
        let mut babbles = false;
        let away_s = kept_away_s(&setup, 2.0 * bound_s, |_, situation, _| {
            babbles |= situation.motivation > 8.5;
            babbles.then_some((Executing, ms(0)))
        });
        let steps = (bound_s - away_s) * 1000.0 / STEP_MS as f64;
        assert!(
            (0.0..6.0).contains(&steps),
            "{preset:?}: {away_s} of {bound_s} s"
        );
    }
}

prop_compose! {
    fn values()(
        fast in 1.0_f64..20.0,
        slow in 0.05_f64..0.95,
        tau_s in 0.6_f64..3.0,
        phi_s in 0.2_f64..8.0,
        psi_s in 0.2_f64..6.0,
        lambda_s in 0.2_f64..12.0,
    ) -> Values {
        Values { fast, slow: slow * fast, tau_s, phi_s, psi_s, lambda_s }
    }
}

/// An action of a misbehaving robot, followed by some silent steps.
#[derive(Clone, Copy, Debug)]
struct Action {
    state: TaskState,
    claim: Age,
    new_incarnation: bool,
    rests: u64,
}

#[derive(Clone, Copy, Debug)]
enum Age {
    Ancient,
    Fresh,
    /// As old as the current state of the robot under test.
    Tie,
}

prop_compose! {
    fn action()(
        state in prop::sample::select(vec![Executing, Executing, Waiting, Released, Idle]),
        claim in prop::sample::select(vec![Age::Ancient, Age::Fresh, Age::Tie]),
        new_incarnation in prop::bool::weighted(0.1),
        rests in prop_oneof![Just(1_u64), 1_u64..5, 1_u64..30],
    ) -> Action {
        Action { state, claim, new_incarnation, rests }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Each teammate repeats its actions without end and reports no progress.
    #[test]
    fn the_bound_holds_for_any_messages_without_progress(
        preset in prop::sample::select(PRESETS.to_vec()),
        values in values(),
        teammates in prop::collection::vec(prop::collection::vec(action(), 1..6), 1..4),
    ) {
        let setup = setup_of(preset, teammates.len(), values);
        let bound_s = bound_s(preset, teammates.len(), values);
        let mut next = vec![(0_usize, 0_u64); teammates.len()];
        let away_s = kept_away_s(&setup, 2.0 * bound_s, |rank, situation, incarnation| {
            let (place, resting) = &mut next[rank];
            if *resting > 0 {
                *resting -= 1;
                return None;
            }
            let action = teammates[rank][*place];
            *place = (*place + 1) % teammates[rank].len();
            *resting = action.rests - 1;
            *incarnation += u32::from(action.new_incarnation);
            let since = match action.claim {
                Age::Ancient => ms(0),
                Age::Fresh => situation.now - ms(STEP_MS),
                Age::Tie => situation.since,
            };
            Some((action.state, since))
        });
        prop_assert!(away_s <= bound_s, "{away_s} of {bound_s} s");
    }
}

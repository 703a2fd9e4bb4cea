//! Properties that hold for all messages, sensor readings and message losses.

use proptest::prelude::*;
use scenario::HistoryOrigin;

use super::*;

/// Creates a setup with short times, so that a few hundred steps of 200 ms contain many changes: θ after 2 s.
fn brisk(preset: Preset, count: usize) -> Setup {
    let mut setup = setup(preset, count, 200);
    setup.alliance.threshold = 10.0;
    every_set(&mut setup, |set| {
        set.broadcast_rate_hz = 2.0;
        set.ceased_after_s = 1.5;
        toward_all(set, 1.0, 3.0);
        set.before_yielding_s = 4.0;
        set.before_giving_up_s = 9.0;
    });
    setup
}

prop_compose! {
    fn switches()(
        flags in prop::array::uniform7(any::<bool>()),
        literal in any::<bool>(),
        preset in prop::sample::select(vec![Preset::Thesis, Preset::Par98, Preset::Team]),
        as_preset in any::<bool>(),
    ) -> Switches {
        if as_preset {
            return preset.switches();
        }
        let [waiting, waiting_counts, wish_when_suppressed, reset_stops_active, arbitration, release_message, idle_heartbeat] =
            flags;
        Switches {
            waiting,
            waiting_counts,
            wish_when_suppressed,
            reset_stops_active,
            history_origin: if literal { HistoryOrigin::MissionStart } else { HistoryOrigin::Progress },
            arbitration,
            release_message,
            idle_heartbeat,
        }
    }
}

prop_compose! {
    /// Generates any message of a teammate or other sender: any state, task, age, incarnation and order.
    fn message()(
        sender in 0_u32..5,
        incarnation in 1_u32..4,
        seq in 0_u64..400,
        state in prop::sample::select(vec![
            TaskState::Executing,
            TaskState::Waiting,
            TaskState::Idle,
            TaskState::Released,
        ]),
        since in 0_u64..60_000,
        task in prop::option::weighted(0.9, 0_u32..6),
        progress in 0_u32..5,
    ) -> Broadcast {
        let mut message = broadcast(RobotId(sender), seq, ms(since), &Announcement {
            state,
            since: ms(since),
            behavior: None,
            task: task.map(TaskId),
            progress,
        });
        message.incarnation = incarnation;
        message
    }
}

#[derive(Clone, Debug)]
struct Step {
    received: Vec<Broadcast>,
    applicable: [bool; 4],
    progressed: Vec<TaskId>,
}

impl Step {
    fn make(&self, engine: &mut Engine, number: u64) -> StepOutcome {
        let now = ms(200 * number);
        step_of(
            engine,
            now,
            &self.received,
            &self.applicable,
            &self.progressed,
        )
    }
}

prop_compose! {
    fn step()(
        received in prop::collection::vec(message(), 0..3),
        sends in prop::bool::weighted(0.3),
        applicable in prop::array::uniform4(prop::bool::weighted(0.97)),
        progressed in prop::collection::vec((0_u32..4).prop_map(TaskId), 0..2),
    ) -> Step {
        Step { received: if sends { received } else { Vec::new() }, applicable, progressed }
    }
}

prop_compose! {
    /// Generates steps of which most are empty.
    fn calm_step()(
        step in step(),
        received in prop::bool::weighted(0.15),
        applicable in prop::bool::weighted(0.05),
        progressed in prop::bool::weighted(0.05),
    ) -> Step {
        Step {
            received: if received { step.received } else { Vec::new() },
            applicable: if applicable { step.applicable } else { [true; 4] },
            progressed: if progressed { step.progressed } else { Vec::new() },
        }
    }
}

/// A number of silent steps, then a teammate's report about a task.
type Report = (usize, RobotId, TaskState, usize);

/// Generates mostly claims to move(top), often enough to cause waiting.
fn report() -> impl Strategy<Value = Report> {
    let state = prop_oneof![
        12 => Just(TaskState::Executing),
        2 => Just(TaskState::Waiting),
        1 => Just(TaskState::Idle),
        1 => Just(TaskState::Released),
    ];
    let task = prop_oneof![9 => Just(TOP), 1 => Just(BOTTOM)];
    (
        0..9_usize,
        prop_oneof![5 => Just(BLUE), 1 => Just(GREEN)],
        state,
        task,
    )
}

/// Returns the steps of a robot that can only do move(top) and receives the reports.
fn steps_of(reports: &[Report]) -> Vec<Step> {
    let mut steps = Vec::new();
    for (seq, &(silent, sender, state, task)) in (0..).zip(reports) {
        let step = Step {
            received: Vec::new(),
            applicable: ONLY_TOP,
            progressed: Vec::new(),
        };
        steps.extend(std::iter::repeat_n(step.clone(), silent));
        let announcement = Announcement {
            state,
            since: ms(0),
            behavior: None,
            task: Some(self::task(task)),
            progress: 0,
        };
        steps.push(Step {
            received: vec![broadcast(sender, seq, ms(0), &announcement)],
            ..step
        });
    }
    steps
}

/// Compares an engine that may skip steps with one that evaluates every step.
fn compare_with_full_evaluation(switches: Switches, steps: &[Step]) -> Result<(), TestCaseError> {
    let mut setup = brisk(Preset::Team, 3);
    setup.alliance.switches = switches;
    let mut engines = [engine(GOLD, &setup), engine(GOLD, &setup)];
    for (number, step) in (0..).zip(steps) {
        engines[0].weigh_anew();
        let [evaluated, skipped] = engines.each_mut().map(|engine| step.make(engine, number));
        prop_assert_eq!(evaluated, skipped, "at step {}", number);
    }
    Ok(())
}

/// Returns whether the reason is one of the zero factors of the row.
fn is_named(reason: Reason, row: &proto::telemetry::Motivation) -> bool {
    match reason {
        Reason::NotApplicable => !row.sensory_feedback,
        Reason::Suppressed => !row.activity_suppression,
        Reason::ResetBy(_) => !row.impatience_reset,
        Reason::AcquiescedPsi | Reason::GaveUpLambda => !row.acquiescence,
        _ => false,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn each_step_matches_its_row(
        switches in switches(),
        steps in prop::collection::vec(step(), 1..300),
    ) {
        let mut setup = brisk(Preset::Team, 3);
        setup.alliance.switches = switches;
        let mut engine = engine(GOLD, &setup);
        let mut before = [0.0; 4];
        let mut states = [BehaviorState::Hibernating; 4];
        for (number, step) in (0..).zip(&steps) {
            let output = step.make(&mut engine, number);
            let active = output.motivations.iter().filter(|row| row.state == BehaviorState::Active);
            prop_assert!(active.count() <= 1);
            for (index, row) in output.motivations.iter().enumerate() {
                let factors = [
                    row.sensory_feedback,
                    row.activity_suppression,
                    row.impatience_reset,
                    row.acquiescence,
                ];
                let gain = if number == 0 { 0.0 } else { row.impatience * 0.2 };
                let expected = if factors.contains(&false) {
                    0.0
                } else {
                    f64::min(10.0, before[index] + gain)
                };
                prop_assert_eq!(row.motivation, expected);
                prop_assert!((0.0..=10.0).contains(&row.motivation));
                prop_assert!(row.state == BehaviorState::Hibernating || row.motivation == 10.0);
                prop_assert_eq!(row.sensory_feedback, step.applicable[index]);
                prop_assert!([1.0, 5.0].contains(&row.impatience));

                let changes: Vec<_> = output.changes.iter().filter(|change| change.set == row.set).collect();
                prop_assert!(changes.len() <= 1);
                if let Some(change) = changes.first() {
                    prop_assert_eq!(change.from, states[index]);
                    prop_assert_ne!(change.from, change.to);
                    prop_assert!(
                        change.to != BehaviorState::Hibernating || is_named(change.reason, row)
                    );
                }
                let state = changes.first().map_or(states[index], |change| change.to);
                prop_assert_eq!(row.state, state);
                before[index] = row.motivation;
                states[index] = state;
            }
            check_announcements(&switches, &output, &states);
        }
    }

    /// An engine that skips steps gives the same outputs as one that evaluates every step.
    #[test]
    fn skipped_steps_change_nothing(
        switches in switches(),
        steps in prop::collection::vec(calm_step(), 50..400),
    ) {
        compare_with_full_evaluation(switches, &steps)?;
    }

    /// The same holds for a robot whose only applicable task is occupied by teammates.
    #[test]
    fn skipped_steps_of_a_waiting_robot_change_nothing(
        switches in switches(),
        reports in prop::collection::vec(report(), 50..150),
    ) {
        let steps = steps_of(&reports);
        compare_with_full_evaluation(switches, &steps)?;
    }

    /// Two robots execute an exclusive task. The later one leaves it in the step that receives the other's claim,
    /// unless it activated because its waiting bound passed.
    #[test]
    fn a_received_claim_decides_despite_message_loss(losses in losses()) {
        let mut team = Team::new(&brisk(Preset::Team, 3));
        // The start time of each robot on move(top), and whether its waiting bound had passed.
        let mut claims = [None; 3];
        for (links, progress) in losses {
            let received = team.inboxes.clone();
            let now = team.now;
            let outputs = lossy_step(&mut team, links, progress);
            for (rank, output) in outputs.iter().enumerate() {
                let me = RobotId(rank as u32);
                let was = claims[rank];
                for change in &output.changes {
                    claims[rank] = (change.to == BehaviorState::Active)
                        .then_some((now, change.reason == Reason::WaitBound));
                }
                let Some((since, waited_out)) = was else { continue };
                for message in &received[rank] {
                    let BroadcastContent::Heartbeat(other) = &message.body else { continue };
                    let beaten = other.state == TaskState::Executing
                        && (other.since, message.sender) < (since, me)
                        && !waited_out;
                    let contradicted = received[rank].iter().any(|later| {
                        later.sender == message.sender && later.seq > message.seq
                    });
                    prop_assert!(!beaten || contradicted || claims[rank] != was);
                }
            }
        }
    }

    /// With par98, no robot executes an exclusive task for longer than ψ while it receives the other's claim within τ.
    /// A robot without received claims stops after λ.
    #[test]
    fn psi_and_lambda_end_double_execution_despite_message_loss(losses in losses()) {
        let setup = brisk(Preset::Par98, 3);
        let mut team = Team::new(&setup);
        let mut since = [None; 3];
        let mut last_received = [None; 3];
        for (links, progress) in losses {
            let now = team.now;
            for (received, inbox) in last_received.iter_mut().zip(&team.inboxes) {
                if !inbox.is_empty() {
                    *received = Some(now);
                }
            }
            let outputs = lossy_step(&mut team, links, progress);
            for (rank, output) in outputs.iter().enumerate() {
                let is_active = output.motivations[TOP].state == BehaviorState::Active;
                since[rank] = is_active.then_some(since[rank].unwrap_or(now));
                let Some(since) = since[rank] else { continue };
                let receives = last_received[rank].is_some_and(|received| now.since(received) < ms(1500));
                prop_assert!(!receives || now.since(since) <= ms(4000));
                prop_assert!(now.since(since) <= ms(9000));
            }
        }
    }

    /// The memory is bounded by teammates times tasks for missions of any length and content.
    #[test]
    fn memory_is_bounded_by_robots_times_tasks(
        switches in switches(),
        steps in prop::collection::vec(step(), 1..300),
    ) {
        let mut setup = brisk(Preset::Team, 3);
        setup.alliance.switches = switches;
        let mut engine = engine(GOLD, &setup);
        for (number, step) in (0..).zip(&steps) {
            step.make(&mut engine, number);
        }
        let printed = format!("{engine:?}");
        let (teammates, tasks) = (2, 4);
        // The bounds are one claim per teammate, and one wish or history record per teammate and task.
        prop_assert!(printed.matches("first:").count() <= teammates * tasks);
        prop_assert!(printed.matches("received:").count() <= teammates * (tasks + 1));
        prop_assert!(printed.matches("RobotId").count() <= 100);
    }
}

prop_compose! {
    /// Generates the steps of a team of three: the links that deliver, by sender and receiver, and whether blue makes
    /// progress.
    fn losses()(
        steps in prop::collection::vec(
            (prop::array::uniform9(prop::bool::weighted(0.6)), prop::bool::weighted(0.02)),
            1..400,
        ),
    ) -> Vec<([bool; 9], bool)> {
        steps
    }
}

fn lossy_step(team: &mut Team, links: [bool; 9], progress: bool) -> Vec<StepOutcome> {
    team.link = Box::new(move |from, to| links[3 * from.index() + to.index()]);
    let progressed = progress.then_some((BLUE, task(TOP)));
    team.step_with(&[ONLY_TOP; 3], progressed.as_slice())
}

/// Checks that announcements match the states, and that an executing set is announced last.
fn check_announcements(switches: &Switches, output: &StepOutcome, states: &[BehaviorState; 4]) {
    for (place, announcement) in output.announcements.iter().enumerate() {
        let index = announcement.behavior.map(|id| id.index() - 1);
        let state = index.map(|index| states[index]);
        match announcement.state {
            TaskState::Executing => {
                assert_eq!(state, Some(BehaviorState::Active));
                assert_eq!(place + 1, output.announcements.len());
            }
            TaskState::Waiting => assert_eq!(state, Some(BehaviorState::Waiting)),
            TaskState::Released => {
                assert!(switches.release_message);
                assert_eq!(state, Some(BehaviorState::Hibernating));
            }
            TaskState::Idle => {
                assert!(switches.idle_heartbeat);
                assert_eq!(*states, [BehaviorState::Hibernating; 4]);
            }
        }
    }
}

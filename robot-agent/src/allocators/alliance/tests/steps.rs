//! The order inside one robot's step, and what a step is.

use super::*;

/// Robots whose sets reach θ at different times: top after 20 s, bottom after 25 s.
fn staggered(step_ms: u64) -> Setup {
    let mut setup = setup(Preset::Team, 2, step_ms);
    for robot in setup.alliance.robots.values_mut() {
        robot.sets.get_mut("move(bottom)").unwrap().fast_impatience = 4.0;
    }
    setup
}

fn motivations(output: &Outcome) -> Vec<f64> {
    output.motivations.iter().map(|it| it.motivation).collect()
}

#[test]
fn first_step_of_a_life_adds_nothing() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    gold.now = ms(77_000);
    assert_eq!(motivations(&gold.step(ALL, &[])), [0.0; 4]);
    assert_eq!(motivations(&gold.step(ALL, &[])), [1.0; 4]);
}

#[test]
fn a_stopped_robot_gains_one_step_length() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(400), ALL);
    gold.now = ms(300_000);
    assert_eq!(motivations(&gold.step(ALL, &[])), [2.0; 4]);
}

#[test]
fn activation_suppresses_the_others_from_the_next_step_on() {
    let both = [false, true, true, false];
    let mut gold = Solo::new(GOLD, &staggered(200));
    gold.quiet_until(ms(20_000), both);
    let output = gold.step(both, &[]);
    assert_eq!(gold.engine.active(), Some(set(TOP)));
    assert_eq!(output.motivations[TOP].state, BehaviorState::Active);
    assert!(output.motivations[BOTTOM].activity_suppression);
    assert!((output.motivations[BOTTOM].motivation - 80.0).abs() < 1e-9);

    let output = gold.step(both, &[]);
    assert!(output.motivations[TOP].activity_suppression);
    assert_eq!(output.motivations[TOP].motivation, 100.0);
    assert!(!output.motivations[BOTTOM].activity_suppression);
    assert_eq!(output.motivations[BOTTOM].motivation, 0.0);
}

#[test]
fn hibernation_frees_the_others_in_the_same_step() {
    let both = [false, true, true, false];
    let mut gold = Solo::new(GOLD, &staggered(200));
    gold.quiet_until(ms(22_000), both);
    assert_eq!(gold.engine.active(), Some(set(TOP)));
    let output = gold.step([false, false, true, false], &[]);
    assert_eq!(gold.engine.active(), None);
    assert_eq!(output.motivations[TOP].motivation, 0.0);
    assert!(output.motivations[BOTTOM].activity_suppression);
    assert!((output.motivations[BOTTOM].motivation - 0.8).abs() < 1e-12);
    let expected = StateChange {
        set: set(TOP),
        from: BehaviorState::Active,
        to: BehaviorState::Hibernating,
        reason: Reason::NotApplicable,
    };
    assert_eq!(output.changes, [expected]);
}

#[test]
fn of_several_at_threshold_the_first_in_the_catalog_activates() {
    let mut gold = Solo::new(GOLD, &setup(Preset::Team, 2, 200));
    gold.quiet_until(ms(20_200), ALL);
    assert_eq!(gold.engine.active(), Some(set(FIND)));
}

#[test]
fn of_several_at_threshold_the_highest_priority_activates() {
    let setup = with_task(setup(Preset::Team, 2, 200), "move(bottom)", |task| {
        task.priority = 1;
    });
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(20_200), ALL);
    assert_eq!(gold.engine.active(), Some(set(BOTTOM)));
}

#[test]
fn of_several_at_threshold_the_longest_there_activates() {
    // Top and bottom both end up waiting for blue and green, bottom first; then both become free in the same step.
    let mut setup = setup(Preset::Team, 3, 200);
    let gold = setup.alliance.robots.get_mut("gold").unwrap();
    let bottom = gold.sets.get_mut("move(bottom)").unwrap();
    bottom.fast_impatience = 6.0;
    let both = [false, true, true, false];
    let mut gold = Solo::new(GOLD, &setup);
    let mut seq = 0;
    let mut speak = |gold: &mut Solo, state| {
        seq += 1;
        let now = gold.now;
        gold.step(
            both,
            &[
                heartbeat(BLUE, seq, now, state, ms(0), TOP),
                heartbeat(GREEN, seq, now, state, ms(0), BOTTOM),
            ],
        )
    };
    while gold.now < ms(50_000) {
        speak(&mut gold, TaskState::Executing);
    }
    let output = speak(&mut gold, TaskState::Released);
    assert_eq!(gold.engine.active(), Some(set(BOTTOM)));
    // The other stays waiting for this step, with a heartbeat due but in silence, and is suppressed in the next.
    assert_eq!(output.motivations[TOP].state, BehaviorState::Waiting);
    assert_eq!(output.announcements.len(), 1);
    assert_eq!(output.announcements[0].state, TaskState::Executing);
    let output = gold.step(both, &[]);
    assert_eq!(output.motivations[TOP].motivation, 0.0);
    assert_eq!(output.changes[0].reason, Reason::Suppressed);
    assert_eq!(output.announcements[0].state, TaskState::Released);
}

#[test]
fn gives_up_after_lambda_and_starts_again() {
    let mut setup = setup(Preset::Team, 1, 200);
    every_set(&mut setup, |set| set.before_giving_up_s = 10.0);
    let mut team = Team::new(&setup);
    team.run_until(ms(51_000), &[ONLY_TOP]);
    // Off in the step after λ; from there 20 s to θ, the first of which is the step after that.
    assert_eq!(
        team.changes_of(BLUE, TOP),
        [
            (20_000, BehaviorState::Active, Reason::Threshold),
            (30_200, BehaviorState::Hibernating, Reason::GaveUpLambda),
            (50_200, BehaviorState::Active, Reason::Threshold),
        ]
    );
}

#[test]
fn messages_of_strangers_and_of_unknown_tasks_are_ignored() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(10_000), ONLY_TOP);
    let own = gold.says(GOLD, TaskState::Executing, ms(0));
    let stranger = gold.says(RobotId(7), TaskState::Executing, ms(0));
    let mut unknown = gold.says(BLUE, TaskState::Executing, ms(0));
    if let Content::Heartbeat(heartbeat) = &mut unknown.body {
        heartbeat.task = Some(TaskId(99));
    }
    let output = gold.step(ONLY_TOP, &[unknown, own, stranger]);
    assert!(output.motivations[TOP].impatience_reset);
    assert_eq!(output.motivations[TOP].impatience, 5.0);
}

#[test]
fn a_clone_goes_on_like_the_original() {
    let mut team = Team::new(&setup(Preset::Team, 3, 200));
    team.run_until(ms(31_000), &[ALL; 3]);
    let mut snapshot = team.engines[1].clone();
    let input = StepInput {
        now: team.now,
        heard: &shared(&team.inboxes[1]),
        applicable: &ALL,
        progressed: &[],
    };
    let repeated = step_of(&mut snapshot, &input);
    assert_eq!(repeated, step_of(&mut team.engines[1], &input));
}

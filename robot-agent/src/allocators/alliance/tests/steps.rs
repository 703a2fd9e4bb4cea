//! The order within one robot's step, and the effect of a single step.

use super::*;

use Reason::{GaveUpLambda, Suppressed, Threshold};

fn motivations(output: &StepOutcome) -> Vec<f64> {
    output
        .motivations
        .iter()
        .map(|row| row.motivation)
        .collect()
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
fn the_first_in_the_catalog_activates_of_several_at_threshold() {
    let mut gold = Solo::new(GOLD, &setup(Preset::Team, 2, 200));
    gold.quiet_until(ms(20_200), ALL);
    assert_eq!(gold.engine.active(), Some(set(FIND)));
}

#[test]
fn the_highest_priority_activates_of_several_at_threshold() {
    let setup = with_task(setup(Preset::Team, 2, 200), "move(bottom)", |task| {
        task.priority = 1;
    });
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(20_200), ALL);
    assert_eq!(gold.engine.active(), Some(set(BOTTOM)));
}

#[test]
fn the_longest_at_threshold_activates() {
    // Top and bottom both wait for blue and green, bottom first; then both become free in the same step.
    let mut setup = setup(Preset::Team, 3, 200);
    let gold = Arc::make_mut(&mut setup.alliance.robots)
        .get_mut("gold")
        .unwrap();
    let bottom = gold.sets.get_mut("move(bottom)").unwrap();
    bottom.fast_impatience = 6.0;
    let both = [false, true, true, false];
    let mut gold = Solo::new(GOLD, &setup);
    let mut seq = 0;
    let mut report = |gold: &mut Solo, state| {
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
        report(&mut gold, TaskState::Executing);
    }
    let output = report(&mut gold, TaskState::Released);
    assert_eq!(gold.engine.active(), Some(set(BOTTOM)));
    // The other set still waits in this step, without its due heartbeat, and is suppressed in the next.
    assert_eq!(output.motivations[TOP].state, BehaviorState::Waiting);
    assert_eq!(output.announcements.len(), 1);
    assert_eq!(output.announcements[0].state, TaskState::Executing);
    let output = gold.step(both, &[]);
    assert_eq!(output.motivations[TOP].motivation, 0.0);
    assert_eq!(output.changes[0].reason, Suppressed);
    assert_eq!(output.announcements[0].state, TaskState::Released);
}

#[test]
fn gives_up_after_lambda_and_starts_again() {
    let mut setup = setup(Preset::Team, 1, 200);
    every_set(&mut setup, |set| set.before_giving_up_s = 10.0);
    let mut team = Team::new(&setup);
    team.run_until(ms(51_000), &[ONLY_TOP]);
    // The set hibernates in the step after λ. The next 20 s to θ start one step later.
    assert_eq!(
        team.changes_of(BLUE, TOP),
        [
            (20_000, BehaviorState::Active, Threshold),
            (30_200, BehaviorState::Hibernating, GaveUpLambda),
            (50_200, BehaviorState::Active, Threshold),
        ]
    );
}

#[test]
fn messages_from_outside_the_team_or_about_unknown_tasks_are_ignored() {
    let setup = setup(Preset::Team, 2, 200);
    let mut gold = Solo::new(GOLD, &setup);
    gold.quiet_until(ms(10_000), ONLY_TOP);
    let own = gold.message(GOLD, TaskState::Executing, ms(0));
    let outsider = gold.message(RobotId(7), TaskState::Executing, ms(0));
    let mut unknown = gold.message(BLUE, TaskState::Executing, ms(0));
    if let BroadcastContent::Heartbeat(heartbeat) = &mut unknown.body {
        heartbeat.task = Some(TaskId(99));
    }
    let output = gold.step(ONLY_TOP, &[unknown, own, outsider]);
    assert!(output.motivations[TOP].impatience_reset);
    assert_eq!(output.motivations[TOP].impatience, 5.0);
}

//! The waiting state, the arbitration of claims, and the effect of the switches on them.

use super::*;

use TaskState::Executing;

use Reason::{AcquiescedPsi, Arbitration, ResetBy, Suppressed, Threshold, WaitBound, WaitOver};

use BehaviorState::{Active, Hibernating, Waiting};

#[test]
fn two_claims_in_one_step_go_to_the_lower_rank() {
    let mut team = Team::new(&setup(Preset::Team, 2, 200));
    team.run_until(ms(30_000), &[ONLY_TOP; 2]);
    assert_eq!(team.changes_of(BLUE, TOP), [(20_000, Active, Threshold)]);
    assert_eq!(
        team.changes_of(GOLD, TOP),
        [(20_000, Active, Threshold), (20_200, Waiting, Arbitration),]
    );
}

#[test]
fn the_earlier_claim_wins_after_its_first_message_was_lost() {
    let mut setup = setup(Preset::Team, 2, 200);
    behaviors_of(&mut setup, "blue", |set| set.fast_impatience = 4.95);
    let mut team = Team::new(&setup);
    // Gold's claim at 20.0 s is lost. Blue claims at 20.4 s. Gold's heartbeat of 21.0 s is received one step later.
    team.link = Box::new(|sender, _| sender == BLUE);
    team.run_until(ms(20_600), &[ONLY_TOP; 2]);
    team.link = Box::new(|_, _| true);
    team.run_until(ms(25_000), &[ONLY_TOP; 2]);
    assert_eq!(team.changes_of(GOLD, TOP), [(20_000, Active, Threshold)]);
    assert_eq!(
        team.changes_of(BLUE, TOP),
        [(20_400, Active, Threshold), (21_200, Waiting, Arbitration),]
    );
}

#[test]
fn without_arbitration_both_run_until_psi() {
    let mut setup = setup(Preset::Par98, 2, 200);
    every_set(&mut setup, |set| set.before_yielding_s = 10.0);
    let mut team = Team::new(&setup);
    team.run_until(ms(31_000), &[ONLY_TOP; 2]);
    for robot in [BLUE, GOLD] {
        assert_eq!(
            team.changes_of(robot, TOP),
            [
                (20_000, Active, Threshold),
                (30_200, Hibernating, AcquiescedPsi),
            ]
        );
    }
}

#[test]
fn in_order_only_one_claims() {
    let mut team = Team::new(&setup(Preset::Thesis, 2, 200));
    team.run_until(ms(22_000), &[ONLY_TOP; 2]);
    assert_eq!(team.changes_of(BLUE, TOP), [(20_000, Active, Threshold)]);
    // Gold receives blue's first message in the same step and starts from 0.
    assert_eq!(team.changes_of(GOLD, TOP), []);
}

#[test]
fn the_waiting_robot_takes_over_when_the_other_yields() {
    let mut setup = setup(Preset::Team, 2, 200);
    every_set(&mut setup, |set| set.before_yielding_s = 40.0);
    let mut team = Team::new(&setup);
    team.run_until(ms(70_000), &[ONLY_TOP; 2]);
    assert_eq!(
        team.changes_of(BLUE, TOP),
        [
            (20_000, Active, Threshold),
            (60_200, Hibernating, AcquiescedPsi),
        ]
    );
    assert_eq!(
        team.changes_of(GOLD, TOP)[1..],
        [(20_200, Waiting, Arbitration), (60_400, Active, WaitOver),]
    );
}

#[test]
fn a_lost_release_is_covered_by_tau() {
    for (release_is_lost, over) in [(false, 30_600), (true, 35_200)] {
        let mut team = Team::new(&setup(Preset::Team, 2, 200));
        // Blue's set ceases to be applicable at 30.4 s; its last heartbeat was received at 30.2 s.
        team.run_until(ms(30_400), &[ONLY_TOP; 2]);
        if release_is_lost {
            team.link = Box::new(|_, _| false);
        }
        team.run_until(ms(36_000), &[[false; 4], ONLY_TOP]);
        let last = *team.changes_of(GOLD, TOP).last().unwrap();
        assert_eq!(last, (over, Active, WaitOver));
    }
}

/// Returns gold's changes beside an incumbent that receives nothing, broadcasts without end and achieves nothing.
fn beside_a_babbler(end: SimTime, preset: Preset) -> Vec<(u64, BehaviorState, Reason)> {
    let mut setup = setup(preset, 2, 200);
    every_set(&mut setup, |set| set.before_yielding_s = 20.0);
    let mut gold = Solo::new(GOLD, &setup);
    let mut changes = Vec::new();
    while gold.now < end {
        let at = gold.now.0;
        let received: Vec<_> = at
            .is_multiple_of(1000)
            .then(|| gold.message(BLUE, Executing, ms(0)))
            .into_iter()
            .collect();
        let output = gold.step(ONLY_TOP, &received);
        changes.extend(
            output
                .changes
                .iter()
                .map(|change| (at, change.to, change.reason)),
        );
    }
    changes
}

#[test]
fn waiting_ends_at_its_bound_against_a_babbling_incumbent() {
    // Gold reaches θ at 44 s (φ = 30 s) and waits longer than ψ + τ = 25 s. It then ignores the incumbent's older claim
    // and executes until its own ψ, because it still receives the incumbent.
    assert_eq!(
        beside_a_babbler(ms(90_000), Preset::Team),
        [
            (44_000, Waiting, Threshold),
            (69_200, Active, WaitBound),
            (89_400, Hibernating, AcquiescedPsi),
        ]
    );
}

#[test]
fn without_the_waiting_state_a_set_at_threshold_activates() {
    assert_eq!(
        beside_a_babbler(ms(50_000), Preset::Par98),
        [(44_000, Active, Threshold)]
    );
}

#[test]
fn two_robots_that_waited_for_the_same_incumbent_do_not_both_stay() {
    let mut setup = setup(Preset::Team, 3, 200);
    every_set(&mut setup, |set| set.before_yielding_s = 20.0);
    let mut team = Team::new(&setup);
    let mut seq = 1 << 40;
    // Blue's own engine idles; the test sends messages in its name.
    team.link = Box::new(|sender, _| sender != BLUE);
    while team.now < ms(71_000) {
        if team.now.0.is_multiple_of(1000) {
            seq += 1;
            let message = heartbeat(BLUE, seq, team.now, Executing, ms(0), TOP);
            team.inboxes[1].push(message.clone());
            team.inboxes[2].push(message);
        }
        team.step(&[[false; 4], ONLY_TOP, ONLY_TOP]);
    }
    assert_eq!(
        team.changes_of(GOLD, TOP),
        [(44_000, Waiting, Threshold), (69_200, Active, WaitBound),]
    );
    // Green's bound passes in the same step; gold has the lower rank. Gold's first message resets a waiting set, but
    // not a set that is active in the step that receives it.
    assert_eq!(
        team.changes_of(GREEN, TOP)[1..],
        [(69_200, Active, WaitBound), (69_400, Waiting, Arbitration),]
    );
}

#[test]
fn progress_of_the_incumbent_resets_waiting_robots() {
    let mut team = Team::new(&setup(Preset::Team, 2, 200));
    team.run_until(ms(25_000), &[ONLY_TOP; 2]);
    team.step_with(&[ONLY_TOP; 2], &[(BLUE, task(TOP))]);
    let outputs = team.step(&[ONLY_TOP; 2]);
    assert_eq!(outputs[1].motivations[TOP].motivation, 0.0);
    assert!(!outputs[1].motivations[TOP].impatience_reset);
    let last = *team.changes_of(GOLD, TOP).last().unwrap();
    assert_eq!(last, (25_200, Hibernating, ResetBy(BLUE)));
    // Gold leaves a working teammate alone: its motivation rises from 0 at the slow rate.
    let outputs = team.step(&[ONLY_TOP; 2]);
    assert_eq!(outputs[1].motivations[TOP].impatience, 1.0);
}

#[test]
fn a_task_for_two_is_occupied_by_two() {
    let setup = with_task(setup(Preset::Team, 4, 200), "move(top)", |task| {
        task.max_robots = Some(2);
    });
    let mut team = Team::new(&setup);
    team.run_until(ms(22_000), &[ONLY_TOP; 4]);
    let states: Vec<bool> = team
        .engines
        .iter()
        .map(|engine| engine.active().is_some())
        .collect();
    assert_eq!(states, [true, true, false, false]);
    for robot in [GREEN, RobotId(3)] {
        let last = *team.changes_of(robot, TOP).last().unwrap();
        assert_eq!(last, (20_200, Waiting, Arbitration));
    }
}

/// Runs the curiosity of thesis §4.3.1: gold executes move(top); green reaches θ on it and on report at once.
fn curiosity(wish_when_suppressed: bool) -> Team {
    let mut setup = setup(Preset::Thesis, 3, 200);
    setup.alliance.switches.wish_when_suppressed = wish_when_suppressed;
    behaviors_of(&mut setup, "green", |set| toward_all(set, 5.0, 30.0));
    let mut team = Team::new(&setup);
    team.run_until(ms(20_000), &[[false; 4], ONLY_TOP, [false; 4]]);
    // Both of green's sets become applicable after gold's claim, so that no reset follows.
    team.step(&[[false; 4], ONLY_TOP, [false; 4]]);
    let green = [false, true, false, true];
    team.run_until(ms(50_000), &[[false; 4], ONLY_TOP, green]);
    team
}

#[test]
fn a_wish_of_a_set_that_is_suppressed_at_once_displaces_the_incumbent() {
    let team = curiosity(true);
    // Green is at θ on both 20 s after 20.0 s.
    assert_eq!(
        team.changes_of(GREEN, TOP),
        [
            (40_000, Waiting, Threshold),
            (40_200, Hibernating, Suppressed),
        ]
    );
    assert_eq!(
        team.changes_of(GREEN, REPORT),
        [(40_000, Active, Threshold)]
    );
    assert_eq!(
        team.changes_of(GOLD, TOP)[1],
        (40_200, Hibernating, ResetBy(GREEN))
    );
}

#[test]
fn without_that_switch_the_incumbent_continues() {
    let team = curiosity(false);
    assert_eq!(team.changes_of(GREEN, TOP), []);
    assert_eq!(team.changes_of(GOLD, TOP).len(), 1);
}

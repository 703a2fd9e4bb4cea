//! Robots at one task.

use super::*;

#[test]
fn two_active_sets() {
    violates(
        Invariant::OneActiveBehavior,
        "green has 2 active",
        |state| {
            set_state(state, 2, TOP, BehaviorState::Active);
            set_state(state, 2, BOTTOM, BehaviorState::Active);
        },
    );
}

/// Returns the number of ticks for which gold and green may execute one task before a violation, under a preset and
/// with a changed state.
fn together(preset: Preset, change: impl Fn(&mut WorldState)) -> Option<u64> {
    let mut scenario = default_scenario();
    scenario.alliance.preset = preset;
    let setup = testkit::setup(scenario);
    let mut exclusive = Exclusive::new(&setup);
    let mut state = beginning();
    for ticks in 0..10_000 {
        next(&mut state);
        for rank in [1, 2] {
            set_state(&mut state, rank, TOP, BehaviorState::Active);
        }
        change(&mut state);
        if exclusive.check(&setup.scenario, &state).is_err() {
            return Some(ticks);
        }
    }
    None
}

#[test]
fn two_robots_on_an_exclusive_task() {
    // A heartbeat every second, and ψ = 240 s, at 20 ticks/s.
    assert_eq!(together(Preset::Team, |_| ()), Some(24));
    assert_eq!(together(Preset::Par98, |_| ()), Some(4824));
    // Only one robot is active, or the tasks differ.
    let waits = |state: &mut WorldState| set_state(state, 1, TOP, BehaviorState::Waiting);
    assert_eq!(together(Preset::Team, waits), None);
    let other_task = |state: &mut WorldState| {
        set_state(state, 1, TOP, BehaviorState::Hibernating);
        set_state(state, 1, BOTTOM, BehaviorState::Active);
    };
    assert_eq!(together(Preset::Team, other_task), None);
    // One robot leaves the task from time to time.
    let in_turn = |state: &mut WorldState| {
        if state.tick.is_multiple_of(20) {
            set_state(state, 1, TOP, BehaviorState::Hibernating);
        }
    };
    assert_eq!(together(Preset::Team, in_turn), None);
}

#[test]
fn after_a_full_wait_psi_resolves_the_conflict() {
    // ψ + τ = 245 s.
    let waits = |ticks: u64| {
        together(Preset::Team, move |state: &mut WorldState| {
            if state.tick < ticks {
                set_state(state, 1, TOP, BehaviorState::Waiting);
            }
        })
    };
    assert_eq!(waits(20), Some(19 + 24));
    assert_eq!(waits(4910), Some(4909 + 4824));
}

#[test]
fn the_bound_begins_when_both_robots_receive_each_other() {
    let ticks_under = |order: &str| {
        let fault = in_force(order);
        together(Preset::Team, |state| state.faults = vec![fault.clone()])
    };
    for order in [
        r#"{"fault":{"deaf":"gold"}}"#,
        r#"{"fault":{"mute":"green"}}"#,
        r#"{"fault":{"drop":{"from":"gold","p":0.1}}}"#,
        r#"{"fault":{"delay":{"to":"gold","delay_s":1}}}"#,
        r#"{"fault":{"hold":{"from":"green","to":"gold"}}}"#,
        r#"{"fault":{"reorder":{"p":0.5}}}"#,
        r#"{"fault":{"partition":{"groups":[["blue","gold"],["green"]]}}}"#,
        r#"{"fault":{"range":{"range_m":0.5}}}"#,
        r#"{"fault":{"radio":"poor-radio"}}"#,
    ] {
        assert_eq!(ticks_under(order), None, "{order}");
    }
    for order in [
        r#"{"fault":{"deaf":"blue"}}"#,
        r#"{"fault":{"drop":{"from":"gold","to":"blue","p":1}}}"#,
        r#"{"fault":{"duplicate":{"p":1}}}"#,
        r#"{"fault":{"partition":{"groups":[["blue"],["green"]]}}}"#,
        r#"{"fault":{"range":{"range_m":9}}}"#,
        r#"{"fault":{"babble":"gold"}}"#,
    ] {
        assert_eq!(ticks_under(order), Some(24), "{order}");
    }
    let heals = together(Preset::Team, |state| {
        let mut fault = in_force(r#"{"fault":{"deaf":"gold"},"for_s":5}"#);
        if state.tick >= 100 {
            fault.phase = Phase::Over;
        }
        state.faults = vec![fault];
    });
    assert_eq!(heals, Some(99 + 24));
    let silent = together(Preset::Team, |state| state.robots[1].takes_part = false);
    assert_eq!(silent, None);
}

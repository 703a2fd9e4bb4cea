//! Missions that do not end, and their excuses.

use super::*;

/// Returns the simulated time after which a mission without progress is a violation, s.
fn due_after(change: impl Fn(&mut WorldState)) -> Option<u64> {
    due_after_with(Scenario::DEFAULT_ALLOCATOR, change)
}

/// Returns the same for a team with that allocator.
fn due_after_with(allocator: &str, change: impl Fn(&mut WorldState)) -> Option<u64> {
    let mut setup = setup();
    setup.scenario.allocator = Some(allocator.to_owned());
    let mut termination = Termination::new(&setup);
    let mut state = beginning();
    for s in 0..20_000 {
        state.now = SimTime(1000 * s);
        change(&mut state);
        if termination.check(&setup.scenario, &state).is_err() {
            return Some(s);
        }
    }
    None
}

#[test]
fn a_covered_mission_that_does_not_end() {
    let due_s = due_after(|_| ()).unwrap();
    // Five times 24 items and the search, about 26 s each.
    assert!((4000..4400).contains(&due_s), "{due_s}");
    let with = |order: &str| due_after(|state| state.faults = vec![in_force(order)]);
    // These faults leave a robot that can do everything.
    for order in [
        r#"{"fault":{"deaf":"gold"}}"#,
        r#"{"fault":{"drop":{"p":0.5}}}"#,
        r#"{"fault":{"kill":"gold"}}"#,
        r#"{"fault":{"mute":"gold"},"when":"gold dies"}"#,
    ] {
        assert_eq!(with(order), Some(due_s), "{order}");
    }
    // A robot that sends messages and does nothing costs time.
    assert!(with(r#"{"fault":{"power":"gold"}}"#) > Some(due_s + 400));
    // A fault is about to begin or heal, or a robot permanently sends false information.
    for order in [
        r#"{"fault":{"mute":"gold"},"for_s":9}"#,
        r#"{"fault":{"babble":"gold"}}"#,
        r#"{"fault":{"sensor":{"robot":"gold","device":"position","mode":"stuck"}}}"#,
        r#"{"fault":{"actuator":{"robot":"gold","mode":"gripper"}}}"#,
    ] {
        assert_eq!(with(order), None, "{order}");
    }
    let recurs = due_after(|state| {
        let mut fault = in_force(r#"{"fault":{"mute":"gold"},"every_s":20,"for_s":9}"#);
        fault.phase = Phase::Armed;
        state.faults = vec![fault];
    });
    assert_eq!(recurs, None);
    let healed = due_after(|state| {
        let mut fault = in_force(r#"{"fault":{"mute":"gold"},"for_s":100}"#);
        if state.now >= SimTime(100_000) {
            fault.phase = Phase::Over;
        }
        state.faults = vec![fault];
    });
    assert_eq!(healed, Some(due_s + 100));
}

/// Static assignment has no takeover after a death; other allocators have.
#[test]
fn without_takeovers_a_mission_is_not_due() {
    let gold_is_dead = |state: &mut WorldState| state.robots[1].takes_part = false;
    let due_s = due_after(|_| ());
    assert_eq!(due_after_with("static", |_| ()), due_s);
    assert_eq!(due_after_with("static", gold_is_dead), None);
    assert_eq!(due_after_with("first-come", gold_is_dead), due_s);
}

#[test]
fn a_mission_without_coverage_may_continue() {
    let no_robot = |state: &mut WorldState| {
        for robot in &mut state.robots {
            robot.takes_part = false;
        }
    };
    assert_eq!(due_after(no_robot), None);
    // A dead robot holds an item.
    let held = |state: &mut WorldState| {
        state.items[3].carrier = Some(RobotId(1));
        state.robots[1].takes_part = false;
    };
    assert_eq!(due_after(held), None);
    // All items are delivered.
    let done = |state: &mut WorldState| {
        for item in &mut state.items {
            item.position = Vec2::new(9.6, 4.5);
        }
    };
    assert_eq!(due_after(done), None);
}

#[test]
fn strewn_waste_extends_the_bound() {
    let due_s = due_after(|_| ());
    let moved = |to: Vec2| {
        due_after(|state| {
            if state.now > SimTime(0) {
                state.items[3].position = to;
            }
        })
    };
    // Top is at (4, 6), the deposit at (9.6, 4.5).
    assert_eq!(moved(Vec2::new(4.0, 6.7)), due_s);
    assert_eq!(moved(Vec2::new(7.0, 5.4)), due_s);
    // Five times the search (three minutes and ten rows of 12 m) for each of three robots, and the path from corner to
    // corner and back.
    let far_s = moved(Vec2::new(4.0, 7.5)).unwrap() - due_s.unwrap();
    assert!((7000..7400).contains(&far_s), "{far_s}");
    let added = |at_s: u64| {
        due_after(|state| {
            if state.now == SimTime(1000 * at_s) {
                let mut item = state.items[0];
                item.position = Vec2::new(11.5, 0.5);
                state.items.push(item);
            }
        })
    };
    // The first tick counts, too.
    let searched_s = due_s.unwrap() + far_s;
    for at_s in [0, 1, 100] {
        assert!(added(at_s).unwrap() >= searched_s, "{at_s}");
    }
    // The position of an item that was carried is known.
    let carried = due_after(|state| {
        let item = &mut state.items[3];
        item.carrier = (state.now == SimTime(1000)).then_some(RobotId(1));
        if state.now > SimTime(1000) {
            item.position = Vec2::new(11.5, 0.5);
        }
    });
    assert_eq!(carried, due_s);
}

#[test]
fn a_blocked_path_excuses_the_mission() {
    let wall = |gap_m: f32| Rectangle {
        id: ComponentId::Obstacle(ObstacleId(0)),
        min: Vec2::new(6.5, 0.0),
        max: Vec2::new(7.0, 9.0 - gap_m),
        solid: true,
    };
    let with_gap = |gap_m| due_after(|state| state.rectangles = vec![wall(gap_m)]);
    assert!(with_gap(1.0).is_some());
    assert_eq!(with_gap(0.5), None);
    // A dead body blocks the gap.
    let plugged = due_after(|state| {
        state.rectangles = vec![wall(1.0)];
        state.robots[1].takes_part = false;
        state.robots[1].pose.position = Vec2::new(6.75, 8.5);
    });
    assert_eq!(plugged, None);
}

#[test]
fn patience_shorter_than_a_unit_of_work_excuses_the_mission() {
    let mut scenario = default_scenario();
    scenario.alliance.defaults.before_yielding_s = Some(10.0);
    let setup = testkit::setup(scenario);
    let mut termination = Termination::new(&setup);
    let mut state = beginning();
    for s in 0..20_000 {
        state.now = SimTime(1000 * s);
        assert_eq!(termination.check(&setup.scenario, &state), Ok(()));
    }
}

/// Two robots, one of them deaf, find waste in a corner where they have no other task, from the first tick on or later.
#[test]
fn strewn_waste_is_found() {
    for (seed, at_s) in [(1, 0), (2, 60)] {
        let text = format!(
            "name = 'strewn'\nstep_ms = 100\nroom = {{ width_m = 15.0, height_m = 9.0 }}\n\
             robots = [{{ name = 'r1' }}, {{ name = 'r2' }}]\n\
             waste.spills = [{{ name = 's0', items = 4 }}]\n\
             [[faults.timeline]]\nfault = {{ deaf = 'r1' }}\nat_s = 0\n\
             [[faults.timeline]]\nfault = {{ waste = {{ x_m = 13.33, y_m = 7.2, items = 5 }} }}\nat_s = {at_s}\n\
             [[faults.timeline]]\nfault = {{ waste = {{ x_m = 10.97, y_m = 5.96 }} }}\nat_s = {at_s}\n"
        );
        let scenario = testkit::scenario(&text);
        let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
        let (_, outcome) = checked(setup);
        assert_eq!(outcome, Outcome::Complete, "seed {seed}, at {at_s} s");
    }
}

//! Items, bodies and numbers.

use super::*;

#[test]
fn items_that_come_go_or_are_in_two_places() {
    let of = |what: &str, change: fn(&mut WorldState)| {
        violates(Invariant::ItemsAccountedFor, what, change);
    };
    of("23 items, but 24 to 24", |state| {
        state.items.pop();
    });
    of("25 items", |state| state.items.push(state.items[0]));
    of("item-3 is with gold, which carries nothing", |state| {
        state.items[3].carrier = Some(RobotId(1));
    });
    of("item-3 is with gold, which carries item-4", |state| {
        state.items[3].carrier = Some(RobotId(1));
        state.robots[1].carrying = Some(ItemId(4));
    });
    of("gold carries item-3, which is not with it", |state| {
        state.robots[1].carrying = Some(ItemId(3));
    });
    of("green carries item-3, which is not with it", |state| {
        state.items[3].carrier = Some(RobotId(1));
        state.robots[1].carrying = Some(ItemId(3));
        state.robots[2].carrying = Some(ItemId(3));
    });
    of("gold carries item-3 without a body", |state| {
        state.items[3].carrier = Some(RobotId(1));
        state.robots[1].carrying = Some(ItemId(3));
        state.robots[1].present = false;
    });
    of("outside the border", |state| {
        state.items[0].position.x = 12.5
    });
    of("outside the border", |state| {
        state.items[0].position.y = f32::NAN
    });
    // A carried item is accepted.
    let carried = check_changed(|state| {
        state.items[3].carrier = Some(RobotId(1));
        state.robots[1].carrying = Some(ItemId(3));
    });
    assert_eq!(carried, Ok(()));
}

#[test]
fn a_waste_fault_adds_items_only_in_its_tick_and_within_its_count() {
    let waste = |count: usize, applied: u64| {
        check_changed(|state| {
            let mut fault = in_force(r#"{"fault":{"waste":{"x_m":6,"y_m":2,"items":2}}}"#);
            (fault.phase, fault.applied_ms) = (Phase::Over, Some(SimTime(applied)));
            state.faults.push(fault);
            let item = state.items[0];
            state.items.extend(vec![item; count]);
        })
    };
    for count in 0..=2 {
        assert_eq!(waste(count, 50), Ok(()));
    }
    assert!(waste(3, 50).is_err());
    assert!(waste(1, 0).is_err());
}

#[test]
fn delivered_items_stay_at_the_deposit() {
    let mut invariants = Invariants::new(&setup());
    let mut state = beginning();
    let before = state.items[0].position;
    state.items[0].position = Vec2::new(9.6, 4.5);
    invariants.check(&state).unwrap();
    next(&mut state);
    state.items[0].position = before;
    let violation = invariants.check(&state).unwrap_err();
    assert_eq!(violation.description, "item-0 has left its goal");
}

#[test]
fn bodies_in_the_border_in_obstacles_and_in_each_other() {
    let solids = Invariant::NoOverlap;
    violates(solids, "blue is", |state| {
        state.robots[0].pose.position.x = 0.19
    });
    violates(solids, "in the border", |state| {
        state.robots[0].pose.position.y = 8.9
    });
    violates(solids, "blue and gold overlap by", |state| {
        let at = state.robots[0].pose.position;
        state.robots[1].pose.position = at + Vec2::new(0.39, 0.0);
    });
    // Absent bodies do not overlap others.
    let absent = check_changed(|state| {
        let at = state.robots[0].pose.position;
        state.robots[1].pose.position = at;
        state.robots[1].present = false;
    });
    assert_eq!(absent, Ok(()));
}

/// Returns an obstacle whose left side is `right_m` to the right of gold's center.
fn obstacle(state: &WorldState, right_m: f32) -> Rectangle {
    let min = state.robots[1].pose.position + Vec2::new(right_m, -0.5);
    Rectangle {
        id: ComponentId::Obstacle(ObstacleId(0)),
        min,
        max: min + Vec2::ONE,
        solid: true,
    }
}

#[test]
fn an_obstacle_on_a_robot_can_only_be_left() {
    let ways = |ways_m: &[f32]| {
        let mut invariants = Invariants::new(&setup());
        let mut state = beginning();
        let gold = Vec2::new(6.0, 4.5);
        state.robots[1].pose.position = gold;
        let there = obstacle(&state, 0.1);
        let mut found = invariants.check(&state);
        for way_m in ways_m {
            next(&mut state);
            state.rectangles = vec![there];
            state.robots[1].pose.position = gold + Vec2::new(0.1 - way_m, 0.0);
            found = found.and_then(|()| invariants.check(&state));
        }
        found.map_err(|violation| violation.description)
    };
    assert_eq!(ways(&[0.1, 0.1, 0.15, 0.2, 0.25]), Ok(()));
    let refused = |ways_m: &[f32], part: &str| {
        let what = ways(ways_m).unwrap_err();
        assert!(what.contains(part), "{what}");
    };
    refused(&[0.1, 0.09], "gold gets deeper into obstacle-0, 0.11");
    refused(&[0.1, 0.15, 0.12], "deeper");
    refused(&[0.1, 0.21, 0.19], " m in obstacle-0");
    // The robot entered the obstacle by itself.
    refused(&[0.3, 0.11], " m in obstacle-0");
    // A patch is no obstacle.
    let patch = check_changed(|state| {
        let mut patch = obstacle(state, 0.0);
        patch.solid = false;
        state.rectangles.push(patch);
    });
    assert_eq!(patch, Ok(()));
}

#[test]
fn distances_from_a_rectangle() {
    let rectangle = Rectangle {
        min: Vec2::new(1.0, 1.0),
        max: Vec2::new(3.0, 2.0),
        ..obstacle(&beginning(), 0.0)
    };
    for (x, y, way_m) in [
        (0.0, 1.5, 1.0),
        (2.0, 4.0, 2.0),
        (6.0, 6.0, 5.0),
        (2.0, 1.5, -0.5),
        (2.9, 1.5, -0.1),
        (1.0, 1.0, 0.0),
    ] {
        let found = solids::distance(&rectangle, Vec2::new(x, y));
        assert!((found - way_m).abs() < 1e-6, "{x} {y}: {found}");
    }
}

#[test]
fn numbers_that_are_nan_or_out_of_range() {
    let numbers = Invariant::NumbersInRange;
    let of_gold = |name: &str, change: fn(&mut RobotState)| {
        violates(numbers, name, |state| change(&mut state.robots[1]));
    };
    of_gold("heading", |gold| gold.pose.heading_rad = f32::NAN);
    of_gold("heading", |gold| gold.pose.heading_rad = 3.2);
    of_gold("speed", |gold| gold.speed_m_s = f32::NAN);
    of_gold("speed", |gold| gold.speed_m_s = -0.1);
    of_gold("speed", |gold| gold.speed_m_s = f32::INFINITY);
    of_gold("energy", |gold| gold.energy_j = Some(f32::NAN));
    of_gold("motivation", |gold| {
        gold.motivations[1].motivation = f64::NAN
    });
    of_gold("motivation", |gold| gold.motivations[1].motivation = 100.1);
    of_gold("motivation", |gold| gold.motivations[1].motivation = -1e-9);
    of_gold("impatience", |gold| {
        gold.motivations[1].impatience = f64::INFINITY
    });
    // A NaN position violates several invariants. Any of the checks may report it.
    assert!(check_changed(|state| state.robots[1].pose.position.x = f32::NAN).is_err());
}

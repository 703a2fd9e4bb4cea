//! Hand-made violations that the checks must find, and states that they must accept.

use glam::Vec2;
use missions::Registry;
use missions::waste::data::{default_scenario, default_setup};
use proto::control::{FaultStatus, Phase};
use proto::telemetry::{BehaviorState, Motivation};
use proto::tick::Outcome;
use run_log::{LogLevel, MemoryLog, RunLog};
use scenario::fault::Order;
use scenario::ids::{BehaviorId, ItemId, RobotId};
use scenario::time::SimTime;
use scenario::{Preset, Scenario, Setup};
use world_server::world::{ComponentId, ObstacleId};

use super::*;
use in_process::Team;

const TOP: BehaviorId = BehaviorId(2);
const BOTTOM: BehaviorId = BehaviorId(3);

fn setup() -> Setup {
    default_setup(1)
}

/// Returns the default mission after its first tick.
fn beginning() -> WorldState {
    let mut team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    team.tick().unwrap();
    WorldState::from_simulation(team.simulation())
}

/// Advances the state by one tick.
fn next(state: &mut WorldState) {
    state.tick += 1;
    state.now = SimTime(state.tick * setup().scenario.step_ms);
}

/// Checks a good tick, and then a changed one.
fn check_changed(change: impl FnOnce(&mut WorldState)) -> Result<(), Violation> {
    let mut invariants = Invariants::new(&setup());
    let mut state = beginning();
    invariants.check(&state).unwrap();
    next(&mut state);
    change(&mut state);
    invariants.check(&state)
}

#[track_caller]
fn violates(invariant: Invariant, what: &str, change: impl FnOnce(&mut WorldState)) {
    let violation = check_changed(change).unwrap_err();
    assert_eq!(violation.invariant, invariant, "{violation}");
    assert!(violation.description.contains(what), "{violation}");
    let line = violation.to_string();
    assert!(
        line.starts_with(&format!("{invariant}: tick 1: ")),
        "{line}"
    );
    assert_eq!(line.lines().count(), 1);
}

/// Returns a fault that has been in force for a long time.
fn in_force(order: &str) -> FaultStatus {
    let order: Order = serde_json::from_str(order).unwrap();
    FaultStatus {
        id: "f1".to_owned(),
        order,
        phase: Phase::InForce,
        applied_ms: None,
        healed_ms: None,
        hits: 0,
        failed: None,
    }
}

fn set_state(world: &mut WorldState, rank: usize, set: BehaviorId, state: BehaviorState) {
    let motivations = &mut world.robots[rank].motivations;
    let entry = motivations
        .iter_mut()
        .find(|entry| entry.set == set)
        .unwrap();
    (entry.state, entry.motivation) = (state, 100.0);
}

#[test]
fn the_next_tick_is_accepted() {
    assert_eq!(check_changed(|_| ()), Ok(()));
}

#[test]
fn a_whole_mission_is_accepted() {
    let mut invariants = Invariants::new(&setup());
    let mut team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    let outcome = loop {
        let outcome = team.tick().unwrap();
        invariants.check_simulation(team.simulation()).unwrap();
        if let Some(outcome) = outcome {
            break outcome;
        }
    };
    let (_, recorder) = team.end(outcome).unwrap();
    let mut log =
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
    replayed::check(&log).unwrap();

    log.run.hash = Some("0".repeat(16));
    let error = replayed::check(&log).unwrap_err();
    let violation = error.downcast_ref::<Violation>().unwrap();
    assert_eq!(violation.invariant, Invariant::ReplayIdentical);
}

#[test]
fn figures_that_differ_in_the_replay_are_a_violation() {
    let team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    let (_, recorder) = team
        .run_for(20, proto::tick::Outcome::Interrupted, |_| ())
        .unwrap();
    let mut log =
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
    replayed::check(&log).unwrap();
    log.run.result.mission.add("reports_made", 9_u32);
    assert!(replayed::check(&log).is_err());
}

/// Checks that the replay begins the tick in which no robot is left, because faults may be due in it.
#[test]
fn a_run_that_ends_without_robots_is_replayed_to_its_last_fault() {
    let text = "
        robots = [{ name = 'blue' }, { name = 'gold', absent = true }]
        [[faults.timeline]]
        fault.kill = 'blue'
        at_s = 1.0
        [[faults.timeline]]
        fault.continue = 'gold'
        at_s = 2.0
    ";
    let scenario =
        Scenario::parse("mission.toml", text, &Registry::built_in().vocabulary()).unwrap();
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
    let (outcome, recorder) = team.run().unwrap();
    assert_eq!(outcome, proto::tick::Outcome::NoRobotLeft);
    let log =
        RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
    assert!(
        log.run
            .faults
            .iter()
            .all(|fault| fault.applied_ms.is_some())
    );
    replayed::check(&log).unwrap();
}

/// Checks that a kill in the tick of a restart affects the same incarnation in the replay.
#[test]
fn a_restart_and_a_kill_in_one_tick_are_replayed() {
    for [first, then] in [["restart", "kill"], ["kill", "restart"]] {
        let text = format!(
            "
            robots = [{{ name = 'blue' }}, {{ name = 'gold' }}]
            limit_s = 5.0
            [[faults.timeline]]
            fault.{first} = 'blue'
            at_s = 1.0
            [[faults.timeline]]
            fault.{then} = 'blue'
            at_s = 1.0
        "
        );
        let scenario =
            Scenario::parse("mission.toml", &text, &Registry::built_in().vocabulary()).unwrap();
        let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
        let team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let (_, recorder) = team.run().unwrap();
        let log =
            RunLog::from_memory(&recorder.into_sink(), &Registry::built_in().vocabulary()).unwrap();
        assert!(!log.run.unscripted, "{first}, {then}");
        assert!(log.run.faults.iter().all(|fault| fault.hits == 1));
        replayed::check(&log).unwrap();
    }
}

#[test]
fn ticks_that_are_left_out_or_do_not_end() {
    let left_out = check_changed(|state| state.tick = 2).unwrap_err();
    assert_eq!(
        left_out.to_string(),
        "ticks go on: tick 2: tick 1 was expected"
    );
    let mut invariants = Invariants::new(&setup());
    let mut team = Team::new(setup(), LogLevel::Off, MemoryLog::default()).unwrap();
    team.tick().unwrap();
    invariants.check_simulation(team.simulation()).unwrap();
    let stuck = invariants.check_simulation(team.simulation()).unwrap_err();
    assert_eq!(
        stuck.to_string(),
        "ticks go on: tick 1: the tick does not end"
    );
}

#[test]
fn items_that_come_go_or_are_in_two_places() {
    let items = Invariant::ItemsAccountedFor;
    violates(items, "23 items, but 24 to 24", |state| {
        state.items.pop();
    });
    violates(items, "25 items", |state| {
        let item = state.items[0];
        state.items.push(item);
    });
    violates(
        items,
        "item-3 is with gold, which carries nothing",
        |state| {
            state.items[3].carrier = Some(RobotId(1));
        },
    );
    violates(
        items,
        "item-3 is with gold, which carries item-4",
        |state| {
            state.items[3].carrier = Some(RobotId(1));
            state.robots[1].carrying = Some(ItemId(4));
        },
    );
    violates(
        items,
        "gold carries item-3, which is not with it",
        |state| {
            state.robots[1].carrying = Some(ItemId(3));
        },
    );
    violates(
        items,
        "green carries item-3, which is not with it",
        |state| {
            state.items[3].carrier = Some(RobotId(1));
            state.robots[1].carrying = Some(ItemId(3));
            state.robots[2].carrying = Some(ItemId(3));
        },
    );
    violates(items, "gold carries item-3 without a body", |state| {
        state.items[3].carrier = Some(RobotId(1));
        state.robots[1].carrying = Some(ItemId(3));
        state.robots[1].present = false;
    });
    violates(items, "outside the border", |state| {
        state.items[0].position.x = 12.5
    });
    violates(items, "outside the border", |state| {
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
    assert!(
        ways(&[0.1, 0.09])
            .unwrap_err()
            .starts_with("gold gets deeper into obstacle-0, 0.11")
    );
    assert!(ways(&[0.1, 0.15, 0.12]).unwrap_err().contains("deeper"));
    assert!(
        ways(&[0.1, 0.21, 0.19])
            .unwrap_err()
            .ends_with(" m in obstacle-0")
    );
    // The robot entered the obstacle by itself.
    assert!(
        ways(&[0.3, 0.11])
            .unwrap_err()
            .ends_with(" m in obstacle-0")
    );
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
        id: ComponentId::Obstacle(ObstacleId(0)),
        min: Vec2::new(1.0, 1.0),
        max: Vec2::new(3.0, 2.0),
        solid: true,
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
    let scenario = Scenario {
        alliance: scenario::AllianceSection {
            preset,
            ..Default::default()
        },
        ..default_scenario()
    };
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
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
    assert_eq!(
        together(Preset::Team, |state| set_state(
            state,
            1,
            TOP,
            BehaviorState::Waiting
        )),
        None
    );
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
    let wall = |gap_m: f32| {
        due_after(|state| {
            state.rectangles = vec![Rectangle {
                id: ComponentId::Obstacle(ObstacleId(0)),
                min: Vec2::new(6.5, 0.0),
                max: Vec2::new(7.0, 9.0 - gap_m),
                solid: true,
            }];
        })
    };
    assert!(wall(1.0).is_some());
    assert_eq!(wall(0.5), None);
    // A dead body blocks the gap.
    let plugged = due_after(|state| {
        state.rectangles = vec![Rectangle {
            id: ComponentId::Obstacle(ObstacleId(0)),
            min: Vec2::new(6.5, 0.0),
            max: Vec2::new(7.0, 8.0),
            solid: true,
        }];
        state.robots[1].takes_part = false;
        state.robots[1].pose.position = Vec2::new(6.75, 8.5);
    });
    assert_eq!(plugged, None);
}

#[test]
fn patience_shorter_than_a_unit_of_work_excuses_the_mission() {
    let mut scenario = default_scenario();
    scenario.alliance.defaults.before_yielding_s = Some(10.0);
    let setup = Setup::resolve(scenario, 1, None).unwrap().setup;
    let mut termination = Termination::new(&setup);
    let mut state = beginning();
    for s in 0..20_000 {
        state.now = SimTime(1000 * s);
        assert_eq!(termination.check(&setup.scenario, &state), Ok(()));
    }
}

/// Compares the state with the run. The motivations come from the agents.
#[test]
fn a_world_state_matches_the_run() {
    let state = beginning();
    assert_eq!((state.tick, state.now), (0, SimTime(0)));
    assert_eq!((state.robots.len(), state.items.len()), (3, 24));
    let sets = |rank: usize| -> Vec<BehaviorId> {
        let motivations: &[Motivation] = &state.robots[rank].motivations;
        motivations
            .iter()
            .map(|motivation| motivation.set)
            .collect()
    };
    assert_eq!(sets(0), [0, 1, 2, 3, 4].map(BehaviorId));
    assert_eq!(sets(1), [1, 2, 3, 4].map(BehaviorId));
    assert!(
        state
            .robots
            .iter()
            .all(|robot| robot.present && robot.takes_part)
    );
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
        let vocabulary = Registry::built_in().vocabulary();
        let scenario = Scenario::parse("strewn.toml", &text, &vocabulary).unwrap();
        let setup = Setup::resolve(scenario, seed, None).unwrap().setup;
        let mut invariants = Invariants::new(&setup);
        let mut team = Team::new(setup, LogLevel::Off, MemoryLog::default()).unwrap();
        let outcome = loop {
            let outcome = team.tick().unwrap();
            invariants.check_simulation(team.simulation()).unwrap();
            if let Some(outcome) = outcome {
                break outcome;
            }
        };
        assert_eq!(outcome, Outcome::Complete, "seed {seed}, at {at_s} s");
    }
}

//! Windows, values and outcomes of points.

use super::*;

/// Makes steps until the given time. Returns the details of the events, such as `done after 2.500 s`.
pub fn details_until(
    world: &mut World,
    end_s: f64,
    commands: [Option<Actuation>; 2],
) -> Vec<String> {
    let mut details = Vec::new();
    while world.now() < SimTime::from_secs_f64(end_s) {
        let events = world.step(&commands);
        world.mission().check_invariants(world).unwrap();
        details.extend(
            events
                .iter()
                .map(|event| format!("{} {}", event.kind, event.detail)),
        );
    }
    details
}

/// Gold waits at p0 until its window opens, and blue leaves p1 before. No work counts before.
#[test]
fn work_counts_only_in_the_window() {
    let window = "opens_s = 3\ndeadline_s = 8\nvalue = 2.5\n";
    let section = kind("garbage", 2.0, "") + &point("garbage", 1.0) + window;
    let section = section + &point("garbage", 0.0) + window;
    let mut world = world(&section);
    let mut events = until(&mut world, 2.0, [works(0), works(1)]);
    assert_eq!(sensed(&world, GOLD).effect, Some(0), "gold is at its place");
    events.extend(until(&mut world, 20.0, [works(0), None]));
    let expected = [
        "0 arrived - p1",
        "1 arrived - p0",
        "4 begun gold p0",
        "5.5 done gold p0",
        "8 expired - p1",
    ];
    assert_eq!(events, expected);
    assert_eq!(end(&world), Some(Outcome::Expired));
    for (name, value) in [("value_collected", 2.5), ("value_lost", 2.5)] {
        assert_eq!(figure(&world, name), FigureValue::Real(value), "{name}");
    }
    assert_eq!(figure(&world, "total"), 2_u32.into());
}

/// The log contains window and value of a point, and the value of a point that is done or expired.
#[test]
fn events_contain_the_properties() {
    let section = kind("garbage", 2.0, "") + &point("garbage", 1.0);
    let section =
        section + "opens_s = 3\nvalue = 7\n" + &point("garbage", 0.0) + "deadline_s = 1.5\n";
    let details = details_until(&mut world(&section), 20.0, [works(0), None]);
    let expected = [
        "arrived 2.000 s of work, closes at 1.500 s, value 1",
        "arrived 2.000 s of work, opens at 4.000 s, value 7",
        "expired value 1",
        "begun ",
        "done after 4.500 s, value 7",
    ];
    assert_eq!(details, expected);
}

/// Each round of a point that comes back has a window of its own. A robot that stays begins in each.
#[test]
fn each_round_has_its_window() {
    let kind = kind("garbage", 1.0, "period_s = 10\nkept = false");
    let section = "duration_s = 25\n".to_owned() + &kind + &point("garbage", 0.0) + "opens_s = 4\n";
    let mut world = world(&section);
    let events = until(&mut world, 40.0, [works(0), None]);
    let begun = events.iter().filter(|event| event.contains("begun"));
    assert!(
        begun.eq(&["4 begun gold p0", "14 begun gold p0", "24 begun gold p0"]),
        "{events:?}"
    );
    let done = events.iter().filter(|event| event.contains("done"));
    assert!(
        done.eq(&["4.5 done gold p0", "14.5 done gold p0", "24.5 done gold p0"]),
        "{events:?}"
    );
}

/// p1 arrives when p0 is done, and p2 when both are. Its window counts from the stated arrival.
#[test]
fn a_point_arrives_after_its_predecessors() {
    let section = kind("garbage", 1.0, "") + &point("garbage", 0.0) + "name = 'first'\n";
    let section = section + &point("garbage", 0.0) + "after = ['first']\n";
    let section = section + &point("garbage", 1.0) + "after = ['p1', 'p0']\nopens_s = 5\n";
    let mut world = world(&section);
    let mut events = until(&mut world, 3.0, [works(0), works(2)]);
    events.extend(until(&mut world, 20.0, [works(1), works(2)]));
    let expected = [
        "0 arrived - p0",
        "0 begun gold p0",
        "0.5 done gold p0",
        "1 arrived - p1",
        "3 begun gold p1",
        "3.5 done gold p1",
        "4 arrived - p2",
        "6 begun blue p2",
        "6.5 done blue p2",
    ];
    assert_eq!(events, expected);
    assert_eq!(end(&world), Some(Outcome::Complete));
}

/// p0 expires, and p1 and p2 after it. p4 expires while it waits for p3.
#[test]
fn a_point_expires_with_its_predecessor() {
    let next = |arrival_s: f64, more: &str| point("garbage", arrival_s) + more + "\n";
    let points = [
        next(0.0, "deadline_s = 2"),
        next(0.0, "after = ['p0']\nvalue = 3"),
        next(50.0, "after = ['p1', 'p3']"),
        next(0.0, ""),
        next(0.0, "after = ['p3']\ndeadline_s = 3"),
    ];
    let mut world = world(&(kind("garbage", 1.0, "") + &points.concat()));
    let details = details_until(&mut world, 4.0, [None, None]);
    let expected = [
        "arrived 1.000 s of work, closes at 2.000 s, value 1",
        "arrived 1.000 s of work, value 1",
        "expired value 1",
        "expired its predecessor p0 will not be done, value 3",
        "expired its predecessor p1 will not be done, value 1",
        "expired value 1",
    ];
    assert_eq!(details, expected);
    assert_eq!(counts(&world), [0, 4, 1]);
    assert_eq!(figure(&world, "value_lost"), FigureValue::Real(6.0));
}

/// p0 is done, p1 expires, p2 needs a skill that no robot has, p3 is behind a wall, and p4 is open.
#[test]
fn the_outcomes_add_up_to_the_total() {
    let at = |kind: &str, x_m: f32| {
        format!("[[service.points]]\nkind = '{kind}'\nx_m = {x_m}\ny_m = 2\n")
    };
    let text = format!(
        "step_ms = 500\nroom = {{ width_m = 8, height_m = 4 }}\n[service]\nuncovered = true\nreach_m = 1\n{}{}{}{}{}{}{}\
         [[obstacles]]\nx_m = 5\ny_m = 0\nwidth_m = 0.5\nheight_m = 4\n\
         [[robots]]\nname = 'gold'\nskills = {{ garbage = 1 }}\nstart = {{ x_m = 2, y_m = 2, heading_deg = 0 }}\n",
        kind("garbage", 2.0, ""),
        kind("floor", 2.0, ""),
        at("garbage", 2.0),
        at("garbage", 1.0) + "deadline_s = 1\n",
        at("floor", 3.0),
        at("garbage", 7.0),
        at("garbage", 3.0),
    );
    let mut world = world_of(&text);
    while world.now() < SimTime(5000) {
        world.step(&[works(0)]);
    }
    let outcomes = [
        "done",
        "expired",
        "uncovered",
        "unreachable",
        "open",
        "total",
    ];
    let counts = outcomes.map(|name| team_figures(&world).mission.get(name).count());
    assert_eq!(counts, [1, 1, 1, 1, 1, 5]);
}

/// A point that needs dust, slot 0 and task 0, and garbage, slot 1 and the task after all points.
const TOGETHER: &str = "needs = { dust = 1, garbage = 1 }\n";

/// For 2 s of work, gold with half of the skill and blue need 4 s. Alone, each of them only waits.
#[test]
fn work_proceeds_only_while_all_slots_are_filled() {
    let kinds = kind("garbage", 2.0, "kept = false") + &kind("dust", 2.0, "");
    let mut world = world(&(kinds + &point("garbage", 0.0) + TOGETHER));
    let mut events = until(&mut world, 1.0, [works(0), None]);
    events.extend(until(&mut world, 2.0, [None, works(1)]));
    events.extend(until(&mut world, 3.0, [works(0), None]));
    assert_eq!(events, ["0 arrived - p0"]);
    events = until(&mut world, 4.0, [works(0), works(1)]);
    assert_eq!(sensed(&world, GOLD).effect, Some(0));
    events.extend(until(&mut world, 5.0, [works(0), None]));
    assert_eq!(sensed(&world, GOLD).effect, None, "gold waits");
    events.extend(until(&mut world, 20.0, [works(0), works(1)]));
    let expected = [
        "3 begun gold p0",
        "3 begun blue p0",
        "4 left gold p0",
        "4 left blue p0",
        // The work of the first attempt is lost, because the kind keeps none.
        "5 begun gold p0",
        "5 begun blue p0",
        "8.5 done gold p0",
    ];
    assert_eq!(events, expected);
}

/// The skill for the kind does not count at a point with slots. Gold has no skill for the floor.
#[test]
fn only_robots_with_the_skill_fill_a_slot() {
    let kinds = kind("garbage", 2.0, "") + &kind("floor", 2.0, "");
    let point = point("garbage", 0.0) + "needs = { floor = 1, garbage = 1 }\nvalue = 2\n";
    let mut world = world(&(kinds + &point));
    let mut events = until(&mut world, 1.0, [works(0), None]);
    events.extend(until(&mut world, 2.0, [None, works(0)]));
    events.extend(until(&mut world, 3.0, [None, works(1)]));
    assert_eq!(events, ["0 arrived - p0"]);
    let details = details_until(&mut world, 20.0, [works(1), works(0)]);
    assert_eq!(
        details,
        [
            "begun ",
            "begun ",
            "done after 4.500 s, value 2, by blue, gold"
        ]
    );
}

/// Blue works at the slot for garbage. Gold, which has a lower rank, arrives there and does not displace it.
#[test]
fn a_robot_at_work_keeps_its_slot() {
    let needs = "needs = { garbage = 1 }\n";
    let mut world = world(&(kind("garbage", 3.0, "") + &point("garbage", 0.0) + needs));
    let mut events = until(&mut world, 1.0, [None, works(0)]);
    events.extend(until(&mut world, 20.0, [works(0), works(0)]));
    assert_eq!(
        events,
        ["0 arrived - p0", "0 begun blue p0", "2.5 done blue p0"]
    );
    let surplus = team_figures(&world).robots[GOLD.index()].get("surplus_s");
    assert_eq!(surplus, FigureValue::Real(2.0));
}

/// Both robots have the same slot as their task, and one of them fills the other slot. With the slots exchanged, too,
/// each robot fills the one for which it has the skill: gold has none for the floor.
#[test]
fn robots_at_a_point_fill_its_slots_by_their_skills() {
    let kinds = kind("garbage", 2.0, "") + &kind("floor", 2.0, "");
    let point = point("garbage", 0.0) + "needs = { floor = 1, garbage = 1 }\n";
    let equal =
        kind("garbage", 2.0, "") + &self::point("garbage", 0.0) + "needs = { garbage = 2 }\n";
    for (section, commands) in [
        (kinds.clone() + &point, [works(0), works(0)]),
        (kinds.clone() + &point, [works(1), works(1)]),
        (kinds + &point, [works(0), works(1)]),
        (equal.clone(), [works(0), works(0)]),
        (equal, [works(1), works(1)]),
    ] {
        let events = until(&mut world(&section), 20.0, commands);
        let mut begun = events.clone();
        begun.retain(|event| event.starts_with("0 begun"));
        begun.sort_unstable();
        assert_eq!(begun, ["0 begun blue p0", "0 begun gold p0"], "{events:?}");
        assert!(
            events.last().is_some_and(|last| last.contains("done")),
            "{events:?}"
        );
    }
}

/// Gold waits alone, and blue stands still. After 5 s this is a deadlock, and a new one after work.
#[test]
fn a_team_that_only_waits_is_a_deadlock() {
    let kinds = kind("garbage", 2.0, "") + &kind("dust", 9.0, "");
    let mut world = world(&(kinds + &point("dust", 0.0) + TOGETHER));
    let mut events = until(&mut world, 8.0, [works(0), None]);
    events.extend(until(&mut world, 9.0, [works(0), works(1)]));
    events.extend(until(&mut world, 16.0, [None, works(1)]));
    events.retain(|event| event.contains("deadlock"));
    assert_eq!(events, ["5 deadlock - ", "14 deadlock - "]);
    assert_eq!(figure(&world, "deadlocks"), 2_u32.into());
}

/// A robot at work does not charge. Afterward it gains 8 W, up to the capacity and not beyond.
#[test]
fn a_robot_without_work_charges_at_a_charger() {
    let section = garbage(60.0, "") + "[[service.chargers]]\nx_m = 6\ny_m = 4\nrate_w = 10\n";
    let mut world = world_of(&format!(
        "step_ms = 500\nenergy = {{ capacity_j = 100, idle_w = 2, drive_w = 0 }}\n[service]\nreach_m = 1000\n\
         {section}[[robots]]\nname = 'gold'\n"
    ));
    let energy_j = |world: &World| world.readings(GOLD).energy_j.unwrap();
    let mut steps = |end_s: f64, command: Option<Actuation>| {
        let mut events = Vec::new();
        while world.now() < SimTime::from_secs_f64(end_s) {
            let now_s = world.now().as_secs_f64();
            let happened = world.step(&[command]);
            events.extend(
                happened
                    .iter()
                    .map(|event| format!("{now_s} {} {}", event.kind, event.subject)),
            );
            assert!((0.0..=100.0).contains(&energy_j(&world)));
        }
        (events, energy_j(&world))
    };
    assert_eq!(steps(20.0, works(0)).1, 60.0);
    let (events, left_j) = steps(22.5, None);
    assert_eq!(
        (events, left_j),
        (
            vec!["20 left p0".to_owned(), "20 charging c0".to_owned()],
            80.0
        )
    );
    let (events, left_j) = steps(25.0, None);
    assert_eq!((events, left_j), (vec!["24.5 charged c0".to_owned()], 99.0));
}

/// Gold has less energy and charges first. A charger has one slot.
#[test]
fn the_robot_with_the_least_energy_charges_first() {
    let section = garbage(60.0, "") + &point("garbage", 0.0);
    let section = section + "[[service.chargers]]\nx_m = 6\ny_m = 4\nrate_w = 10\n";
    let mut world = world_of(&format!(
        "step_ms = 500\nenergy = {{ capacity_j = 100, idle_w = 2, drive_w = 0 }}\n[service]\nreach_m = 1000\n\
         {section}[[robots]]\nname = 'gold'\n[[robots]]\nname = 'blue'\n"
    ));
    let mut events = until(&mut world, 20.0, [works(0), works(1)]);
    events.clear();
    events.extend(until(&mut world, 21.0, [works(0), None]));
    events.extend(until(&mut world, 30.0, [None, None]));
    events.retain(|event| event.contains("charg"));
    let expected = [
        "20 charging blue c0",
        "24.5 charged blue c0",
        "25 charging gold c0",
    ];
    assert_eq!(events[..3], expected);
}

//! Deliveries, demands and capacities.

use super::properties::details_until;
use super::*;

/// Returns a team with reach 0.5 m. Gold is at p0, and the place of delivery is 2 m away.
fn delivery(more: &str) -> World {
    world_of(&format!(
        "step_ms = 500\n[service]\nreach_m = 0.5\n{}{}deliver_to = [8, 4]\n{more}\
         [[robots]]\nname = 'gold'\nstart = {{ x_m = 6, y_m = 4, heading_deg = 0 }}\n\
         [[robots]]\nname = 'blue'\nstart = {{ x_m = 6, y_m = 4.4, heading_deg = 0 }}\n",
        kind("garbage", 1.0, ""),
        point("garbage", 0.0),
    ))
}

fn drives_and_works(point: u32) -> Option<Actuation> {
    Some(Actuation {
        speed_m_s: 0.5,
        ..works(point).unwrap()
    })
}

/// After the work at its place, gold carries the load. Blue can do nothing, and the point is done at the delivery.
#[test]
fn a_load_is_delivered() {
    let mut world = delivery("");
    let mut events = until(&mut world, 1.0, [works(0), None]);
    assert_eq!(
        events,
        ["0 arrived - p0", "0 begun gold p0", "0.5 picked-up gold p0"]
    );
    let reading = sensed(&world, GOLD);
    assert_eq!(reading.effect, Some(0), "gold carries the load");
    assert_eq!(reading.points.unwrap()[0].at, Vec2::new(8.0, 4.0));
    assert_eq!(until(&mut world, 3.0, [None, works(0)]), [""; 0]);
    events = until(&mut world, 20.0, [drives_and_works(0), works(0)]);
    // 1.5 m at 0.5 m/s lead within reach of the place.
    assert_eq!(events, ["6 done gold p0"]);
    assert_eq!(end(&world), Some(Outcome::Complete));
}

/// A robot that is lost, and one that begins other work, lose the load. The work begins again at its first place.
#[test]
fn a_lost_load_returns_to_its_place() {
    let mut world = delivery(&point("garbage", 0.0));
    until(&mut world, 1.0, [works(0), None]);
    let lost = world.release_load(GOLD);
    let lost: Vec<String> = lost.iter().map(|event| event.kind.to_string()).collect();
    assert_eq!(lost, ["load-lost"]);
    let facts = sensed(&world, BLUE).points.unwrap();
    let round_of = |point| facts.iter().find(|fact| fact.point == point).unwrap().round;
    assert_eq!([0, 1].map(round_of), [1, 0]);
    assert_eq!(
        until(&mut world, 3.0, [None, works(0)]),
        ["1 begun blue p0", "1.5 picked-up blue p0"]
    );
    let events = until(&mut world, 4.0, [None, works(1)]);
    assert_eq!(
        events,
        ["3 load-lost blue p0", "3 begun blue p1", "3.5 done blue p1"]
    );
    assert_eq!(counts(&world), [1, 0, 1]);
}

/// A point whose load is on the way expires as any other.
#[test]
fn a_load_expires_with_its_point() {
    let mut world = delivery("deadline_s = 2\n");
    let events = until(&mut world, 4.0, [works(0), None]);
    assert_eq!(events[2..], ["0.5 picked-up gold p0", "2 expired - p0"]);
    assert_eq!(sensed(&world, GOLD).effect, None);
}

/// Returns a team with reach 1,000 m and points with demands 3, 2 and 2. Gold carries at most 5, and blue any load.
fn demands(delivery: &str) -> World {
    let point = |demand: u32| format!("{}demand = {demand}\n{delivery}", point("garbage", 0.0));
    let points: String = [3, 2, 2].map(point).concat();
    let kind = kind("garbage", 1.0, "");
    world_of(&format!(
        "step_ms = 500\n[service]\nreach_m = 1000\n{kind}{points}\
         [[robots]]\nname = 'gold'\ncapacity = 5\n[[robots]]\nname = 'blue'\n"
    ))
}

/// Gold keeps the demands of the points that it has done. The third one does not fit, and blue takes it.
#[test]
fn a_robot_carries_at_most_its_capacity() {
    let mut world = demands("");
    let mut events = until(&mut world, 1.0, [works(0), None]);
    events.extend(until(&mut world, 2.0, [works(1), None]));
    events.extend(until(&mut world, 4.0, [works(2), None]));
    let done = events.iter().filter(|event| !event.contains("arrived"));
    let expected = [
        "0 begun gold p0",
        "0.5 done gold p0",
        "1 begun gold p1",
        "1.5 done gold p1",
    ];
    assert!(done.eq(&expected), "{events:?}");
    assert_eq!(sensed(&world, GOLD).effect, None);
    let details = details_until(&mut world, 5.0, [works(2), works(2)]);
    assert_eq!(details, ["begun ", "done after 4.500 s, value 1, load 2"]);
    assert_eq!(end(&world), Some(Outcome::Complete));
}

/// The load of a restarted agent stays with the body.
#[test]
fn taken_demands_survive_the_agent() {
    let mut world = demands("");
    until(&mut world, 1.0, [works(0), None]);
    until(&mut world, 2.0, [works(1), None]);
    world.release_load(GOLD);
    assert_eq!(until(&mut world, 4.0, [works(2), None]), [""; 0]);
}

/// A delivery frees the capacity: all three points of 7 in all are done by gold.
#[test]
fn a_delivered_load_leaves_room_for_the_next() {
    let mut world = demands("deliver_to = [8, 4]\n");
    let mut details = Vec::new();
    for (point, end_s) in [(0, 2.0), (1, 4.0), (2, 6.0)] {
        details.extend(details_until(&mut world, end_s, [works(point), None]));
    }
    let picked = details
        .iter()
        .filter(|detail| detail.starts_with("picked-up"));
    let expected = ["picked-up load 3", "picked-up load 2", "picked-up load 2"];
    assert!(picked.eq(&expected), "{details:?}");
    assert_eq!(end(&world), Some(Outcome::Complete));
}
